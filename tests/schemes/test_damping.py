"""Damping of strains and momentum: decay of single modes, exact work, rigid motions, bad input."""

from dataclasses import replace
from functools import cache
from typing import Any

from mpi4py import MPI

import numpy as np
import pytest
import ufl

from shellmb.errors import SceneError
from shellmb.forms import shell as shell_forms
from shellmb.forms.shell import ShellStrains
from shellmb.model.model import Model
from shellmb.observers.account.energy import EnergyAccount
from shellmb.preprocessing.modal.tangent import tangent
from shellmb.scene import (
    Beam,
    BeamDamping,
    Clamped,
    Gravity,
    Hyperelastic,
    InitialVelocity,
    Isotropic,
    Laminate,
    Line,
    Ply,
    PlyMaterial,
    Rectangle,
    RectangularSection,
    Scene,
    Shell,
    ShellDamping,
    Solver,
    StepControl,
)
from shellmb.simulate.eigenmodes import shift_below
from shellmb.simulate.simulation import BaseObserver, Simulation
from shellmb.system.eigenvalues import eigenpairs
from tests.bench.effects.plates import _quadratic

E, RHO, LENGTH, SIDE = 2e11, 8000.0, 1.0, 0.1
# bending and stretching lie within a decade, so that one damping time shows in both
MODES = {"bending": 2, "stretching": 0}
EXACT = Solver(tolerance=1e-13)
SLOW = pytest.mark.slow
SCHEMES = [
    ("ep", 2),
    pytest.param("linear-dynamics", 2, marks=SLOW),
    pytest.param("ed", 3, marks=SLOW),
    pytest.param("ep4", 4, marks=SLOW),
    pytest.param("ed3", 3, marks=SLOW),
]


def strip(kind: str, scheme: str, damping: Any = 0.0, mass: float = 0.0, **more: Any) -> Scene:
    """A cantilever of a square cross-section, as a shell or a beam."""
    own = {"stiffness_damping": damping, "mass_damping": mass}
    if kind != "beam":
        section = Isotropic(E, 0.0, thickness=SIDE, density=RHO, **own)
        cell: Any = "tri" if kind == "triangles" else "quad"
        shell = Shell("strip", Rectangle(LENGTH, SIDE), section, mesh=(3, 1), cell=cell)
        bodies = {"shells": shell}
        held = "left"
    else:
        bar = RectangularSection(E, 0.0, width=SIDE, height=SIDE, density=RHO, **own)
        bodies = {"beams": Beam("strip", Line((0, 0, 0), (LENGTH, 0, 0)), bar, elements=3)}
        held = "start"
    alpha = {"alpha": 0.5} if scheme in ("ed", "ed3") else {}
    given = {"supports": Clamped(held), "scheme": scheme, "dt": 1.0, "t_end": 1.0, **alpha, **more}
    return Scene("strip", **bodies, **given)


class Works(BaseObserver):
    """Energy and the work of damping after each step."""

    def __init__(self, account: EnergyAccount) -> None:
        self._account = account
        self.done: list[float] = []
        self.energy: list[float] = []

    def accepted(self, simulation: Simulation) -> None:
        self.done.append(self._account.values["work_terms"])
        self.energy.append(self._account.values["total_energy"])


@cache
def mode(kind: str, what: str) -> tuple[float, Any]:
    """Lowest mode of a kind: its angular frequency, and its shape as a state of the body."""
    model = Model(strip(kind, "ep"), MPI.COMM_WORLD)
    system, stiffness, mass = tangent(model)
    K, M = system.symmetric_matrix(stiffness, 1.0), system.symmetric_matrix(mass, 0.0)
    values, vectors = eigenpairs(K, M, 12, shift_below(model, False), symmetric=True)
    dofs = model.meshed["strip"].mixed.dofs["u"].reshape(-1, 3)
    for value, vector in zip(values, vectors, strict=True):
        state = system.local_values(vector)
        sizes = np.abs(state[dofs]).max(axis=0)
        if np.argmax(sizes) == MODES[what]:
            return float(np.sqrt(value.real)), state / sizes.max()
    raise AssertionError(what)


def decay(kind: str, what: str, scheme: str, steps: int, tau: Any, rate: float) -> float:
    """Error of the deflection in a mode after a period that began with a velocity, relative."""
    omega, shape = mode(kind, what)
    time = tau if isinstance(tau, float) else tau.bending if what == "bending" else 0.0
    delta = (rate + time * omega**2) / 2
    turning = np.sqrt(omega**2 - delta**2)
    period, speed = 2 * np.pi / omega, 1e-6 * omega
    scene = strip(kind, scheme, tau, rate, dt=period / steps, t_end=0.8 * period, solver=EXACT)
    simulation = Simulation(scene)
    body = simulation.model.meshed["strip"]
    dofs = body.mixed.dofs
    moving = np.concatenate([dofs[part].ravel() for part in body.kinematic])
    levels = simulation.problem.levels["strip"]
    levels.rates["v"].x.array[moving] = speed * shape[moving]
    account = EnergyAccount()
    works = Works(account)
    simulation.run([account, works])
    end = scene.t_end
    found = float(levels.q.x.array[dofs["u"].ravel()] @ shape[dofs["u"].ravel()])
    found /= float(shape[dofs["u"].ravel()] @ shape[dofs["u"].ravel()])
    exact = speed / turning * np.exp(-delta * end) * np.sin(turning * end)
    assert np.all(np.diff(works.done) < 0)
    assert account.relative_error < 1e-12
    return (found - exact) / 1e-6


# triangles take means of strains over an element, and damp these
@pytest.mark.parametrize(
    "kind", ["beam", pytest.param("shell", marks=SLOW), pytest.param("triangles", marks=SLOW)]
)
@pytest.mark.parametrize(("scheme", "order"), SCHEMES)
def test_modes_decay_as_theory_says(scheme: str, order: int, kind: str) -> None:
    for what in MODES:
        # zeta = tau omega/2 + rate/(2 omega): 0.05 in all, half of it by the mass
        omega, _ = mode(kind, what)
        tau, rate = 0.05 / omega, 0.05 * omega
        # in steps in which order 4 is still above the mode's own nonlinearity
        steps = (10, 20) if order == 4 else (20, 40)
        errors = [decay(kind, what, scheme, n, tau, rate) for n in steps]
        slopes = np.log2(np.abs(errors[:-1]) / np.abs(errors[1:]))
        assert slopes[-1] == pytest.approx(order, abs=0.2)
        assert abs(errors[-1]) < {2: 2e-2, 3: 5e-4, 4: 5e-5}[order]


@pytest.mark.parametrize("kind", [pytest.param("shell", marks=SLOW), "beam"])
def test_each_time_damps_its_own_part(kind: str) -> None:
    # bending alone: stretching goes on undamped
    omega, _ = mode(kind, "bending")
    own = (ShellDamping if kind == "shell" else BeamDamping)(bending=0.1 / omega)
    for what in MODES:
        assert abs(decay(kind, what, "ep", 80, own, 1e-3)) < 5e-3


@pytest.mark.parametrize("scheme", ["ep", pytest.param("ep4", marks=SLOW)])
def test_rigid_rotation_is_not_damped(scheme: str, history) -> None:
    # so strongly that what stretches at the beginning is at rest after some steps
    spin = InitialVelocity(spin=(0.0, 0.0, 40.0), linear=(1.0, 2.0, 3.0))
    more = {"supports": (), "initial": spin, "dt": 2e-3, "t_end": 0.1}
    # momenta are kept as far as equations hold
    more["solver"] = Solver(tolerance=1e-12)
    account = EnergyAccount()
    works = Works(account)
    Simulation(strip("shell", scheme, 1e-3, **more)).run([account, works, history])
    energy = np.array(works.energy)
    # it stretches, and that is damped; then it turns by 3 rad with what is left
    assert 1e-9 * energy[0] < -works.done[9] < 1e-3 * energy[0]
    # what is left of the waves along it fades slowly, as steps are long for them: not round-off
    assert np.ptp(energy[10:]) < 1e-8 * energy[0]
    assert np.ptp(energy[-5:]) < 1e-9 * energy[0]  # not round-off
    for kept in (history.linear, history.angular):
        assert np.ptp(kept, axis=0).max() < 1e-11 * np.linalg.norm(kept[0])


@pytest.mark.parametrize("scheme", ["ep", pytest.param("ep4", marks=SLOW)])
def test_momentum_falls_by_the_rate_of_mass_damping(scheme: str, history) -> None:
    spin = InitialVelocity(spin=(0.0, 0.0, 4.0), linear=(1.0, 2.0, 3.0))
    more = {"supports": (), "initial": spin, "dt": 0.01, "t_end": 0.5}
    account = EnergyAccount()
    Simulation(strip("shell", scheme, mass=2.0, **more)).run([account, history])
    left = np.exp(-2.0 * 0.5)
    # E SIDE^2 LENGTH is 4e6 times the energy of the motion, so that round-off of strains counts:
    # up to 1.6e-12 was seen
    assert account.relative_error < 2e-11
    for kept in (history.linear, history.angular):
        assert np.linalg.norm(kept[-1] - left * kept[0]) < 1e-3 * np.linalg.norm(kept[0])


def test_hyperelastic_sections_are_damped_by_their_stiffness_at_rest() -> None:
    nu, h = 0.3, 0.01
    A, G = E * h / (1 - nu**2), 5 / 6 * E * h / (2 * (1 + nu))
    values = {"nu": nu, "A": A, "D": A * h**2 / 12, "G": G}
    own = {"stiffness_damping": ShellDamping(membrane=1e-3, bending=2e-3, shear=3e-3)}
    damped = Hyperelastic(_quadratic, values, thickness=h, density=RHO, stiffness=E * h, **own)
    shell = Shell("plate", Rectangle(1.0, 1.0), damped, mesh=(2, 2))
    body = Model(Scene("s", shell, scheme="ep", dt=1.0, t_end=1.0), MPI.COMM_WORLD)
    bound = body.shells["plate"]
    membrane, coupling, bend, shear = bound.stiffness_at_rest(bound.section.formulation)
    assert coupling is None
    elastic = Isotropic(E, nu, thickness=h, density=RHO)
    assert membrane.value == pytest.approx(1e-3 * elastic.A, rel=1e-12)
    assert bend.value == pytest.approx(2e-3 * elastic.D, rel=1e-12)
    assert shear.value == pytest.approx(3e-3 * elastic.G, rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["ep", "ed", "ep4"])
def test_an_energy_of_the_user_is_damped_as_the_section_whose_it_is(scheme: str) -> None:
    A, G = E * SIDE, 5 / 6 * E * SIDE / 2
    values = {"nu": 0.0, "A": A, "D": A * SIDE**2 / 12, "G": G}
    times = ShellDamping(membrane=1e-3, bending=2e-3, shear=3e-3)
    own = Hyperelastic(
        _quadratic, values, thickness=SIDE, density=RHO, stiffness=A, stiffness_damping=times
    )
    found = []
    for section in (None, own):
        scene = strip("shell", scheme, times, loads=Gravity((1e5, 0, -1e4)), dt=1e-3, t_end=0.01)
        if section is not None:
            scene = replace(scene, shells=replace(scene.shells[0], section=section))
        simulation, account = Simulation(scene), EnergyAccount()
        simulation.run([account])
        assert account.relative_error < 1e-10
        q = simulation.problem.levels["strip"].q.x.array
        dofs = simulation.model.meshed["strip"].mixed.dofs["u"].ravel()
        found.append([*q[dofs], account.values["work_terms"]])
    assert found[1] == pytest.approx(found[0], rel=1e-6, abs=1e-9)


@pytest.mark.slow
def test_a_coupled_laminate_in_steps_of_its_own_choice() -> None:
    ply = PlyMaterial(2e11, 1e10, nu12=0.3, G12=5e9, G13=5e9, G23=5e9, density=RHO)
    times = ShellDamping(membrane=1e-4, bending=4e-4)
    skew = Laminate(
        (Ply(ply, 0.01, 20.0), Ply(ply, 0.01, 70.0)), stiffness_damping=times, mass_damping=1.0
    )
    scene = strip("shell", "ep4", loads=Gravity((0, 0, -50.0)), dt=1e-2, t_end=0.3)
    control = StepControl(step_error=1e-3)
    scene = replace(scene, shells=replace(scene.shells[0], section=skew), step_control=control)
    simulation, account = Simulation(scene), EnergyAccount()
    works = Works(account)
    simulation.run([account, works])
    assert account.relative_error < 1e-10
    assert np.all(np.diff(works.done) < 0)
    assert len(works.done) != 30


def test_what_cannot_be_damped_is_said() -> None:
    with pytest.raises(SceneError, match=r"damping; scheme 'generalized-alpha' does not take"):
        Simulation(strip("beam", "generalized-alpha", 1e-3))

    def logarithmic(u: Any, w: Any, surface: Any) -> ShellStrains:
        e = shell_forms.shell_strains(u, w, surface)
        return ShellStrains(ufl.as_vector([ufl.ln(1 + 2 * x) / 2 for x in e.eps]), e.kap, e.gam)

    section = Isotropic(E, 0.3, thickness=0.01, density=RHO, stiffness_damping=1e-3)
    shell = Shell("plate", Rectangle(1.0, 1.0), section, mesh=(2, 2), strains=logarithmic)
    with pytest.raises(SceneError, match="'plate': strains is logarithmic, which is not quadratic"):
        Simulation(Scene("s", shell, scheme="ep", dt=1.0, t_end=1.0))
    concave = Hyperelastic(
        lambda e, p: -_quadratic(e, p),
        {"nu": 0.3, "A": 1.0, "D": 1.0, "G": 1.0},
        thickness=0.01,
        density=RHO,
        stiffness=1e3,
        stiffness_damping=1e-3,
    )
    shell = Shell("plate", Rectangle(1.0, 1.0), concave, mesh=(2, 2))
    with pytest.raises(SceneError, match="stiffness at zero strain that is not positive"):
        Simulation(Scene("s", shell, scheme="ep", dt=1.0, t_end=1.0))


@pytest.mark.parametrize("given", [-1.0, "much", BeamDamping(axial=1.0), float("inf")])
def test_damping_is_a_time_or_several(given: Any) -> None:
    with pytest.raises(
        SceneError, match=r"isotropic section: stiffness_damping is .*; it must be a time in"
    ):
        Isotropic(E, 0.0, thickness=0.1, stiffness_damping=given)


@pytest.mark.parametrize("kind", [pytest.param("shell", marks=SLOW), "beam"])
@pytest.mark.parametrize("scheme", ["ep", pytest.param("ep4", marks=SLOW)])
def test_a_term_of_the_strain_rate_is_the_damping(scheme: str, kind: str) -> None:
    # Kelvin and Voigt's damping of bending, by the section and as a term of the user
    time, stiff = 1e-3, E * SIDE**3 / 12

    def of_shell(point: Any) -> Any:
        m = ufl.as_vector([1, 1, 0.5])
        rate, de = point.strain_rate.kap, point.dstrain.kap
        # it knows where it is and how it is turned: that adds nothing here
        straight = ufl.dot(point.normal, ufl.cross(point.d, point.normal)) * point.x[0]
        return (
            -time * stiff * sum(m[k] * rate[k] * de[k] for k in range(3)) + straight * point.du[0]
        )

    def of_beam(point: Any) -> Any:
        rate, de = point.strain_rate, point.dstrain
        return -time * stiff * SIDE * (rate[4] * de[4] + rate[5] * de[5]) + 0 * point.x[0]

    def ends(own: bool) -> tuple[float, float]:
        several = ShellDamping if kind == "shell" else BeamDamping
        load = Gravity((0, 0, -1e4))
        damping = 0.0 if own else several(bending=time)
        scene = strip(kind, scheme, damping, loads=load, dt=1e-3, t_end=0.02)
        if own and kind == "shell":
            scene = replace(scene, shells=replace(scene.shells[0], terms=(of_shell,)))
        if own and kind == "beam":
            scene = replace(scene, beams=replace(scene.beams[0], terms=(of_beam,)))
        simulation, account = Simulation(scene), EnergyAccount()
        simulation.run([account])
        assert account.relative_error < 1e-11
        levels = simulation.problem.levels["strip"]
        return float(np.abs(levels.q.x.array).max()), account.values["work_terms"]

    # ep4 projects the rate of the section's strain, a term has it at Gauss' points in time
    close = {"ep": 1e-6, "ep4": 1e-3}[scheme]
    assert ends(True) == pytest.approx(ends(False), rel=close)
