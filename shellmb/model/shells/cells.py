"""Maps of the forces of a shell's elements (`forms.tying`) on its mesh."""

from __future__ import annotations

from mpi4py import MPI as _MPI  # noqa: F401  (before dolfinx)

import ufl
from dolfinx import fem, mesh
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.forms.surface import Surface
from shellmb.forms.tying import Tying, tying
from shellmb.meshes.shared import space_on
from shellmb.meshes.tying import cell_directions, cell_sizes, shell_forces


def bind_tying(domain: mesh.Mesh, degree: int, surf: Surface) -> Tying:
    """Maps of the forces of elements.

    Args:
        domain: Mesh of the shell.
        degree: Degree of displacements.
        surf: Its local basis.
    """
    forces = shell_forces(domain.basix_cell(), degree)
    direction = None
    if forces.constants:
        direction = _per_cell(domain, cell_directions(domain), 3)
    size = _per_cell(domain, cell_sizes(domain), 1)
    components = forces.weights, forces.polynomials, forces.constants
    rules = tuple(rule.strains for rule in forces.rules)
    return tying(ufl.Jacobian(domain), surf, direction, size, components, rules)


def _per_cell(domain: mesh.Mesh, values: Floats, size: int) -> Expr:
    shape = (size,) if size > 1 else ()
    function = fem.Function(space_on(domain, ("DG", 0, shape) if shape else ("DG", 0)))
    function.x.array[:] = values.ravel()
    return function
