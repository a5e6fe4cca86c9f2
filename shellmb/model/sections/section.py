"""A section bound to a mesh: its coefficients, and weights that depend on the element size."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import ufl
from basix import CellType
from dolfinx import fem, la, mesh
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.forms.materials import tension_field
from shellmb.forms.shell import Mass, ShellStrains
from shellmb.forms.steps.mixed import Formulation, LinearMixed, LinearOwn
from shellmb.forms.steps.mixed_nonlinear import NonlinearMixed, Quadratic
from shellmb.forms.tying import Tying
from shellmb.meshes.shared import space_on
from shellmb.meshes.tying import cell_squares
from shellmb.model.shells.varying import Rule, SectionFields
from shellmb.model.user_forms import resists_all, written
from shellmb.native.kernels import compiled
from shellmb.scene import Hyperelastic, LinearSection, Shell, Wrinkling
from shellmb.scene.shells.lamination import Layup

# Share of the transverse shear energy that displacements of triangles have, per square of an
# element's slenderness: it resists what the forces, which have one value an edge, do not see
SHARE = 4.0

# compliance of constrained strains relative to that of the section for shear: on many meshes
# constraints imply one another, and their forces would not be unique
SLACK = 1e-5


@dataclass(frozen=True)
class Sizes:
    """Numbers that say how large things are; means, where a section varies.

    Args:
        thickness: Thickness, m.
        stiffness: Membrane stiffness, N/m.
        mass: Mass per area, kg/m^2.
    """

    thickness: float
    stiffness: float
    mass: float


@dataclass(frozen=True)
class BoundSection:
    """A section on a mesh.

    Args:
        formulation: Mixed form of its strain energy.
        force: Size of the shear stiffness, scale of the director's multiplier, N/m.
        sizes: How large things are.
    """

    formulation: Formulation
    force: fem.Constant
    sizes: Sizes


def has_own_strains(shell: Shell, domain: mesh.Mesh) -> bool:
    """Decide whether elements have strains of their own beside the forces.

    They need them where forces do not follow from strains, or damping not from rates of forces,
    where they relax, and on triangles.
    """
    section = shell.section
    if not isinstance(section, LinearSection) or shell.holds_strains:
        return True
    return (
        _damps_unlike(shell, section)
        or section.relaxes
        or domain.topology.cell_name() == "triangle"
    )


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
    if isinstance(shell.section, LinearSection):
        return _bind_linear(shell, shell.section, domain, tying, like, at_rest)
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
    return BoundSection(nonlinear, N0, Sizes(section.thickness, section.stiffness, section.mass[0]))


def _bind_linear(
    shell: Shell,
    section: LinearSection,
    domain: mesh.Mesh,
    tying: Tying,
    like: BoundSection | None,
    at_rest: bool,
) -> BoundSection:
    fields = SectionFields(shell, domain, at_rest)
    if like is None:
        membrane, shear = fields.largest(_membrane), fields.largest(_shear)
    else:
        membrane, shear = like.sizes.stiffness, float(like.force.value)
    N0, force = _constant(domain, membrane), _constant(domain, shear)
    sizes = Sizes(
        fields.mean(lambda at: at.thickness), membrane, fields.mean(lambda at: at.mass[0])
    )
    D, G = fields.of(lambda at: at.D), fields.of(lambda at: at.G)
    B = fields.of(lambda at: at.B) if couples(shell, section) else None
    if not has_own_strains(shell, domain):
        A_inv = fields.of(lambda at: np.linalg.inv(at.A))
        G_inv = fields.of(lambda at: np.linalg.inv(at.G))
        return BoundSection(LinearMixed(D, A_inv, G_inv, N0, tying, B), force, sizes)
    a = _share(domain, fields.by_cell(lambda at: at.thickness))
    if section.relaxes or (B is not None and _damps_unlike(shell, section)):
        psi, thickness = Quadratic(fields.of(lambda at: at.A), B, D, G), sizes.thickness
        mixed = NonlinearMixed(psi, N0, a, _constant(domain, thickness))
        return BoundSection(mixed, force, sizes)
    # what is constrained is stiff
    stiff = _constant(domain, shear / SLACK)
    A = fields.of(lambda at: at.A) if shell.stretching else stiff
    own = LinearOwn(A, D, G if shell.transverse_shear else stiff, N0, a, G, tying, B)
    return BoundSection(own, force, sizes)


def _membrane(at: Layup) -> Floats:
    """Largest membrane stiffness, shape (...)."""
    return np.asarray(np.diagonal(at.A, axis1=-2, axis2=-1).max(axis=-1))


def _shear(at: Layup) -> Floats:
    """Largest shear stiffness, shape (...)."""
    return np.asarray(np.diagonal(at.G, axis1=-2, axis2=-1).max(axis=-1))


def _share(domain: mesh.Mesh, thickness: float | Floats) -> Expr:
    """Share of the shear energy that displacements have: below one, and none of quadrilaterals."""
    if domain.basix_cell() == CellType.quadrilateral:
        return ufl.as_ufl(0.0)
    x = SHARE * thickness**2 / cell_squares(domain)
    function = fem.Function(space_on(domain, ("DG", 0)))
    function.x.array[:] = x / (1 + x)
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
        vector = fem.assemble_vector(compiled(moment * test * dx))
        vector.scatter_reverse(la.InsertMode.add)
        vector.scatter_forward()
        moments.append(vector.array.reshape(-1, 3)[:, :1].copy())
    arm = fem.Function(nodal)
    arm.x.array[:] = np.repeat(moments[0] / moments[1], 3)
    return Arm(arm[0], moments[0] / moments[1])
