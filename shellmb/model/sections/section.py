"""A section bound to a mesh: its coefficients, and weights that depend on the element size."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import ufl
from dolfinx import fem, la, mesh
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.forms.shell import Mass, ShellStrains
from shellmb.forms.steps.mixed import Formulation, LinearMixed
from shellmb.forms.steps.mixed_nonlinear import NonlinearMixed
from shellmb.meshes.shared import space_on
from shellmb.model.shells.varying import Rule, SectionFields
from shellmb.model.user_forms import resists_all, written
from shellmb.native.kernels import compiled
from shellmb.scene import Hyperelastic, LinearSection, Shell
from shellmb.scene.shells.lamination import Layup


class Shares(NamedTuple):
    """Weights of the fully integrated parts of membrane and shear strains.

    Args:
        membrane: Per square of an element's slenderness.
        shear: Per square of its slenderness.
        curved: Of shear, per positive Gauss's curvature times the square of its size.
    """

    membrane: float
    shear: float
    curved: float


# c of docs/theory/shells.md. Bubbles of triangles that lean out of the surface are held by the
# shear share, and buckle in their element where that is weaker than the plate there. Along the
# surface linear forces hold them nearly, and more makes what bends too stiff (a ring of 32x2 by
# 3.8 % in its frequencies for 0.3). On surfaces like spheres, bubbles let vertices move out and
# middles of sides in with next to no membrane strain, however thin the shell; directors do not
# feel that, the shear share does
SHARES = {"quadrilateral": Shares(0.1, 0.1, 0.0), "triangle": Shares(0.05, 3.0, 0.2)}

# weight of the hourglass control: per h/h_K it is stiff against the spurious in-plane modes, and
# as it vanishes with the thickness it neither locks thin distorted meshes nor spoils the large
# Newton steps of the mixed form
HOURGLASS = 0.5

# compliance for held strains relative to that of the section for shear: on regular meshes between
# held edges shear constraints imply one another, and their forces would not be unique
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
        hourglass: Stiffness of the hourglass control, N/m.
        sizes: How large things are.
        share: Fully integrated share of the formulation, per element.
        curvature: Gauss's curvature of the elements, 1/m^2; of quadrilaterals nobody asks for it.
    """

    formulation: Formulation
    force: fem.Constant
    hourglass: Expr
    sizes: Sizes
    share: fem.Function
    curvature: float | Floats


def bind_section(
    shell: Shell,
    domain: mesh.Mesh,
    curvature: float | Floats,
    like: BoundSection | None = None,
) -> BoundSection:
    """Coefficients and element-wise weights of a shell's section; what is left out is absent.

    Args:
        shell: The shell.
        domain: Its mesh.
        curvature: Gauss's curvature of its elements, 1/m^2.
        like: One whose sizes, in which unknowns are counted, this linear one takes.

    Raises:
        SceneError: If functions of the position fail, or a thickness is not positive somewhere.
    """
    if isinstance(shell.section, LinearSection):
        return _bind_linear(shell, shell.section, domain, curvature, like)
    section = shell.section
    assert isinstance(section, Hyperelastic)
    parameters = {name: _constant(domain, value) for name, value in section.parameters.items()}
    N0, who = _constant(domain, section.stiffness), f"shell '{shell.name}': energy"
    strains = ShellStrains(*(_constant(domain, np.zeros(size)) for size in (3, 3, 2)))
    resists_all(section.energy, strains, parameters, who)
    a, a_shear, b = _weights(domain, section.thickness, curvature)
    share = _per_element(domain, a)
    nonlinear = NonlinearMixed(
        psi=lambda strains: written(section.energy, (strains, parameters), who),
        N0=N0,
        a=share,
        thickness=_constant(domain, section.thickness),
        a_shear=None if a_shear is None else _per_element(domain, a_shear),
    )
    sizes = Sizes(section.thickness, section.stiffness, section.mass[0])
    return BoundSection(nonlinear, N0, N0 * _per_element(domain, b), sizes, share, curvature)


def _bind_linear(
    shell: Shell,
    section: LinearSection,
    domain: mesh.Mesh,
    curvature: float | Floats,
    like: BoundSection | None,
) -> BoundSection:
    fields = SectionFields(shell, domain)
    if like is None:
        membrane, shear = fields.largest(_membrane), fields.largest(_shear)
    else:
        membrane, shear = like.sizes.stiffness, float(like.force.value)
    thickness = fields.by_cell(lambda at: at.thickness)
    a, a_shear, b = _weights(domain, thickness, curvature)
    # the control is as stiff as the section is in its element
    b = b * fields.by_cell(_membrane) / membrane
    N0 = _constant(domain, membrane)
    # without stretching there is nothing that bending could be coupled to
    couples = section.coupled and shell.coupling and shell.stretching
    share = _per_element(domain, a)
    linear = LinearMixed(
        A=fields.of(lambda at: at.A),
        D=fields.of(lambda at: at.D),
        G=fields.of(lambda at: at.G),
        A_inv=fields.of(lambda at: np.linalg.inv(at.A), "reduced") if shell.stretching else None,
        G_inv=fields.of(lambda at: np.linalg.inv(at.G), "reduced")
        if shell.transverse_shear
        else None,
        N0=N0,
        a=share,
        B=fields.of(lambda at: at.B) if couples else None,
        slack=_constant(domain, SLACK / shear) if shell.holds_strains else None,
        a_shear=None if a_shear is None else _per_element(domain, a_shear),
    )
    sizes = Sizes(
        fields.mean(lambda at: at.thickness), membrane, fields.mean(lambda at: at.mass[0])
    )
    hourglass = N0 * _per_element(domain, b)
    return BoundSection(linear, _constant(domain, shear), hourglass, sizes, share, curvature)


def _membrane(at: Layup) -> Floats:
    """Largest membrane stiffness, shape (...)."""
    return np.asarray(np.diagonal(at.A, axis1=-2, axis2=-1).max(axis=-1))


def _shear(at: Layup) -> Floats:
    """Largest shear stiffness, shape (...)."""
    return np.asarray(np.diagonal(at.G, axis1=-2, axis2=-1).max(axis=-1))


def _weights(
    domain: mesh.Mesh, thickness: float | Floats, curvature: float | Floats
) -> tuple[Floats, Floats | None, Floats]:
    """Fully integrated shares, of shear where it has its own, and weights of hourglass control.

    Below one for any thickness, so that the reduced part never vanishes.
    """
    c = SHARES[domain.topology.cell_name()]
    size = _sizes(domain)
    slender = np.asarray(thickness / size)
    curved = c.curved * np.maximum(curvature, 0.0) * size**2
    a, a_shear = c.membrane * slender**2, c.shear * slender**2 + curved
    b = HOURGLASS * slender
    return _share(a), None if c.shear == c.membrane else _share(a_shear), _share(b)


def _share(x: Floats) -> Floats:
    return x / (1 + x)


def _sizes(domain: mesh.Mesh) -> Floats:
    """Size of each element, m."""
    cells = domain.topology.index_map(2)
    count = cells.size_local + cells.num_ghosts
    return np.asarray(domain.h(2, np.arange(count, dtype=np.int32)))


def _per_element(domain: mesh.Mesh, weight: Floats) -> fem.Function:
    function = fem.Function(space_on(domain, ("DG", 0)))
    function.x.array[:] = weight
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
