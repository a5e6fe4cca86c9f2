"""A section bound to a mesh: its rules, its coefficients, and weights by the size of elements.

A section that varies is evaluated at points of each element: on quadrilaterals at the Gauss points
of the rule that a coefficient is used with, where its field has its nodes, and on triangles at the
middle. So stiffness and mass are positive wherever forms are integrated, and what jumps at an edge
of elements belongs on each side to that side.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal, NamedTuple

from mpi4py import MPI

import basix
import basix.ufl
import numpy as np
import ufl
from basix import CellType
from dolfinx import fem, mesh
from ufl import Form
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.errors import alike
from shellmb.forms.materials import tension_field
from shellmb.forms.shell import Mass, ShellStrains
from shellmb.forms.steps.mixed import LinearMixed, LinearOwn
from shellmb.forms.steps.mixed_nonlinear import NonlinearMixed, Quadratic
from shellmb.forms.tying import Tying
from shellmb.meshes.shared import space_on
from shellmb.meshes.tying import cell_squares, coordinate_element, shell_forces
from shellmb.model.user_forms import resists_all, written
from shellmb.native.kernels import assembled
from shellmb.scene import Hyperelastic, LinearSection, Shell, Wrinkling
from shellmb.scene.shells.lamination import Layup


@dataclass(frozen=True)
class Rules:
    """Measures over the surface of a shell, or the line of a beam.

    Args:
        full: Rule for all that is integrated.
        nodes: Rule whose points are the nodes, so that the director is of unit length at each.
        taken: Points where strains are taken that forces of the elements work on.
    """

    full: ufl.Measure
    nodes: ufl.Measure
    taken: tuple[ufl.Measure, ...]


def quadrature_rules(domain: mesh.Mesh, degree: int) -> Rules:
    """Rules for a surface mesh.

    Args:
        domain: The mesh.
        degree: Degree of displacement and director.
    """
    cell = domain.basix_cell()
    taken = [custom(r.points, r.weights) for r in shell_forces(cell, degree).rules]
    if cell == CellType.triangle:
        points = basix.create_element(basix.ElementFamily.P, cell, 2).points
        full, nodes = {"quadrature_degree": 4}, custom(points, np.full(6, 1 / 12))
    else:
        full = {"quadrature_degree": 2 * degree + 1}
        nodes = {"quadrature_rule": "GLL", "quadrature_degree": 2 * degree - 1}
    return _rules(domain, full, nodes, *taken)


def _rules(domain: mesh.Mesh, *metadata: dict[str, Any]) -> Rules:
    full, nodes, *taken = (ufl.Measure("dx", domain, metadata=data) for data in metadata)
    return Rules(full, nodes, tuple(taken))


def integral(measures: Sequence[ufl.Measure], densities: Sequence[Expr]) -> Form:
    """Integral of densities over a shell or beam.

    Args:
        measures: The measures.
        densities: The densities, of the first measures if they are fewer.
    """
    forms = [d * dx for d, dx in zip(densities, measures, strict=False)]
    # added one by one, UFL looks through those before again and again
    return Form([part for form in forms for part in form.integrals()])


def line_rules(domain: mesh.Mesh, degree: int) -> Rules:
    """Rules for the mesh of a beam.

    Args:
        domain: The mesh.
        degree: Degree of displacement and directors.
    """
    # of the last as many Gauss points as the degree
    full, taken = ({"quadrature_degree": 2 * degree + k} for k in (1, -1))
    return _rules(domain, full, {"quadrature_rule": "GLL", **taken}, taken)


def custom(points: Any, weights: Any) -> dict[str, Any]:
    """Metadata of a rule given by its points and weights on the reference cell."""
    return {"quadrature_rule": "custom", "quadrature_points": points, "quadrature_weights": weights}


Rule = Literal["full", "nodes"]

# nodes of elements are drawn this far into them, as a part of the way to the middle: they tell
# which side of a jump along an edge is meant
INTO = 1e-6


class SectionFields:
    """Coefficients of a linear section.

    Args:
        shell: The shell.
        domain: Its mesh.
        at_rest: Whether the stiffness is that of statics; it is the long-term one otherwise.
    """

    def __init__(self, shell: Shell, domain: mesh.Mesh, at_rest: bool = False) -> None:
        assert isinstance(shell.section, LinearSection)
        self._section, self._domain, self._degree = shell.section, domain, shell.degree
        self._who = f"shell '{shell.name}'"
        self._layups: dict[Rule, Layup] = {}
        self._at_rest = at_rest

    def of(self, value: Callable[[Layup], Floats], rule: Rule = "full") -> Expr:
        """A number, or a symmetric matrix, as a coefficient.

        Args:
            value: What it is of the section at points (...), shape (...) or (..., n, n).
            rule: The rule that it is used with.
        """
        values = np.asarray(value(self._at(rule)), dtype=float)
        size = np.ndim(value(self._section.generic))
        if values.ndim == size:
            # nothing that it depends on varies
            return fem.Constant(self._domain, values)
        if size == 0:
            return self._field(values[..., None], rule)
        n = values.shape[-1]
        pairs = [(i, j) for i in range(n) for j in range(i, n)]
        field = self._field(np.stack([values[..., i, j] for i, j in pairs], axis=-1), rule)
        place = {pair: k for k, pair in enumerate(pairs)}
        return ufl.as_matrix(
            [[field[place[min(i, j), max(i, j)]] for j in range(n)] for i in range(n)]
        )

    def by_cell(self, value: Callable[[Layup], Floats]) -> Floats:
        """Means over the elements of this rank, shape (elements,), or one number for all."""
        values = np.asarray(value(self._at("full")), dtype=float)
        return values if values.ndim == 0 else values.mean(axis=1)

    def largest(self, value: Callable[[Layup], Floats]) -> float:
        """The largest value there is; collective."""
        here = float(np.max(self.by_cell(value), initial=0.0))
        return float(self._domain.comm.allreduce(here, op=MPI.MAX))

    def mean(self, value: Callable[[Layup], Floats]) -> float:
        """The mean over all elements; collective."""
        local = self._domain.topology.index_map(2).size_local
        values = self.by_cell(value)
        if values.ndim == 0:
            return float(values)
        comm = self._domain.comm
        total = comm.allreduce(float(values[:local].sum()))
        return float(total / comm.allreduce(local))

    def _element(self, rule: Rule, size: int) -> Any:
        cell, shape = self._domain.basix_cell(), (size,) if size > 1 else ()
        if cell != CellType.quadrilateral:
            return basix.ufl.element("DG", cell, 0, shape=shape)
        nodes = rule == "nodes"
        variant = basix.LagrangeVariant.gll_warped if nodes else basix.LagrangeVariant.gl_warped
        return basix.ufl.element("P", cell, self._degree, variant, shape=shape, discontinuous=True)

    def _field(self, values: Floats, rule: Rule) -> fem.Function:
        """A field from its values at the points of the elements, shape (elements, points, size)."""
        size = values.shape[-1]
        function = fem.Function(space_on(self._domain, self._element(rule, size)))
        dofs = function.function_space.dofmap.list
        places = dofs[..., None] * size + np.arange(size)
        function.x.array[places] = values
        return function

    def _at(self, rule: Rule) -> Layup:
        """The section at the points of a rule in all elements of this rank, (elements, points).

        Of a section that does not vary that of no point.
        """
        if self._section.functions and rule not in self._layups:
            x = np.moveaxis(self._points(rule), -1, 0)
            with alike(self._domain.comm):
                self._layups[rule] = self._section.at(x, self._who)
        found = self._layups.get(rule, self._section.generic)
        return found.at_rest if self._at_rest else found

    def _points(self, rule: Rule) -> Floats:
        """Positions of the points of a rule, shape (elements, points, 3)."""
        points = self._element(rule, 1).basix_element.points
        middle = basix.geometry(self._domain.basix_cell()).mean(axis=0)
        inside = points + INTO * (middle - points)
        shapes = coordinate_element(self._domain).tabulate(0, inside)[0, :, :, 0]
        corners = self._domain.geometry.x[self._domain.geometry.dofmaps[0]]
        return np.asarray(np.einsum("pd,cdx->cpx", shapes, corners))


# Share of the transverse shear energy that displacements of triangles have, per square of an
# element's slenderness: it resists what the forces, which have one value an edge, do not see
SHARE = 4.0

# compliance of constrained strains relative to that of the section for shear: on many meshes
# constraints imply one another, and their forces would not be unique
SLACK = 1e-5


@dataclass(frozen=True)
class BoundSection:
    """A section on a mesh.

    Args:
        formulation: Mixed form of its strain energy.
        force: Size of the shear stiffness, scale of the director's multiplier, N/m.
        thickness: Thickness, m; as stiffness and mass a mean, where the section varies.
        stiffness: Membrane stiffness, N/m.
        mass: Mass per area, kg/m^2.
    """

    formulation: LinearMixed | LinearOwn | NonlinearMixed
    force: fem.Constant
    thickness: float
    stiffness: float
    mass: float


def has_own_strains(shell: Shell, domain: mesh.Mesh) -> bool:
    """Decide whether elements have strains of their own beside the forces.

    They need them where forces do not follow from strains, or damping not from rates of forces,
    where they relax, and on triangles.
    """
    section = shell.section
    if not isinstance(section, LinearSection) or shell.holds_strains:
        return True
    triangles = domain.topology.cell_name() == "triangle"
    return triangles or section.relaxes or _damps_unlike(shell, section)


def _damps_unlike(shell: Shell, section: LinearSection) -> bool:
    """Decide whether strains that are coupled have different damping times."""
    membrane, bend, _ = section.damping_times
    return couples(shell, section) and membrane != bend


def couples(shell: Shell, section: LinearSection) -> bool:
    """Decide whether a section couples bending and stretching on a shell."""
    # without stretching there is nothing that bending could be coupled to
    return section.coupled and shell.coupling and shell.stretching


def bind_section(
    shell: Shell,
    domain: mesh.Mesh,
    tying: Tying,
    like: BoundSection | None = None,
    at_rest: bool = False,
) -> BoundSection:
    """Coefficients and element-wise weights of a shell's section; what is left out is absent.

    Args:
        shell: The shell.
        domain: Its mesh.
        tying: Maps of the forces of its elements.
        like: One whose sizes, in which unknowns are counted, this linear one takes.
        at_rest: Whether the stiffness is that of statics.

    Raises:
        SceneError: If functions of the position fail, or a thickness is not positive somewhere.
    """
    section = shell.section
    if not isinstance(section, LinearSection):
        return _bind_energy(shell, domain)
    fields = SectionFields(shell, domain, at_rest)
    if like is None:
        membrane, shear = (fields.largest(partial(_largest, name)) for name in ("A", "G"))
    else:
        membrane, shear = like.stiffness, float(like.force.value)
    N0, force = _constant(domain, membrane), _constant(domain, shear)
    thickness = fields.mean(lambda a: a.thickness)
    sizes = force, thickness, membrane, fields.mean(lambda a: a.mass[0])
    D, G = fields.of(lambda at: at.D), fields.of(lambda at: at.G)
    B = fields.of(lambda at: at.B) if couples(shell, section) else None
    if not has_own_strains(shell, domain):
        A_inv = fields.of(lambda at: np.linalg.inv(at.A))
        G_inv = fields.of(lambda at: np.linalg.inv(at.G))
        return BoundSection(LinearMixed(D, A_inv, G_inv, N0, tying, B), *sizes)
    a = _share(domain, fields.by_cell(lambda at: at.thickness))
    if section.relaxes or (B is not None and _damps_unlike(shell, section)):
        psi = Quadratic(fields.of(lambda at: at.A), B, D, G)
        mixed = NonlinearMixed(psi, N0, a, _constant(domain, thickness))
        return BoundSection(mixed, *sizes)
    # what is constrained is stiff
    stiff = _constant(domain, shear / SLACK)
    A = fields.of(lambda at: at.A) if shell.stretching else stiff
    own = LinearOwn(A, D, G if shell.transverse_shear else stiff, N0, a, G, tying, B)
    return BoundSection(own, *sizes)


def _bind_energy(shell: Shell, domain: mesh.Mesh) -> BoundSection:
    """A section of any strain energy density."""
    section = shell.section
    assert isinstance(section, Hyperelastic | Wrinkling)
    energy = tension_field if isinstance(section, Wrinkling) else section.energy
    parameters = {name: _constant(domain, value) for name, value in section.parameters.items()}
    N0, who = _constant(domain, section.stiffness), f"shell '{shell.name}': energy"
    strains = ShellStrains(*(_constant(domain, np.zeros(size)) for size in (3, 3, 2)))
    resists_all(energy, strains, parameters, who)
    nonlinear = NonlinearMixed(
        psi=lambda strains: written(energy, (strains, parameters), who),
        N0=N0,
        a=_share(domain, section.thickness),
        thickness=_constant(domain, section.thickness),
        kinked=isinstance(section, Wrinkling),
    )
    return BoundSection(nonlinear, N0, section.thickness, section.stiffness, section.mass[0])


def _largest(name: str, at: Layup) -> Floats:
    """Largest membrane or shear stiffness, shape (...)."""
    return np.asarray(np.diagonal(getattr(at, name), axis1=-2, axis2=-1).max(axis=-1))


def _share(domain: mesh.Mesh, thickness: float | Floats) -> Expr:
    """Share of the shear energy that displacements have: below one, and none of quadrilaterals."""
    if domain.basix_cell() == CellType.quadrilateral:
        return ufl.as_ufl(0.0)
    x = SHARE * thickness**2 / cell_squares(domain)
    return per_cell(domain, x / (1 + x))


def per_cell(domain: mesh.Mesh, values: Floats, size: int = 1) -> fem.Function:
    """A number, or a vector of some size, on each cell."""
    function = fem.Function(space_on(domain, ("DG", 0, (size,)) if size > 1 else ("DG", 0)))
    function.x.array[:] = values.ravel()
    return function


def _constant(domain: mesh.Mesh, value: float | Floats) -> fem.Constant:
    return fem.Constant(domain, np.asarray(value, dtype=float))


def bind_mass(shell: Shell, domain: mesh.Mesh) -> Mass:
    """Mass coefficients of eq. (16); what is zero or left out is absent from the forms.

    Args:
        shell: The shell.
        domain: Its mesh.
    """
    section = shell.section
    _, first, second = section.masses
    # without I* a first moment would make the kinetic energy indefinite
    first = first and shell.rotary_inertia and shell.eccentric_inertia
    second = second and shell.rotary_inertia
    fields = SectionFields(shell, domain) if isinstance(section, LinearSection) else None

    def moment(k: int, rule: Rule) -> Expr:
        if fields is None:
            return _constant(domain, float(section.mass[k]))
        return fields.of(lambda at: np.asarray(at.mass[k]), rule)

    moments = moment(1, "nodes") if first else None, moment(2, "nodes") if second else None
    if not first:
        return Mass(moment(0, "full"), *moments)
    if fields is None:
        m, s, I = section.mass  # noqa: E741 (the paper's symbols)
        return Mass(moment(0, "nodes"), *moments, _constant(domain, float(m - s**2 / I)))
    centred = fields.of(lambda at: np.asarray(at.mass[0] - at.mass[1] ** 2 / at.mass[2]), "full")
    return Mass(moment(0, "nodes"), *moments, centred)


class Arm(NamedTuple):
    """First over second moment of the mass, 1/m.

    Args:
        coefficient: In forms; None without a first moment.
        values: At the nodes, shape (n, 1), or the same at all of them.
    """

    coefficient: Expr | None
    values: Floats


def mass_arm(mass: Mass, nodal: fem.FunctionSpace, dx: ufl.Measure) -> Arm:
    """Find where directors turn without momentum (`forms.shell.tangent_jump`); collective.

    That is said node by node: where the section varies, by the moments that the elements around a
    node have there.

    Args:
        mass: Mass coefficients with rotary inertia.
        nodal: Space of vectors at the nodes.
        dx: Rule whose points are the nodes.
    """
    if mass.s is None:
        return Arm(None, np.zeros(1))
    if isinstance(mass.s, fem.Constant) and isinstance(mass.I, fem.Constant):
        return Arm(mass.s / mass.I, np.asarray(mass.s.value / mass.I.value).reshape(1))
    test, moments = ufl.TestFunction(nodal)[0], []
    for moment in mass[1:3]:
        moments.append(assembled(moment * test * dx).reshape(-1, 3)[:, :1])
    arm = fem.Function(nodal)
    arm.x.array[:] = np.repeat(moments[0] / moments[1], 3)
    return Arm(arm[0], moments[0] / moments[1])
