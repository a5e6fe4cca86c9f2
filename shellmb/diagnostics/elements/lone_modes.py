"""Linear buckling tells of modes in which elements buckle one by one.

Shear that forces of elements do not see is resisted by the share of displacements alone
(`docs/theory/shells.md`). Under compression some elements buckle into it before the shell does.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from dolfinx import fem

from shellmb.arrays import Floats
from shellmb.forms.steps.mixed import LinearMixed, LinearOwn
from shellmb.model.model import Model
from shellmb.system.assembly.functionals import functionals

# part of a mode's strain energy: 0.25 to 0.5 where elements buckle; 0.002 where shells do, up to
# 0.07 in modes that a mesh of triangles hardly has
BOUND = 0.15


def lone_modes(model: Model, modes: Iterable[Callable[[str], Floats]]) -> list[str]:
    """Sentences on shells whose elements buckle one by one; collective.

    Args:
        model: The bodies.
        modes: Parts of each mode by names of bodies.
    """
    modes, said = list(modes), []
    for name, body in model.shells.items():
        formulation = body.section.formulation
        if not isinstance(formulation, LinearMixed | LinearOwn):
            continue
        still, mode = (fem.Function(body.mixed.space) for _ in range(2))
        e, N = body.strain.change(still, mode), formulation.forces(body.layout, mode)
        unseen, stored = formulation.unseen(e, N), formulation.stored(e, N)
        energies = functionals([[body.integrate([unseen])], [body.integrate(stored)]], model.comm)
        found = []
        for number, part in enumerate(modes, start=1):
            mode.x.array[:] = part(name)
            hidden, whole = map(float, energies())
            if hidden > BOUND * whole > 0:
                found.append((hidden / whole, number))
        if found:
            numbers = ", ".join(str(number) for _, number in found)
            which = f"mode {numbers} is" if len(found) == 1 else f"modes {numbers} are"
            said.append(
                f"{which} of single elements of shell '{name}', not of the shell: up to "
                f"{100 * max(found)[0]:.0f} % of the energy is shear that the forces of elements "
                "do not see; refine the mesh until no mode is"
            )
    return said
