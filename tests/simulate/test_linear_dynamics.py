"""Small displacements in time: energy, frequencies, the limit of small motions, mechanisms."""

import math
from typing import Any

import numpy as np
import pytest
import ufl

from shellmb.errors import SceneError
from shellmb.observers.account.energy import EnergyAccount
from shellmb.observers.account.momentum import Momentum
from shellmb.running.execute import execute
from shellmb.running.natural_modes.vibration import natural_modes
from shellmb.scene import (
    Clamped,
    Driven,
    Driver,
    Fixed,
    Gravity,
    InitialVelocity,
    Isotropic,
    JointDamper,
    JointSpring,
    Laminate,
    Lock,
    Output,
    Ply,
    PlyMaterial,
    PointForce,
    Pressure,
    Probe,
    Rectangle,
    Revolute,
    RigidBody,
    Rolling,
    Scene,
    Shell,
    Solver,
    Spherical,
    Spring,
    Weld,
)
from shellmb.simulate.simulation import Simulation

STEEL = Isotropic(E=2e11, nu=0.3, thickness=5e-3, density=7800.0)
PLIES = PlyMaterial(E1=2e11, E2=1e11, nu12=0.3, G12=5e10, G13=5e10, G23=5e10, density=7800.0)
# coupled and eccentric
SKEW = Laminate((Ply(PLIES, 2e-3, 20.0), Ply(PLIES, 2e-3, 70.0)), offset=1e-3)
DT = 2e-3
# what is left after a second update in each step
EXACT = Solver(newton="modified")


def struck(amplitude: float = 1.0, section: Any = STEEL, **more: Any) -> Scene:
    """A cantilever plate that a pulse of 20 ms at a corner sets ringing."""
    given: dict[str, Any] = {
        "supports": Clamped("left"),
        "loads": PointForce(
            "right-bottom",
            (0.0, 0.0, amplitude),
            time=lambda t: math.sin(math.pi * min(t / 0.02, 1.0)) ** 2,
        ),
        "probes": Probe("tip", "right-top"),
        "scheme": "linear-dynamics",
        "dt": DT,
        "t_end": 0.4,
    }
    shell = Shell("plate", Rectangle(1.0, 0.3), section, mesh=(4, 2))
    return Scene("struck", shell, **given | more)


def watched(scene: Scene) -> tuple[Simulation, EnergyAccount, Momentum]:
    simulation, account = Simulation(scene), EnergyAccount()
    momentum = Momentum(account)
    simulation.run([account, momentum])
    return simulation, account, momentum


@pytest.mark.parametrize("section", [STEEL, SKEW])
def test_energy_is_kept(section) -> None:
    """To round-off; with one solution in each step to what that leaves of stiff forces."""
    simulation, account, momentum = watched(struck(section=section, solver=EXACT))
    assert account.values["work_loads"] > 0
    assert account.relative_error < 1e-12
    for kind, size in (("momentum", 1e-12), ("angular momentum", 1e-12)):
        largest = max(np.linalg.norm(momentum.values[kind]), 1e-3)
        assert momentum.drift[kind] < size * largest
    once, account, _ = watched(struck(section=section))
    assert account.relative_error < 5e-9
    assert once.problem.iteration.factorisations == 1
    assert once.iterations == once.step + 1
    assert simulation.iterations == 2 * simulation.step


def test_it_rings_with_its_natural_frequencies() -> None:
    """The mid-point rule has `tan(w' dt/2) = w dt/2`: eight of them make up all of the motion."""
    scene = struck(t_end=1.0)
    modes = natural_modes(scene, count=8)
    result = execute(scene)
    t, x = result.column("t"), result.column("tip")
    free = t > 0.021

    def left_over(scale: float) -> float:
        w = 2 / DT * np.arctan(scale * modes.omega * DT / 2)
        columns = [f(wk * t[free]) for wk in w for f in (np.cos, np.sin)]
        basis = np.stack(columns, axis=1)
        found = np.linalg.lstsq(basis, x[free], rcond=None)[0]
        return float(np.std(basis @ found - x[free]) / np.std(x[free]))

    # the modes above the eighth; a frequency off by one per cent shows
    assert left_over(1.0) < 1e-3
    assert left_over(1.01) > 0.1


def test_it_is_the_limit_of_small_motions() -> None:
    """EP differs by the square of the amplitude."""
    unit = execute(struck()).column("tip")
    off = []
    for amplitude in (40.0, 20.0):
        large = execute(struck(amplitude, scheme="ep")).column("tip") / amplitude
        off.append(np.max(np.abs(large - unit)) / np.max(np.abs(unit)))
    assert 1e-6 < off[1] < off[0] < 0.1
    assert off[0] / off[1] == pytest.approx(4.0, rel=0.1)


def test_a_free_plate_keeps_its_momenta() -> None:
    """About the positions that it was given: rotations are small."""
    motion = InitialVelocity(linear=(0.1, 0.2, 0.3), spin=(0.3, 0.2, 0.1))
    free = struck(section=SKEW, supports=(), loads=(), initial=motion, solver=EXACT, t_end=0.05)
    _, account, momentum = watched(free)
    assert account.relative_error < 1e-12
    for kind, value in momentum.values.items():
        assert momentum.drift[kind] < 1e-12 * np.linalg.norm(value)


K, ARM, MASS, INERTIA, C = 50.0, 0.5, 2.0, 0.1, 0.3


def pendulum(**more: Any) -> Scene:
    """A rigid arm on a hinge with a spring; what it carries is welded and tied to it."""
    bob = RigidBody("bob", mass=1.0, inertia=(1e-3, 1e-3, 1e-3), position=(2 * ARM, 0, 0))
    given: dict[str, Any] = {
        "rigid_bodies": (
            RigidBody("arm", mass=MASS, inertia=(0.1, INERTIA, 0.1), position=(ARM, 0, 0)),
            bob,
        ),
        "joints": (
            Revolute("hinge", "ground", "arm", at=(0, 0, 0), axis=(0, 1, 0)),
            Weld("tip", "arm", "bob", at=(2 * ARM, 0, 0)),
        ),
        "force_elements": JointSpring("coil", "hinge", stiffness=K),
        "initial": InitialVelocity(spin=(0.0, 0.1, 0.0)),
        "probes": Probe("z", (2 * ARM, 0, 0), body="bob"),
        "scheme": "linear-dynamics",
        "dt": 0.01,
        "t_end": 2.0,
    }
    return Scene("pendulum", **given | more)


def test_a_mechanism_on_a_spring() -> None:
    """`w^2 = k/J` to round-off, by the mid-point rule, its velocity consistent from the start."""
    J = INERTIA + MASS * ARM**2 + 1e-3 + 1.0 * (2 * ARM) ** 2
    w = 2 / 0.01 * math.atan(math.sqrt(K / J) * 0.01 / 2)
    result = execute(pendulum())
    t, z = result.column("t"), result.column("z")
    # the rule's own velocity at the start makes the amplitude
    size = -0.1 * 2 * ARM / math.sqrt(K / J)
    np.testing.assert_allclose(z, size * np.sin(w * t), atol=1e-9 * abs(size))
    assert result.summary["energy_balance_error"] < 1e-12


def test_what_damps_is_in_the_account() -> None:
    _, account, _ = watched(
        pendulum(
            force_elements=(
                JointSpring("coil", "hinge", potential=lambda e: K * e**2 / 2 + 1e3 * e**4),
                JointDamper("oil", "hinge", damping=C),
                Spring("tie", "ground", "bob", (1, 0, -1), (1, 0, 0), stiffness=10.0),
            )
        )
    )
    assert account.relative_error < 1e-12
    assert account.values["work_terms"] < -0.1 * account.largest


def test_a_small_drive() -> None:
    """The driven arm follows; its work is in the account."""
    drive = Driver("motor", "hinge", rotation=lambda t: 0.02 * math.sin(math.pi * t) ** 2)
    simulation, account, _ = watched(pendulum(drivers=drive, initial=(), t_end=0.5))
    assert simulation.iterations == simulation.step + 1
    # at rest at the end of the drive
    assert account.values["work_supports"] == pytest.approx(K * 0.02**2 / 2, rel=1e-9)
    assert account.relative_error < 1e-11


def on_springs(point: Any) -> Any:
    """A bed of springs, 1e5 N/m^3."""
    return -1e5 * ufl.dot(point.u, point.du)


def test_a_plate_on_a_bed_of_springs() -> None:
    """Added terms count with their linear part, in statics and in time."""
    shell = Shell("plate", Rectangle(1.0, 0.3), STEEL, mesh=(2, 1), terms=(on_springs,))
    load = {"loads": Pressure(100.0), "probes": Probe("w", "right-top")}
    guided = Fixed("left", (0.0, 0.0, None))
    held = execute(Scene("bed", shell, scheme="linear-statics", supports=guided, **load))
    free = Scene("bed", shell, scheme="linear-dynamics", dt=1e-3, t_end=0.1, **load)
    assert held.column("w")[-1] == pytest.approx(1e-3, rel=1e-9)
    result = execute(free)
    w0 = math.sqrt(1e5 / (7800.0 * 5e-3))
    w = 2e3 * math.atan(w0 * 1e-3 / 2)
    exact = 1e-3 * (1 - np.cos(w * result.column("t")))
    np.testing.assert_allclose(result.column("w"), exact, atol=1e-8)
    assert result.summary["energy_balance_error"] < 1e-9


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: pendulum(drivers=Driver("motor", "hinge", rotation=lambda t: t**2)),
            "driver 'motor': rotation is 4.0 at t = 2; with scheme 'linear-dynamics' rotations",
        ),
        (
            lambda: struck(supports=Driven("left", axis=(0, 1, 0), rotation=lambda t: t)),
            "rotation is 0.4",
        ),
        (lambda: struck(start="equilibrium"), "start is 'equilibrium'; with scheme 'linear-dynam"),
        (lambda: pendulum(assemble=True), "assemble is True; with scheme"),
        (lambda: struck(output=Output(end_forces=True)), "output has end_forces"),
        (lambda: pendulum(locks=Lock("hinge", (1.0, 1.5))), "a window begins at t = 1"),
        (
            lambda: pendulum(
                joints=Rolling(
                    *("wheel", "ground", "arm"), at=(ARM, 0, -0.1), normal=(0, 0, 1), radius=0.1
                ),
                force_elements=(),
            ),
            "what rolls goes far",
        ),
    ],
)
def test_what_is_not_small_is_refused(make, message) -> None:
    with pytest.raises(SceneError, match=message):
        make()


def test_springs_must_be_at_rest() -> None:
    for spring in (
        JointSpring("coil", "hinge", stiffness=K, rest=0.1),
        JointSpring("coil", "hinge", potential=lambda e: K * (e - 0.1) ** 2),
    ):
        with pytest.raises(SceneError, match=r"spring 'coil': it pulls with -?[0-9.]+ in the"):
            Simulation(pendulum(force_elements=spring))


def test_a_run_says_that_displacements_were_not_small() -> None:
    (caution, *others) = execute(struck(1000.0, t_end=0.1)).warnings
    assert caution.watch == "small displacements" and caution.body == "plate"
    assert caution.says.startswith("shell 'plate' turns by")
    # two elements across twist by some per cent too little, whatever the size
    assert [other.watch for other in others] == ["coarse mesh"]
    assert [other.watch for other in execute(struck(100.0, t_end=0.1)).warnings] == ["coarse mesh"]


def test_a_weight_on_a_string_does_not_swing() -> None:
    """What is linear knows no stiffness by forces: a run that falls says so."""
    bob = RigidBody("bob", mass=1.0, inertia=(1.0, 1.0, 1.0), position=(0, 0, -1))
    scene = Scene(
        "string",
        rigid_bodies=bob,
        joints=Spherical("peg", "ground", "bob", at=(0, 0, 0)),
        loads=Gravity((1.0, 0, -9.81)),
        scheme="linear-dynamics",
        dt=0.05,
        t_end=1.0,
    )
    (caution,) = execute(scene).warnings
    assert caution.watch == "small displacements" and "the rigid bodies turn by" in caution.says
