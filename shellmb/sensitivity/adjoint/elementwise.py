"""Numbers in each element of a shell: thicknesses, angles and offsets of its section.

What follows from a section in an element depends on the numbers of that element alone. So
differences of two sections, of which all numbers are larger in one and smaller in the other, tell
how every coefficient changes with each of them.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from copy import copy
from dataclasses import fields as fields_of
from dataclasses import is_dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import ufl
from dolfinx import fem
from ufl.algorithms.analysis import extract_coefficients
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.forms.shell import Mass
from shellmb.model.sections.branches import MaxwellBranches
from shellmb.model.sections.section import BoundSection, bind_mass, bind_section
from shellmb.model.shells.shell import ShellModel
from shellmb.native.kernels import compiled
from shellmb.scene import LinearSection, Scene, Shell
from shellmb.sensitivity.adjoint.objective import FOURTH
from shellmb.sensitivity.adjoint.transposed import Change

if TYPE_CHECKING:
    import pandas as pd


# distance of differences: coefficients are smooth in thickness and angle, so that error and
# round-off are both near 1e-12
APART = 1e-3
# distance of angles, degrees; of lengths it is relative
DEGREES = 0.1


def changes(model: ShellModel, name: str, branches: MaxwellBranches | None) -> list[Change]:
    """Changes of the coefficients of a shell by a parameter in each element; collective.

    Args:
        model: The shell.
        name: The parameter, which is a function of the position.
        branches: Its Maxwell branches; None: none.

    Raises:
        SceneError: If the mass is eccentric: its coefficients are not element by element.
    """
    if model.mass is not None and model.mass.s is not None:
        raise SceneError(
            f"adjoint: the mass of shell '{model.name}' is eccentric; fields of numbers need "
            "offset=0, or eccentric_inertia=False"
        )
    found = _functions(model.section, branches, model.mass, model.mass_of_section)
    sums = [np.zeros_like(f.x.array) for f in found]
    domain = model.mixed.space.mesh
    for weight, shell in shells_beside(model, name):
        bound = bind_section(shell, domain, model.tying, model.section, model.mass is None)
        every = replace(shell, rotary_inertia=True, eccentric_inertia=True)
        weighed = None if model.mass_of_section is None else bind_mass(every, domain)
        mass = None if model.mass is None else bind_mass(shell, domain)
        like = copy(model)
        like.shell, like.section = shell, bound
        others = _functions(bound, branches and like.branches(), mass, weighed)
        for total, other in zip(sums, others, strict=True):
            total += weight * other.x.array
    made = []
    for function, values in zip(found, sums, strict=True):
        derivative = fem.Function(function.function_space)
        derivative.x.array[:] = values
        made.append(Change(function, derivative))
    return made


def shells_beside(model: ShellModel, name: str) -> Iterator[tuple[float, Shell]]:
    """The shell with larger and smaller numbers of a parameter, and weights of their differences.

    Args:
        model: The shell.
        name: The parameter, which is a function of the position.
    """
    size = DEGREES if name.endswith("angle") else APART * model.section.thickness
    for offset, weight in FOURTH:

        def moved(value: Any, by: float = offset * size) -> Callable[[Any], Any]:
            return lambda x: np.asarray(value(x), dtype=float) + by

        section = changed(model.shell, name, moved)
        yield weight / size, replace(model.shell, section=section)


def _functions(
    bound: BoundSection, branches: MaxwellBranches | None, *masses: Mass | None
) -> list[fem.Function]:
    """Coefficients that are fields, each once, in an order that is always the same."""
    # an energy of strains has its stiffness
    forms = [bound.formulation, getattr(bound.formulation, "psi", None)]
    parts = [getattr(form, f.name) for form in forms if is_dataclass(form) for f in fields_of(form)]
    parts += [] if branches is None else [group.C for group in branches]
    parts += [part for mass in masses for part in mass or ()]
    every = [f for part in parts if isinstance(part, Expr) for f in extract_coefficients(part)]
    return list(dict.fromkeys(f for f in every if isinstance(f, fem.Function)))


def by_element(model: ShellModel, name: str, derivative: Floats) -> pd.DataFrame:
    """A table with a row for each element, in the order of the mesh; collective.

    Args:
        model: The shell.
        name: The parameter, a function of the position.
        derivative: One number for each element of this rank, ghosts included.
    """
    import pandas as pd

    domain = model.mixed.space.mesh
    local = domain.topology.index_map(2).size_local
    corners = domain.geometry.x[domain.geometry.dofmaps[0][:local]]
    x = corners.mean(axis=1)
    one = fem.Function(fem.functionspace(domain, ("DG", 0)))
    areas = fem.assemble_vector(compiled(ufl.TestFunction(one.function_space) * ufl.dx))
    value = _parameter(model.shell, name)(x.T)
    order = domain.topology.original_cell_index[:local]
    columns = [order, *x.T, areas.array[:local], value, derivative[:local]]
    parts = domain.comm.allgather(np.column_stack(columns))
    names = ["element", "x", "y", "z", "area", "value", "derivative"]
    table = pd.DataFrame(np.concatenate(parts), columns=names).sort_values("element")
    return table.drop(columns="element").reset_index(drop=True)


def _parameter(shell: Shell, name: str) -> Callable[[Any], Any]:
    """A parameter as a function of positions, shape (3, n)."""
    found: list[Any] = []

    def note(value: Any) -> Any:
        found.append(value)
        return value

    changed(shell, name, note)
    return lambda x: np.broadcast_to(found[0](x), np.shape(x)[1])


class ElementField(NamedTuple):
    """A parameter of a section that is a number in each element.

    Args:
        body: Name of the shell.
        name: Name of the parameter: "thickness", "angle", "offset", "plies[2].angle".
    """

    body: str
    name: str


def varying(scene: Scene, places: tuple[ElementField, ...]) -> Scene:
    """A scene in which those parameters are functions of the position, as they were.

    Args:
        scene: The scene.
        places: The parameters.

    Raises:
        SceneError: If there is no such shell or parameter, or its derivatives are not known.
    """
    shells = {shell.name: shell for shell in scene.shells}
    for body, name in places:
        shell = shells.get(body)
        if shell is None:
            known = ", ".join(f"'{s}'" for s in shells) or "none"
            raise SceneError(f"adjoint: there is no shell '{body}'; there are {known}")
        _refuse(shell)
        shells[body] = replace(shell, section=changed(shell, name, _as_function))
    return replace(scene, shells=tuple(shells.values())) if places else scene


def _refuse(shell: Shell) -> None:
    """Refuse bodies without elements, and sections not made of coefficients element by element."""
    how, kind = "rigid" if shell.rigid else "reduced to modes", type(shell.section).__name__
    wanting = {
        f"is {how}; fields of numbers need model='exact' or 'floating-frame', or differentiate by "
        "parameters of the scene function": not shell.nodal,
        f"has a {kind}; fields of numbers need a linear section": (
            not isinstance(shell.section, LinearSection)
        ),
        "has strains of its own; fields of numbers need strains=None": shell.strains is not None,
    }
    for said, there in wanting.items():
        if there:
            raise SceneError(f"adjoint: shell '{shell.name}' {said}")


def _as_function(value: Any) -> Callable[[Any], Any]:
    return value if callable(value) else lambda x: np.full(np.shape(x)[1], float(value))


def changed(shell: Shell, name: str, change: Callable[[Any], Any]) -> LinearSection:
    """The section with one of its parameters changed.

    Raises:
        SceneError: If it has no such parameter.
    """
    section: Any = shell.section
    found = re.fullmatch(r"plies\[(\d+)\]\.(thickness|angle)", name)
    plies = getattr(section, "plies", ())
    if found and int(found[1]) < len(plies):
        k, part = int(found[1]), found[2]
        ply = replace(plies[k], **{part: change(getattr(plies[k], part))})
        return replace(section, plies=(*plies[:k], ply, *plies[k + 1 :]))
    own = {f.name for f in fields_of(section)}
    known: list[str] = [n for n in ("thickness", "angle", "offset") if n in own]
    known += [f"plies[{k}].{n}" for k in range(len(plies)) for n in ("thickness", "angle")]
    if name not in known:
        raise SceneError(
            f"adjoint: the section of shell '{shell.name}' has no '{name}' that may vary; it has "
            + ", ".join(known)
        )
    return replace(section, **{name: change(getattr(section, name))})
