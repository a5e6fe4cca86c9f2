"""A section bound to a mesh: its constants, and the weights that depend on the element size."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from dolfinx import fem, mesh
from ufl.core.expr import Expr

from shellmb.forms.shell import Mass, ShellStrains
from shellmb.forms.steps.mixed import Formulation, LinearMixed
from shellmb.forms.steps.mixed_nonlinear import NonlinearMixed
from shellmb.model.written import resists_all, written
from shellmb.scene import Hyperelastic, LinearSection, Shell

# weight of the fully integrated part, c in design section 3
STABILISATION = {"quadrilateral": 0.1, "triangle": 1.0}

# weight of the hourglass control: per h/h_K it is stiff against the spurious in-plane modes, and
# as it vanishes with the thickness it neither locks thin distorted meshes nor spoils the large
# Newton steps of the mixed form
HOURGLASS = 0.5

# compliance for held strains relative to that of the section for shear: on regular meshes between
# held edges shear constraints imply one another, and their forces would not be unique
SLACK = 1e-5


@dataclass(frozen=True)
class BoundSection:
    """A section on a mesh.

    Args:
        formulation: Mixed form of its strain energy.
        force: Size of the shear stiffness, scale of the director's multiplier, N/m.
        hourglass: Stiffness of the hourglass control, N/m.
    """

    formulation: Formulation
    force: fem.Constant
    hourglass: Expr


def bind_section(shell: Shell, domain: mesh.Mesh) -> BoundSection:
    """Constants and element-wise weights of a shell's section; what is left out is absent.

    Args:
        shell: The shell.
        domain: Its mesh.
    """
    section = shell.section
    cells = domain.topology.index_map(2)
    count = cells.size_local + cells.num_ghosts
    slenderness = section.thickness / domain.h(2, np.arange(count, dtype=np.int32))

    def per_element(weight: npt.NDArray[np.float64]) -> fem.Function:
        # below one for any thickness, so that the reduced part never vanishes
        function = fem.Function(fem.functionspace(domain, ("DG", 0)))
        function.x.array[:] = weight / (1 + weight)
        return function

    def constant(value: float | npt.NDArray[np.float64]) -> fem.Constant:
        return fem.Constant(domain, np.asarray(value, dtype=float))

    a = per_element(STABILISATION[domain.topology.cell_name()] * slenderness**2)
    b = per_element(HOURGLASS * slenderness)
    if isinstance(section, LinearSection):
        N0 = constant(float(np.max(np.diag(section.A))))
        linear = LinearMixed(
            A=constant(section.A),
            D=constant(section.D),
            G=constant(section.G),
            A_inv=constant(np.linalg.inv(section.A)) if shell.stretching else None,
            G_inv=constant(np.linalg.inv(section.G)) if shell.transverse_shear else None,
            N0=N0,
            a=a,
            # without stretching there is nothing that bending could be coupled to
            B=constant(section.B)
            if section.coupled and shell.coupling and shell.stretching
            else None,
            slack=constant(SLACK / float(np.max(np.diag(section.G))))
            if shell.holds_strains
            else None,
        )
        return BoundSection(linear, constant(float(np.max(np.diag(section.G)))), N0 * b)
    assert isinstance(section, Hyperelastic)
    parameters = {name: constant(value) for name, value in section.parameters.items()}
    N0, who = constant(section.stiffness), f"shell '{shell.name}': energy"
    strains = ShellStrains(*(constant(np.zeros(size)) for size in (3, 3, 2)))
    resists_all(section.energy, strains, parameters, who)
    nonlinear = NonlinearMixed(
        psi=lambda strains: written(section.energy, (strains, parameters), who),
        N0=N0,
        a=a,
        thickness=constant(section.thickness),
    )
    return BoundSection(nonlinear, N0, N0 * b)


def bind_mass(shell: Shell, domain: mesh.Mesh) -> Mass:
    """Mass coefficients of eq. (16); what is zero or left out is absent from the forms.

    Args:
        shell: The shell.
        domain: Its mesh.
    """
    m, s, inertia = shell.section.mass
    # without I* a first moment would make the kinetic energy indefinite
    eccentric = shell.rotary_inertia and shell.eccentric_inertia

    def constant(value: float, wanted: bool) -> fem.Constant | None:
        return fem.Constant(domain, float(value)) if wanted and value else None

    mass = fem.Constant(domain, float(m))
    return Mass(mass, constant(s, eccentric), constant(inertia, shell.rotary_inertia))
