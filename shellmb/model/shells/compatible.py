"""Forces and own strains of a shell's elements that belong to given strains, cell by cell."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any, Protocol

from mpi4py import MPI as _MPI  # noqa: F401  (before dolfinx)

import numpy as np
import ufl
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.forms.measure import Measure
from shellmb.forms.steps.mixed import LinearMixed, LinearOwn
from shellmb.forms.tying import COUNT, Tying
from shellmb.meshes.spaces import MixedSpace
from shellmb.model.sections.section import BoundSection
from shellmb.model.sections.strains import Integrate
from shellmb.native.kernels import compiled


class Tied(Protocol):
    """A shell on its mesh.

    Attributes:
        mixed: Space of its states.
        tying: Maps of the forces of its elements.
        section: Its section there.
    """

    mixed: MixedSpace
    tying: Tying
    section: BoundSection

    @property
    def strain(self) -> Measure:
        """Strains of the displacements."""
        ...

    @property
    def integrate(self) -> Integrate:
        """Integral of densities, by rule."""
        ...


class CellSystem:
    """Linear equations of each cell by itself.

    Args:
        space: Discontinuous space of the unknowns.
        matrix: Bilinear form, whose values do not change.
        given: Linear form, whose values may.
    """

    def __init__(self, space: fem.FunctionSpace, matrix: Form, given: Form) -> None:
        self._matrix, self._given = matrix, compiled(given)
        self.function = fem.Function(space)

    @cached_property
    def _factors(self) -> Any:
        from scipy.sparse.linalg import splu  # it loads much, which most runs do without

        A = fem.assemble_matrix(compiled(self._matrix)).to_scipy()
        # columns of cells of other ranks are empty
        return splu(A[:, : A.shape[0]].tocsc())

    def solve(self) -> fem.Function:
        """Solution, ghosts included; collective."""
        f, vector = self.function, fem.assemble_vector(self._given)
        local = f.function_space.dofmap.index_map.size_local * f.function_space.dofmap.bs
        # what another rank owns comes from there
        f.x.array[:local] = self._factors.solve(np.asarray(vector.array)[:local])
        f.x.scatter_forward()
        return f


def compatible(shell: Tied, e: Expr) -> CellSystem:
    """Equations of the forces, or of the own strains where elements have some, of strains.

    Args:
        shell: The shell.
        e: The strains, shape (8,); functions in it may change.
    """
    section, tying, integrate = shell.section.formulation, shell.tying, shell.integrate
    space = shell.mixed.subspaces["N" if isinstance(section, LinearMixed) else "S"]
    dN, found = tying.forces(ufl.TestFunction(space)), tying.forces(ufl.TrialFunction(space))
    if isinstance(section, LinearMixed):
        nothing, still = ufl.as_vector([0] * COUNT), ufl.as_vector([0] * 8)
        own = section.gap(still, still, section.N0 * found, dN)[0]
        return CellSystem(space, integrate([-own]), integrate(section.gap(e, e, nothing, dN)))
    eps = ufl.as_vector([e[k] for k in range(3)])
    works = [ufl.dot(tying.whole(dN), eps), *(ufl.dot(s, e) for s in tying.works(dN))]
    matrix = ufl.dot(tying.force(dN), tying.strain(found))
    return CellSystem(space, integrate([matrix]), integrate(works))


def balanced(shell: Tied, e: Expr, own: fem.Function) -> CellSystem:
    """Equations of the forces of own strains with a linear section.

    Args:
        shell: The shell.
        e: Strains of the displacements, shape (8,).
        own: The own strains.
    """
    section, tying, space = shell.section.formulation, shell.tying, shell.mixed.subspaces["N"]
    assert isinstance(section, LinearOwn)
    dS, found = tying.forces(ufl.TestFunction(space)), tying.forces(ufl.TrialFunction(space))
    n, _, Q = section.stresses(tying.forces(own), e)
    matrix = ufl.dot(tying.strain(dS), section.N0 * tying.force(found))
    given = ufl.dot(tying.strain(dS), ufl.as_vector([*n, *((1 - section.a) * Q)]))
    return CellSystem(space, shell.integrate([matrix]), shell.integrate([given]))


def forces_of(shell: Tied, e: Expr) -> Expr:
    """Forces of elements, behind their own strains where they have some, of given strains.

    They are what `forces` of the formulation of a linear section is of a state.
    """
    section, tying, own = shell.section.formulation, shell.tying, compatible(shell, e).solve()
    if isinstance(section, LinearMixed):
        return section.N0 * tying.forces(own)
    assert isinstance(section, LinearOwn)
    N = balanced(shell, e, own).solve()
    return ufl.as_vector([*tying.forces(own), *(section.N0 * tying.forces(N))])


def rates_of(shell: Tied, q: fem.Function, v: fem.Function) -> Callable[[], None]:
    """Function that gives a velocity its rates of forces and own strains; collective.

    Args:
        shell: The shell.
        q: State.
        v: Velocity.
    """
    e = shell.strain.change(q, v)
    first = compatible(shell, e)
    systems = {"N" if isinstance(shell.section.formulation, LinearMixed) else "S": first}
    if isinstance(shell.section.formulation, LinearOwn):
        systems["N"] = balanced(shell, e, first.function)

    def follow() -> None:
        for part, system in systems.items():
            v.x.array[shell.mixed.dofs[part]] = system.solve().x.array

    return follow
