"""Linear buckling tells of modes in which triangles buckle one by one.

Shear that forces of triangles do not see is resisted by the share of displacements alone
(`docs/theory/shells.md`). Under compression some elements buckle into it before the shell does.
Forces of quadrilaterals see all shear.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from mpi4py import MPI

import numpy as np
from basix import CellType
from dolfinx import fem

from shellmb.arrays import Floats
from shellmb.forms.steps.mixed import LinearOwn
from shellmb.forms.steps.mixed_nonlinear import NonlinearMixed
from shellmb.model.model import Model
from shellmb.system.assembly.functionals import functionals

# Part of a mode's strain energy: 0.17 to 0.47 where elements buckle, and up to 0.11 in modes that
# the mesh hardly has
BOUND = 0.15
# displacements over the thickness, and changes of directors, at which energies are squares
SMALL = 1e-2


def lone_modes(model: Model, modes: Iterable[Callable[[str], Floats]]) -> list[str]:
    """Sentences on shells whose elements buckle one by one; collective.

    Args:
        model: The bodies.
        modes: Parts of each mode by names of bodies.
    """
    modes, said = list(modes), []
    for name, body in model.shells.items():
        if body.mixed.space.mesh.basix_cell() != CellType.triangle:
            continue
        mode, dofs = fem.Function(body.mixed.space), body.mixed.dofs
        thickness = body.section.sizes.thickness
        at = body.strain, body.layout, mode
        formulation = body.section.formulation
        assert isinstance(formulation, LinearOwn | NonlinearMixed)
        unseen, stored = formulation.unseen(*at), formulation.energy(*at)
        energies = functionals([[body.integrate([unseen])], [body.integrate(stored)]], model.comm)
        found = []
        for number, part in enumerate(modes, start=1):
            sizes = (np.abs(part(name)[dofs[k]]).max(initial=0.0) for k in ("u", "w"))
            moved, turned = (model.comm.allreduce(size, op=MPI.MAX) for size in sizes)
            if not (size := max(moved / thickness, turned)):
                continue
            mode.x.array[:] = SMALL / size * part(name)
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
