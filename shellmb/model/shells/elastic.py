"""Strains of a shell with their section, their damping and relaxation, and forces of strains.

Forces and own strains of elements that belong to given strains are found cell by cell.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property, partial
from typing import Any

from mpi4py import MPI

import basix
import numpy as np
import ufl
from dolfinx import fem
from ufl import Form
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives
from ufl.constantvalue import Zero
from ufl.core.expr import Expr
from ufl.corealg.traversal import traverse_unique_terminals

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.forms import shell as shell_forms
from shellmb.forms.measure import Measure
from shellmb.forms.steps.damping import ViscousShell
from shellmb.forms.steps.mixed import LinearMixed, LinearOwn, Stiffness, assumed
from shellmb.forms.steps.mixed_nonlinear import NonlinearMixed, tangent
from shellmb.forms.steps.path import is_quadratic
from shellmb.forms.surface import Surface
from shellmb.forms.tying import COUNT
from shellmb.model.sections.branches import Fading, MaxwellBranches, StrainDamping
from shellmb.model.sections.section import SectionFields, couples
from shellmb.model.sections.strains import (
    GeneralStrains,
    HyperelasticStrains,
    SectionStrains,
    Strains,
)
from shellmb.model.shells.discrete_shell import DiscreteShell
from shellmb.native.expressions import values_in_cells
from shellmb.native.kernels import compiled
from shellmb.scene import LinearSection
from shellmb.scene.shells.lamination import Layup
from shellmb.scene.values.validate import show

# a strain at rest, of a shell as thick as it is, that counts as round-off
NONE = 1e-10


def shell_strains(shell: DiscreteShell) -> tuple[SectionStrains, ...]:
    """Strains of a shell with their section.

    Args:
        shell: The shell.

    Raises:
        SceneError: If strains of the user are not zero at rest.
    """
    quadratic = quadratic_strains(shell)
    section, h = shell.section.formulation, shell.thickness
    _refuse_prestrain(shell)
    weight = (1, 1, 1, h**2, h**2, h**2, 1, 1)
    common = shell.layout, shell.strain, shell.integrate
    if isinstance(section, NonlinearMixed):
        return (HyperelasticStrains(section, *common, quadratic, weight, _product_of(shell)),)
    if quadratic:
        return (Strains(section, *common),)
    return (GeneralStrains(section, *common, weight, _product_of(shell)),)


def _refuse_prestrain(shell: DiscreteShell) -> None:
    """Refuse strains of the user that are not zero at rest: resultants begin as zero; collective.

    Raises:
        SceneError: Names the largest of them.
    """
    if shell.strain.rest is None:
        return
    domain, h = shell.mixed.space.mesh, shell.thickness
    e = shell.strain.rest(ufl.Coefficient(shell.mixed.space))
    if isinstance(e, Zero):
        return
    # on the mesh, whatever the strains are of
    one = fem.Constant(domain, 1.0)
    sizes = ufl.as_vector([e[k] * (h if k in (3, 4, 5) else one) for k in range(8)])
    points, _ = basix.make_quadrature(domain.basix_cell(), 4)
    found = np.abs(values_in_cells(sizes, points, domain)())
    largest = domain.comm.allreduce(float(np.max(found, initial=0.0)), op=MPI.MAX)
    if not largest < NONE:
        linear = not isinstance(shell.section.formulation, NonlinearMixed)
        raise SceneError(
            f"shell '{shell.name}': strains {show(shell.shell.strains)} gives a strain of "
            f"{largest:.3g} where displacement and director change are 0; it must be 0 there: give "
            f"a prestrain by {'natural, with the opposite sign' if linear else 'the energy'}"
        )


def _product_of(shell: DiscreteShell) -> Callable[[Expr, Expr], Expr]:
    """Product of two states of a shell, by their gradients and directors."""
    return partial(_product, shell.layout.moved, shell.surface, shell.thickness)


def _product(
    straining: Callable[[Expr], tuple[Expr, Expr]], surface: Surface, h: Expr, a: Expr, b: Expr
) -> Expr:
    first, second = (shell_forms.tangents(*straining(q), surface) for q in (a, b))
    sizes = 1, 1, 1, h**2, h**2
    return sum(s * ufl.dot(x, y) for s, x, y in zip(sizes, first, second, strict=True))


def quadratic_strains(shell: DiscreteShell) -> bool:
    """Decide whether strains are at most quadratic in the state."""
    if shell.shell.strains is None:
        return True
    return is_quadratic(shell.strain.value, ufl.Coefficient(shell.mixed.space))


# eigenvalues of a stiffness that are less than this, relative to the largest, are round-off
NEGATIVE = 1e-10


def strain_damping(shell: DiscreteShell) -> StrainDamping | None:
    """Damping of the strains of a shell; None without any.

    Args:
        shell: The shell on its mesh.

    Raises:
        SceneError: If strains of the user are not quadratic, or an energy is not convex where it
            is undeformed.
    """
    times = shell.shell.section.damping_times
    if not any(times):
        return None
    if not quadratic_strains(shell):
        own = shell.shell.strains
        raise SceneError(
            f"shell '{shell.name}': strains is {getattr(own, '__name__', own)}, which is not "
            "quadratic in displacement and director; with damping of the section it must be, or "
            "the damping a term of the shell"
        )
    formulation, strain = shell.section.formulation, shell.strain
    if isinstance(formulation, NonlinearMixed):
        parts = _of_rest(shell, formulation, strain)
    else:
        parts = _linear(shell, formulation, strain)
    return StrainDamping(parts, partial(rates_of, shell)) if parts else None


def _linear(
    shell: DiscreteShell, section: LinearMixed | LinearOwn, strain: Measure
) -> list[Strains]:
    """Damping of a linear section; of strains that are constrained none."""
    membrane, bend, shear = shell.shell.section.damping_times

    def constant(time: float, acts: bool = True) -> Expr | None:
        return fem.Constant(shell.mixed.space.mesh, time) if time and acts else None

    times = (
        constant(membrane, shell.shell.stretching),
        constant(bend),
        constant(shear, shell.shell.transverse_shear),
    )
    if not any(time is not None for time in times):
        return []
    return [Strains(ViscousShell(section, *times), shell.layout, strain, shell.integrate)]


def _of_rest(shell: DiscreteShell, section: NonlinearMixed, strain: Measure) -> list[Strains]:
    """Damping of the elements' own strains, but for a share of the shear."""
    A, B, D, G = stiffness_at_rest(shell, section)
    if not any(part is not None for part in (A, B, D, G)):
        return []
    layout, a, on = shell.layout, section.a, shell.integrate
    own = _whole(A, B, D, None if G is None else (1 - a) * G)
    found = [Strains(Stiffness(own), layout, assumed(strain, layout), on)]
    if G is not None and not isinstance(a, Zero):
        shared = Stiffness(_whole(None, None, None, a * G))
        found.append(Strains(shared, layout, strain, on))
    return found


type Parts = tuple[Expr | None, Expr | None, Expr | None, Expr | None]


def stiffness_at_rest(shell: DiscreteShell, section: NonlinearMixed) -> Parts:
    """Damping from the stiffness of an energy at zero strain: membrane, coupling, bending, shear.

    Args:
        shell: The shell on its mesh.
        section: Its mixed form.

    Raises:
        SceneError: If that is not positive.
    """
    mesh = shell.mixed.space.mesh
    e = fem.Constant(mesh, np.zeros(8))
    C = _numbers(tangent(section.energy_density, e))
    label = getattr(shell.shell.section, "label", "section")
    scale = np.sqrt(np.abs(np.outer(C.diagonal(), C.diagonal())))
    least = np.linalg.eigvalsh(C / np.where(scale > 0, scale, 1.0)).min()
    if not least >= -NEGATIVE:
        raise SceneError(
            f"shell '{shell.name}': the energy of its {label} has a stiffness at zero strain that "
            f"is not positive (scaled, its least eigenvalue is {show(float(f'{least:.3g}'))}); "
            "with damping, which is in proportion to it, it must be"
        )
    membrane, bend, shear = shell.shell.section.damping_times
    B = math.sqrt(membrane * bend) * C[:3, 3:6]

    def part(time: float, value: Floats) -> Expr | None:
        return fem.Constant(mesh, np.ascontiguousarray(time * value)) if time else None

    coupling = part(1.0, B) if np.abs(B).max() > 0 else None
    own = part(membrane, C[:3, :3]), part(bend, C[3:6, 3:6]), part(shear, C[6:, 6:])
    return own[0], coupling, own[1], own[2]


def maxwell_branches(shell: DiscreteShell) -> MaxwellBranches | None:
    """Maxwell branches of a shell's section; None without any.

    Args:
        shell: The shell on its mesh.

    Raises:
        SceneError: If strains of the user are not quadratic.
    """
    section = shell.shell.section
    if not (isinstance(section, LinearSection) and section.relaxes):
        return None
    if not quadratic_strains(shell):
        own = shell.shell.strains
        raise SceneError(
            f"shell '{shell.name}': strains is {getattr(own, '__name__', own)}, which is not "
            "quadratic in displacement and director; with relaxation of the section it must be"
        )
    mixed, seen = shell.section.formulation, assumed(shell.strain, shell.layout)
    assert isinstance(mixed, NonlinearMixed)
    fields, found = SectionFields(shell.shell, shell.mixed.space.mesh), []
    for shares, branches in section.generic.branches.items():

        def part(name: str, shares: tuple[float, ...] = shares) -> Expr:
            def value(at: Layup) -> Floats:
                return np.asarray(getattr(at.scaled(shares), name))

            return fields.of(value)

        B, G = part("B") if couples(shell.shell, section) else None, part("G")
        common = branches, shell.rules.full, shell.mixed.space.mesh
        found.append(Fading(seen, _whole(part("A"), B, part("D"), (1 - mixed.a) * G), *common))
        if not isinstance(mixed.a, Zero):
            found.append(Fading(shell.strain, _whole(None, None, None, mixed.a * G), *common))
    return MaxwellBranches(shell.name, shell.layout, found)


def _whole(A: Expr | None, B: Expr | None, D: Expr | None, G: Expr | None) -> Expr:
    """Stiffness of all strains, shape (8, 8); what is None is zero."""
    blocks = {(0, 0): A, (0, 1): B, (1, 1): D, (2, 2): G}

    def entry(i: int, j: int) -> Expr | int:
        first, last = min(i, j), max(i, j)
        block = blocks.get((first // 3, last // 3))
        return 0 if block is None else block[first % 3, last % 3]

    return ufl.as_matrix([[entry(i, j) for j in range(8)] for i in range(8)])


def _numbers(matrix: Expr) -> Floats:
    """Values of an expression of Constants, shape (n, n)."""
    lowered = apply_derivatives(apply_algebra_lowering(matrix))
    terminals = traverse_unique_terminals(lowered)
    known = {c: c.value.tolist() for c in terminals if isinstance(c, fem.Constant)}
    n, m = lowered.ufl_shape
    return np.array([[float(lowered[i, j]((0.0,) * 3, known)) for j in range(m)] for i in range(n)])


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


def compatible(shell: DiscreteShell, e: Expr) -> CellSystem:
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


def balanced(shell: DiscreteShell, e: Expr, own: fem.Function) -> CellSystem:
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


def forces_of(shell: DiscreteShell, e: Expr) -> Expr:
    """Forces of elements, behind their own strains where they have some, of given strains.

    They are what `forces` of the formulation of a linear section is of a state.
    """
    section, tying, own = shell.section.formulation, shell.tying, compatible(shell, e).solve()
    if isinstance(section, LinearMixed):
        return section.N0 * tying.forces(own)
    assert isinstance(section, LinearOwn)
    N = balanced(shell, e, own).solve()
    return ufl.as_vector([*tying.forces(own), *(section.N0 * tying.forces(N))])


def rates_of(shell: DiscreteShell, q: fem.Function, v: fem.Function) -> Callable[[], None]:
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
