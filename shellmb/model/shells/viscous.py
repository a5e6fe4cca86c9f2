"""Damping of a shell's strains, bound to its mesh."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from dolfinx import fem
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives
from ufl.core.expr import Expr
from ufl.corealg.traversal import traverse_unique_terminals

from shellmb.errors import SceneError
from shellmb.forms import hourglass
from shellmb.forms.steps.damping import Viscous, ViscousShell
from shellmb.forms.steps.mixed import LinearMixed
from shellmb.forms.steps.mixed_nonlinear import NonlinearMixed
from shellmb.forms.steps.pathwork_nonlinear import tangent
from shellmb.model.damping import Resisting, StrainDamping
from shellmb.model.shells import path
from shellmb.model.shells.bound import BoundShell
from shellmb.model.shells.varying import Rule, SectionFields
from shellmb.scene import LinearSection
from shellmb.scene.shells.lamination import Layup
from shellmb.scene.values.validate import show

Floats = npt.NDArray[np.float64]

# eigenvalues of a stiffness that are less than this, relative to the largest, are round-off
NEGATIVE = 1e-10


def strain_damping(shell: BoundShell) -> StrainDamping | None:
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
    if not path.quadratic_strains(shell):
        own = shell.shell.strains
        raise SceneError(
            f"shell '{shell.name}': strains is {getattr(own, '__name__', own)}, which is not "
            "quadratic in displacement and director; with damping of the section it must be, or "
            "the damping a term of the shell"
        )
    formulation = shell.section.formulation
    assert isinstance(formulation, LinearMixed | NonlinearMixed)
    if isinstance(formulation, LinearMixed):
        full, reduced = (_linear(shell, formulation, rule) for rule in ("full", "reduced"))
    else:
        full = reduced = _at_rest(shell, formulation)
    strain = path.strain_measure(shell)
    parts = []
    if any(part is not None for part in full):
        section = ViscousShell(full, reduced, formulation.a)
        parts.append(Resisting(section, strain, lambda d: shell.integrate((d[0], d[1]))))
    if shell.rules.lines is not None and full.A is not None:
        time, lines = fem.Constant(shell.mixed.space.mesh, times[0]), path.lines_of(shell, strain)
        parts.append(
            Resisting(
                hourglass.LineSection(),
                lines,
                lambda d: shell.hourglass((time * d[0], time * d[1])),
            )
        )
    return StrainDamping(shell.layout, parts) if parts else None


def _linear(shell: BoundShell, section: LinearMixed, rule: Rule) -> Viscous:
    """Coefficients of a linear section for a rule; of strains that are held none."""
    assert isinstance(shell.shell.section, LinearSection)
    fields = SectionFields(shell.shell, shell.mixed.space.mesh)
    membrane, bend, shear = shell.shell.section.damping_times
    if section.A_inv is None:
        membrane = 0.0
    if section.G_inv is None:
        shear = 0.0
    both = math.sqrt(membrane * bend) if section.B is not None else 0.0

    def part(time: float, name: str) -> Expr | None:
        def value(at: Layup) -> Floats:
            return time * np.asarray(getattr(at, name))

        return fields.of(value, rule) if time else None

    return Viscous(part(membrane, "A"), part(both, "B"), part(bend, "D"), part(shear, "G"))


def _at_rest(shell: BoundShell, section: NonlinearMixed) -> Viscous:
    """Coefficients from the stiffness of an energy where it is undeformed."""
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
    return Viscous(
        part(membrane, C[:3, :3]), coupling, part(bend, C[3:6, 3:6]), part(shear, C[6:, 6:])
    )


def _numbers(matrix: Expr) -> Floats:
    """Values of an expression of Constants, shape (n, n)."""
    lowered = apply_derivatives(apply_algebra_lowering(matrix))
    terminals = traverse_unique_terminals(lowered)
    known = {c: c.value.tolist() for c in terminals if isinstance(c, fem.Constant)}
    n, m = lowered.ufl_shape
    return np.array([[float(lowered[i, j]((0.0,) * 3, known)) for j in range(m)] for i in range(n)])
