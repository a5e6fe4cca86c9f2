"""Strains of a shell with their section, their damping and relaxation, and forces of strains.

Forces and own strains of elements that belong to given strains are found cell by cell.
"""

import math
from collections.abc import Callable
from functools import cached_property
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
from shellmb.forms.steps.damping import ViscousShell
from shellmb.forms.steps.mixed import LinearMixed, LinearOwn, Stiffness, assumed
from shellmb.forms.steps.mixed_nonlinear import NonlinearMixed, tangent
from shellmb.forms.steps.path import is_quadratic
from shellmb.forms.tying import COUNT
from shellmb.model.sections.branches import Fading, MaxwellBranches, StrainDamping
from shellmb.model.sections.section import SectionFields, couples
from shellmb.model.sections.strains import GeneralStrains, HyperelasticStrains, Strains
from shellmb.model.shells.discrete_shell import DiscreteShell
from shellmb.native.expressions import values_in_cells
from shellmb.native.kernels import compiled
from shellmb.scene import LinearSection
from shellmb.scene.shells.lamination import Layup
from shellmb.scene.values.validate import show

# a strain at rest, of a shell as thick as it is, that counts as round-off
NONE = 1e-10
# eigenvalues of a stiffness that are less than this, relative to the largest, are round-off
NEGATIVE = 1e-10

type Parts = tuple[Expr | None, Expr | None, Expr | None, Expr | None]


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


class ElasticShell(DiscreteShell):
    """A shell with forces of its strains, and their damping and relaxation."""

    @cached_property
    def elastic(self) -> tuple[Strains | GeneralStrains | HyperelasticStrains]:
        """Strains of a shell with their section.

        Raises:
            SceneError: If strains of the user are not zero at rest.
        """
        section, h = self.section.formulation, self.thickness
        self._refuse_prestrain()
        weight = (1, 1, 1, h**2, h**2, h**2, 1, 1)
        common = self.layout, self.strain, self.integrate
        if isinstance(section, NonlinearMixed):
            return (HyperelasticStrains(section, *common, self.quadratic, weight, self._product),)
        if self.quadratic:
            return (Strains(section, *common),)
        return (GeneralStrains(section, *common, weight, self._product),)

    def _refuse_prestrain(self) -> None:
        """Refuse strains of the user that are not zero at rest, as resultants are; collective.

        Raises:
            SceneError: Names the largest of them.
        """
        if self.strain.rest is None:
            return
        domain, h = self.mixed.space.mesh, self.thickness
        e = self.strain.rest(ufl.Coefficient(self.mixed.space))
        if isinstance(e, Zero):
            return
        # on the mesh, whatever the strains are of
        one = fem.Constant(domain, 1.0)
        sizes = ufl.as_vector([e[k] * (h if k in (3, 4, 5) else one) for k in range(8)])
        points, _ = basix.make_quadrature(domain.basix_cell(), 4)
        found = np.abs(values_in_cells(sizes, points, domain)())
        largest = domain.comm.allreduce(float(np.max(found, initial=0.0)), op=MPI.MAX)
        if not largest < NONE:
            nonlinear = isinstance(self.section.formulation, NonlinearMixed)
            by = "the energy" if nonlinear else "natural, with the opposite sign"
            raise SceneError(
                f"shell '{self.name}': strains {show(self.shell.strains)} gives a strain of "
                f"{largest:.3g} where displacement and director change are 0; it must be 0 there: "
                f"give a prestrain by {by}"
            )

    def _product(self, a: Expr, b: Expr) -> Expr:
        """Product of two states, by their gradients and directors."""
        moved, h = self.layout.moved, self.thickness
        first, second = (shell_forms.tangents(*moved(q), self.surface) for q in (a, b))
        sizes = 1, 1, 1, h**2, h**2
        return sum(s * ufl.dot(x, y) for s, x, y in zip(sizes, first, second, strict=True))

    @property
    def quadratic(self) -> bool:
        """Decide whether strains are at most quadratic in the state."""
        if self.shell.strains is None:
            return True
        return is_quadratic(self.strain.value, ufl.Coefficient(self.mixed.space))

    def _refuse_general(self, what: str) -> None:
        """Refuse strains of the user that are not quadratic.

        Raises:
            SceneError: If they are not.
        """
        if not self.quadratic:
            own = self.shell.strains
            raise SceneError(
                f"shell '{self.name}': strains is {getattr(own, '__name__', own)}, which is not "
                f"quadratic in displacement and director; with {what}"
            )

    @cached_property
    def damping(self) -> StrainDamping | None:
        """Damping of its strains; None without any.

        Raises:
            SceneError: If strains of the user are not quadratic, or an energy is not convex where
                it is undeformed.
        """
        times = self.shell.section.damping_times
        if not any(times):
            return None
        self._refuse_general(
            "damping of the section it must be, or the damping a term of the shell"
        )
        formulation = self.section.formulation
        if isinstance(formulation, NonlinearMixed):
            parts = self._of_rest(formulation)
        else:
            parts = self._linear(formulation)
        return StrainDamping(parts, self.rates_of) if parts else None

    def _linear(self, section: LinearMixed | LinearOwn) -> list[Strains]:
        """Damping of a linear section; of strains that are constrained none."""
        membrane, bend, shear = self.shell.section.damping_times

        def constant(time: float, acts: bool = True) -> Expr | None:
            return fem.Constant(self.mixed.space.mesh, time) if time and acts else None

        stretches, shears = self.shell.stretching, self.shell.transverse_shear
        times = constant(membrane, stretches), constant(bend), constant(shear, shears)
        if not any(time is not None for time in times):
            return []
        return [Strains(ViscousShell(section, *times), self.layout, self.strain, self.integrate)]

    def _of_rest(self, section: NonlinearMixed) -> list[Strains]:
        """Damping of the elements' own strains, but for a share of the shear."""
        A, B, D, G = self.stiffness_at_rest(section)
        if not any(part is not None for part in (A, B, D, G)):
            return []
        layout, a, on = self.layout, section.a, self.integrate
        own = _whole(A, B, D, None if G is None else (1 - a) * G)
        found = [Strains(Stiffness(own), layout, assumed(self.strain, layout), on)]
        if G is not None and not isinstance(a, Zero):
            shared = Stiffness(_whole(None, None, None, a * G))
            found.append(Strains(shared, layout, self.strain, on))
        return found

    def stiffness_at_rest(self, section: NonlinearMixed) -> Parts:
        """Damping by the stiffness of an energy at zero strain: membrane, coupling, bending, shear.

        Args:
            section: Its mixed form.

        Raises:
            SceneError: If that is not positive.
        """
        mesh = self.mixed.space.mesh
        e = fem.Constant(mesh, np.zeros(8))
        C = _numbers(tangent(section.energy_density, e))
        label = getattr(self.shell.section, "label", "section")
        scale = np.sqrt(np.abs(np.outer(C.diagonal(), C.diagonal())))
        least = np.linalg.eigvalsh(C / np.where(scale > 0, scale, 1.0)).min()
        if not least >= -NEGATIVE:
            raise SceneError(
                f"shell '{self.name}': the energy of its {label} has a stiffness at zero strain "
                "that is not positive (scaled, its least eigenvalue is "
                f"{show(float(f'{least:.3g}'))}); with damping, which is in proportion to it, it "
                "must be"
            )
        membrane, bend, shear = self.shell.section.damping_times
        B = math.sqrt(membrane * bend) * C[:3, 3:6]

        def part(time: float, value: Floats) -> Expr | None:
            return fem.Constant(mesh, np.ascontiguousarray(time * value)) if time else None

        coupling = part(1.0, B) if np.abs(B).max() > 0 else None
        own = part(membrane, C[:3, :3]), part(bend, C[3:6, 3:6]), part(shear, C[6:, 6:])
        return own[0], coupling, own[1], own[2]

    def branches(self) -> MaxwellBranches | None:
        """New Maxwell branches of its section; None without any.

        Raises:
            SceneError: If strains of the user are not quadratic.
        """
        section = self.shell.section
        if not (isinstance(section, LinearSection) and section.relaxes):
            return None
        self._refuse_general("relaxation of the section it must be")
        mixed, seen = self.section.formulation, assumed(self.strain, self.layout)
        assert isinstance(mixed, NonlinearMixed)
        fields, found = SectionFields(self.shell, self.mixed.space.mesh), []
        for shares, branches in section.generic.branches.items():

            def part(name: str, shares: tuple[float, ...] = shares) -> Expr:
                def value(at: Layup) -> Floats:
                    return np.asarray(getattr(at.scaled(shares), name))

                return fields.of(value)

            B, G = part("B") if couples(self.shell, section) else None, part("G")
            common = branches, self.rules.full, self.mixed.space.mesh
            found.append(Fading(seen, _whole(part("A"), B, part("D"), (1 - mixed.a) * G), *common))
            if not isinstance(mixed.a, Zero):
                found.append(Fading(self.strain, _whole(None, None, None, mixed.a * G), *common))
        return MaxwellBranches(self.name, self.layout, found)

    def _compatible(self, e: Expr) -> CellSystem:
        """Equations of the forces, or of the own strains where elements have some, of strains.

        Args:
            e: The strains, shape (8,); functions in it may change.
        """
        section, tying, integrate = self.section.formulation, self.tying, self.integrate
        space = self.mixed.subspaces["N" if isinstance(section, LinearMixed) else "S"]
        dN, found = tying.forces(ufl.TestFunction(space)), tying.forces(ufl.TrialFunction(space))
        if isinstance(section, LinearMixed):
            nothing, still = ufl.as_vector([0] * COUNT), ufl.as_vector([0] * 8)
            own = section.gap(still, still, section.N0 * found, dN)[0]
            return CellSystem(space, integrate([-own]), integrate(section.gap(e, e, nothing, dN)))
        eps = ufl.as_vector([e[k] for k in range(3)])
        works = [ufl.dot(tying.whole(dN), eps), *(ufl.dot(s, e) for s in tying.works(dN))]
        matrix = ufl.dot(tying.force(dN), tying.strain(found))
        return CellSystem(space, integrate([matrix]), integrate(works))

    def _balanced(self, e: Expr, own: fem.Function) -> CellSystem:
        """Equations of the forces of own strains with a linear section.

        Args:
            e: Strains of the displacements, shape (8,).
            own: The own strains.
        """
        section, tying, space = self.section.formulation, self.tying, self.mixed.subspaces["N"]
        assert isinstance(section, LinearOwn)
        dS, found = tying.forces(ufl.TestFunction(space)), tying.forces(ufl.TrialFunction(space))
        n, _, Q = section.stresses(tying.forces(own), e)
        matrix = ufl.dot(tying.strain(dS), section.N0 * tying.force(found))
        given = ufl.dot(tying.strain(dS), ufl.as_vector([*n, *((1 - section.a) * Q)]))
        return CellSystem(space, self.integrate([matrix]), self.integrate([given]))

    def _cell_systems(self, e: Expr) -> dict[str, CellSystem]:
        """Equations of forces, behind the own strains where elements have some, by their parts.

        Args:
            e: Strains, shape (8,); functions in it may change.
        """
        first = self._compatible(e)
        if isinstance(self.section.formulation, LinearMixed):
            return {"N": first}
        own = {"S": first}
        if isinstance(self.section.formulation, LinearOwn):
            own["N"] = self._balanced(e, first.function)
        return own

    def forces_of(self, e: Expr) -> Expr:
        """Forces of elements, behind their own strains where they have some, of given strains.

        They are what `forces` of the formulation of a linear section is of a state.
        """
        forces, section = self.tying.forces, self.section.formulation
        found = {part: system.solve() for part, system in self._cell_systems(e).items()}
        N = section.N0 * forces(found["N"])
        return N if "S" not in found else ufl.as_vector([*forces(found["S"]), *N])

    def rates_of(self, q: fem.Function, v: fem.Function) -> Callable[[], None]:
        """Function that gives a velocity its rates of forces and own strains; collective.

        Args:
            q: State.
            v: Velocity.
        """
        systems = self._cell_systems(self.strain.change(q, v))

        def follow() -> None:
            for part, system in systems.items():
                v.x.array[self.mixed.dofs[part]] = system.solve().x.array

        return follow
