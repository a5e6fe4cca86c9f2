"""Starts from a state: of a run, of one of its frames, a natural mode, a given shape.

What would show them wrong: a mode that does not swing as a cosine, an equilibrium that moves, a
tension that is lost, an energy that is not the one of the given shape.
"""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import shellmb as sm
from shellmb.errors import SceneError, ShellmbWarning
from shellmb.observers.account.energy import EnergyAccount
from shellmb.running.execute import RunResult, execute
from shellmb.running.natural_modes.vibration import natural_modes
from shellmb.simulate.simulation import Simulation

E, H, RHO, L, WIDTH, FORCE = 70e9, 2e-3, 2700.0, 1.0, 0.25, 5.0
SECTION = sm.Isotropic(E=E, nu=0.0, thickness=H, density=RHO)
SCHEMES = ("ep", "ed", "ep4", "ed3", "generalized-alpha", "linear-dynamics")
LARGE = SCHEMES[:-1]


def strip(load: float = 0.0, **more: Any) -> sm.Scene:
    """A cantilever strip, pulled aside at its end by a load per length."""
    return sm.Scene(
        "strip",
        sm.Shell("strip", sm.Rectangle(L, WIDTH), SECTION, mesh=(4, 1)),
        supports=sm.Clamped("left"),
        loads=sm.EdgeForce("right", (0, 0, load)) if load else (),
        **more,
    )


def dofs(simulation: Simulation, *parts: str) -> np.ndarray:
    """Values of some parts of the strip."""
    body = simulation.model.shells["strip"].mixed.dofs
    q = simulation.problem.state("strip").x.array
    return np.concatenate([q[body[part].ravel()] for part in parts])


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, RunResult]:
    """A path of equilibria to the load factor 2, with its frames."""
    folder = tmp_path_factory.mktemp("path") / "run"
    scene = strip(FORCE, scheme="static", path=sm.PathFollowing(load_end=2.0), dt=0.5, t_end=50.0)
    return folder, execute(scene, folder, pictures=False)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_mode_swings_as_a_cosine(scheme: str) -> None:
    """After a quarter of the period it passes zero, to the order of the scheme; energy is kept."""
    omega = natural_modes(strip(scheme="ep", dt=1.0, t_end=1.0), count=1).omega[0]
    quarter, amplitude, errors = math.pi / 2 / omega, 1e-6, []
    for steps in (5, 10):
        scene = strip(
            scheme=scheme,
            dt=quarter / steps,
            t_end=quarter,
            start=sm.FromMode(1, amplitude),
            **({"alpha": 0.5} if scheme == "ed3" else {"alpha": 1.0} if scheme == "ed" else {}),
        )
        simulation, energy = Simulation(scene), EnergyAccount()
        assert np.max(dofs(simulation, "u")) == pytest.approx(amplitude, rel=1e-12)
        simulation.run([energy])
        errors.append(np.max(np.abs(dofs(simulation, "u"))) / amplitude)
        if scheme != "generalized-alpha":
            assert energy.error < 1e-9 * energy.largest
    # ED and ED3 at a point of no displacement are one order better than elsewhere
    least = {"generalized-alpha": 1.7, "ep": 1.9, "linear-dynamics": 1.9}.get(scheme, 3.7)
    assert math.log2(errors[0] / errors[1]) > least


@pytest.mark.parametrize("scheme", LARGE)
def test_the_end_of_a_path_stays_where_it_is(scheme: str, path: tuple[Path, RunResult]) -> None:
    """An equilibrium under its loads, started at rest, does not move; nor do its resultants."""
    folder, run = path
    assert run.simulation.path is not None
    load = FORCE * run.simulation.path.factor
    scene = strip(load, scheme=scheme, dt=0.01, t_end=0.05, start=sm.FromRun(folder))
    simulation, energy = Simulation(scene), EnergyAccount()
    before = dofs(simulation, "u", "w"), dofs(simulation, "N")
    assert np.max(np.abs(before[0])) > 0.05
    simulation.run([energy])
    assert np.max(np.abs(dofs(simulation, "u", "w") - before[0])) < 1e-10
    assert np.max(np.abs(dofs(simulation, "N") - before[1])) < 1e-8 * np.max(np.abs(before[1]))
    assert energy.values["kinetic_energy"] < 1e-17 * energy.values["strain_energy"]


def test_a_frame_of_a_path_stays_where_it_is(path: tuple[Path, RunResult]) -> None:
    """Resultants of a frame are found from its strains; they balance the load of its point."""
    folder, run = path
    t, factor = run.column("t"), run.column("load_factor")
    at = float(t[1])
    frames = execute(replace(run.scene, output=sm.Output(frames=200)), folder.parent / "frames")
    assert frames.column("t")[1] == at
    scene = strip(
        FORCE * float(factor[1]),
        scheme="ep4",
        dt=0.01,
        t_end=0.03,
        start=sm.FromRun(folder.parent / "frames", at=at),
    )
    simulation = Simulation(scene)
    before = dofs(simulation, "u", "w")
    simulation.run()
    assert np.max(np.abs(before)) > 0.01
    assert np.max(np.abs(dofs(simulation, "u", "w") - before)) < 1e-10


def swung(scheme: str, **more: Any) -> sm.Scene:
    """A strip on a turning rod under its weight: directors of a shell, frames of beam and body."""
    rod = sm.RectangularSection(E=E, nu=0.3, width=0.02, height=0.02, density=RHO)
    return sm.Scene(
        "swung",
        sm.Shell("strip", sm.Rectangle(0.5, WIDTH), SECTION, mesh=(2, 1)),
        beams=sm.Beam("rod", sm.Line((0, 0, -1.0), (0, 0, -0.5)), rod, elements=1),
        rigid_bodies=sm.RigidBody("hub", 2.0, (0.01, 0.02, 0.02)),
        joints=[
            sm.Revolute("pin", sm.GROUND, "hub", at=(0, 0, 0), axis=(0, 1, 0)),
            sm.Weld("root", "hub", "strip", second_at="left"),
            sm.Weld("arm", "hub", "rod", at=(0, 0, -0.5), second_at="end"),
        ],
        force_elements=sm.JointSpring("spring", "pin", 5.0, rest=1.0),
        loads=sm.Gravity(),
        scheme=scheme,
        dt=0.01,
        t_end=0.03,
        **more,
    )


@pytest.mark.parametrize(
    ("scheme", "rigid"),
    [
        ("ep4", True),
        pytest.param("ep", False, marks=pytest.mark.slow),
        pytest.param("ed3", False, marks=pytest.mark.slow),
    ],
)
def test_a_frame_of_a_motion_goes_on_as_the_run_did(
    scheme: str, rigid: bool, tmp_path: Path
) -> None:
    """Loads are the same at all times: from a frame in its midst to the same end."""
    fields = ("director", "velocity", "director_velocity")
    output = sm.Output(fields=fields, frames=4)
    scene = swung(scheme, output=output)
    if rigid:
        # its inertia is small: steps of the same angle
        alone = {"shells": (), "beams": (), "joints": scene.joints[:1]}
        scene = replace(scene, **alone, dt=1e-3, t_end=3e-3)
    whole = execute(scene, tmp_path / "whole", pictures=False)
    at = float(whole.column("t")[2])
    half = replace(scene, start=sm.FromRun(tmp_path / "whole", at=at), output=sm.Output())
    rest = execute(replace(half, t_end=scene.dt), tmp_path / "rest", pictures=False)
    for name in ("pin.rotation", "kinetic_energy", "strain_energy"):
        ends = [run.column(name)[-1] for run in (whole, rest)]
        assert abs(ends[0]) > 1e-4
        # Newton's method stops at 1e-9, and a mechanism multiplies what it leaves
        assert ends[1] == pytest.approx(ends[0], rel=1e-6)


@pytest.mark.slow
def test_frames_without_velocities_of_directors_are_named(tmp_path: Path) -> None:
    run = execute(swung("ep", output=sm.Output(frames=4)), tmp_path / "less", pictures=False)
    start = sm.FromRun(tmp_path / "less", at=float(run.column("t")[2]))
    with pytest.raises(SceneError, match="'director_velocity', or velocities must be False"):
        Simulation(swung("ep", start=start))
    Simulation(swung("ep", start=replace(start, velocities=False)))


def test_released_it_has_the_energy_of_the_path(path: tuple[Path, RunResult], tmp_path) -> None:
    """Without the load all strain energy is there to move it; statics leads back from there."""
    folder, run = path
    # a run is as good as its directory
    assert sm.FromRun(sm.Run(folder)) == sm.FromRun(folder)
    scene = strip(scheme="ep4", dt=0.005, t_end=0.1, start=sm.FromRun(folder))
    moved = execute(scene, tmp_path / "moved", pictures=False)
    stored = run.column("strain_energy")[-1]
    total = moved.column("total_energy")
    assert total[0] == pytest.approx(stored, rel=1e-12)
    assert np.ptp(total) < 1e-10 * stored
    assert moved.column("kinetic_energy")[-1] > 0.5 * stored
    # statics about a state of that motion
    back = strip(
        2 * FORCE, scheme="static", dt=1.0, t_end=1.0, start=sm.FromRun(tmp_path / "moved")
    )
    simulation = Simulation(back)
    assert np.max(np.abs(dofs(simulation, "u"))) > 0.01
    simulation.run()
    end = run.simulation.problem.state("strip").x.array
    u = run.simulation.model.shells["strip"].mixed.dofs["u"].ravel()
    # the path ends at a factor that is off by 1e-9
    np.testing.assert_allclose(dofs(simulation, "u"), end[u], atol=1e-8)
    # and on with the motion: the velocities are there
    on = replace(moved.scene, start=sm.FromRun(tmp_path / "moved"), t_end=0.02)
    onward = execute(on, None)
    kinetic = moved.column("kinetic_energy")[-1]
    assert onward.column("kinetic_energy")[0] == pytest.approx(kinetic, rel=1e-12)
    still = execute(replace(on, start=sm.FromRun(tmp_path / "moved", velocities=False)), None)
    assert still.column("kinetic_energy")[0] == 0.0


def circle(x: np.ndarray) -> np.ndarray:
    """The strip rolled to an arc of 1.5 rad."""
    R = L / 1.5
    return np.array([R * np.sin(x[0] / R) - x[0], 0 * x[0], R * (1 - np.cos(x[0] / R))])


def turned(x: np.ndarray) -> np.ndarray:
    """Rotations of that."""
    return np.array([0 * x[0], -1.5 * x[0] / L, 0 * x[0]])


@pytest.mark.parametrize("scheme", ["ep", "ep4"])
def test_a_given_arc_has_the_energy_of_its_curvature(scheme: str) -> None:
    """`E h^3/24 kappa^2` per area; released it swings, and keeps that energy to round-off."""
    scene = strip(scheme=scheme, dt=5e-4, t_end=5e-3, start=sm.FromShape(circle, turned))
    simulation, energy = Simulation(scene.with_options(mesh=(8, 1))), EnergyAccount()
    simulation.run([energy])
    exact = E * H**3 / 24 * 1.5**2 * WIDTH / L
    start = energy.values["total_energy"] - energy.values["energy_balance"]
    # elements of degree 2 are no arcs, and are stretched: by 5.5 % of the energy in four of them
    assert start == pytest.approx(exact, rel=2e-3)
    assert energy.values["kinetic_energy"] > 0.1 * exact
    assert energy.error < 1e-10 * exact


def test_sections_may_change(path: tuple[Path, RunResult]) -> None:
    """Another stiffness has other resultants at the same strains."""
    folder, _ = path
    states = []
    for factor in (1.0, 2.0):
        shell = sm.Shell("strip", sm.Rectangle(L, WIDTH), replace(SECTION, E=factor * E), (4, 1))
        scene = replace(strip(scheme="ep", dt=0.1, t_end=0.1), shells=shell)
        scene = replace(scene, start=sm.FromRun(folder))
        simulation = Simulation(scene)
        # resultants are in units of the section's stiffness
        unit = simulation.model.shells["strip"].force_size
        states.append((dofs(simulation, "u"), unit * dofs(simulation, "N")))
    assert np.max(np.abs(states[0][0] - states[1][0])) < 1e-14
    largest = np.max(np.abs(states[1][1]))
    assert np.max(np.abs(2 * states[0][1] - states[1][1])) < 1e-7 * largest


def test_a_thicker_section_has_the_energy_of_the_same_bending(
    path: tuple[Path, RunResult],
) -> None:
    """Twice the thickness at the same curvature: eight times the energy, in no unit of sections."""
    energies = []
    for thickness in (H, 2 * H):
        shell = sm.Shell(
            "strip", sm.Rectangle(L, WIDTH), replace(SECTION, thickness=thickness), mesh=(4, 1)
        )
        scene = replace(strip(scheme="ep", dt=0.1, t_end=0.1), shells=shell)
        simulation, energy = Simulation(replace(scene, start=sm.FromRun(path[0]))), EnergyAccount()
        energy.start(simulation)
        energies.append(energy.values["strain_energy"])
    # not round-off: what the strip is stretched and sheared by
    assert energies[1] == pytest.approx(8 * energies[0], rel=1e-3)


@pytest.mark.parametrize("kind", ["beam", "shell"])
def test_a_mode_turns_directors_by_its_slope(kind: str) -> None:
    """Of a slender cantilever, 1.3765 times the deflection over the length at the tip (Blevins)."""
    amplitude = 1e-4
    body: dict[str, Any] = {"shells": strip().shells, "supports": sm.Clamped("left")}
    if kind == "beam":
        bar = sm.RectangularSection(E, 0.3, width=0.02, height=0.01, density=RHO)
        line = sm.Line((0, 0, 0), (L, 0, 0))
        body = {"beams": sm.Beam("strip", line, bar, elements=6), "supports": sm.Clamped("start")}
    scene = sm.Scene(
        "strip", **body, scheme="ep", dt=1e-3, t_end=1e-3, start=sm.FromMode(1, amplitude)
    )
    simulation = Simulation(scene)
    own, _, X, _ = simulation.model.nodes_of("strip")
    q = simulation.problem.state("strip").x.array
    tips = np.isclose(X[:, 0], L)
    turned = q[own.mixed.dofs["w"]].reshape(len(X), -1, 3)[tips]
    deflection = np.abs(q[own.mixed.dofs["u"]].reshape(-1, 3)[tips]).max()
    assert deflection == pytest.approx(amplitude, rel=1e-6)
    # two of three directors turn with the slope, the only one of a shell, too
    assert np.abs(turned).max() * L / deflection == pytest.approx(1.3765, rel=1e-2)


def test_what_does_not_fit_is_moved_and_its_energy_is_said(path: tuple[Path, RunResult]) -> None:
    """A support that begins elsewhere is refused; with `assemble` its work is said."""
    folder, _ = path
    held = (sm.Clamped("left"), sm.Fixed("right", displacement=(None, None, 0.07)))
    scene = replace(
        strip(scheme="ep4", dt=0.01, t_end=0.01, start=sm.FromRun(folder)), supports=held
    )
    with pytest.raises(SceneError, match=r"'strip' begins 0.00\d+ away from the state"):
        Simulation(scene)
    with pytest.warns(ShellmbWarning, match="its strain energy was 0.088.*, is"):
        simulation = Simulation(replace(scene, assemble=True))
    assert np.max(dofs(simulation, "u")) == pytest.approx(0.07, rel=1e-12)


def rod(**more: Any) -> sm.Scene:
    """A pendulum, a flexible rod on a hinge."""
    section = sm.RectangularSection(E=2e9, nu=0.3, width=0.02, height=0.02, density=1000.0)
    return sm.Scene(
        "rod",
        beams=sm.Beam("rod", sm.Line((0, 0, 0), (1, 0, 0)), section, elements=2),
        joints=sm.Revolute("pin", sm.GROUND, "rod", at=(0, 0, 0), axis=(0, 1, 0)),
        loads=sm.Gravity((9.81, 0, 0)),
        **more,
    )


def test_modes_about_an_equilibrium_turn_frames_and_fit_joints() -> None:
    """A hanging rod moved in its first mode is back after its period; its hinge is closed."""
    period = 2 * math.pi / math.sqrt(1.5 * 9.81)
    start = ("equilibrium", sm.FromMode(1, 1e-4))
    simulation = Simulation(rod(scheme="ep4", dt=period / 20, t_end=period, start=start))
    body = simulation.model.beams["rod"]
    q, u = simulation.problem.state("rod").x.array, body.mixed.dofs["u"]
    before, energy = q[u].copy(), EnergyAccount()
    assert np.max(np.abs(before)) == pytest.approx(1e-4, rel=1e-6)
    simulation.run([energy])
    # the rod bends, which lengthens its period by 1e-4
    assert np.max(np.abs(q[u] - before)) < 1e-2 * 1e-4
    assert energy.error < 1e-9 * energy.largest


def pair(*starts: Any) -> sm.Scene:
    """Two strips joined along an edge."""
    shells = [
        sm.Shell(name, sm.Rectangle(L, WIDTH, origin=(x, 0, 0)), SECTION, mesh=(2, 1))
        for name, x in (("a", 0.0), ("b", L))
    ]
    return sm.Scene(
        "pair",
        shells,
        joins=sm.Join("a", "b", "right", "left"),
        supports=sm.Clamped("left", body="a"),
        scheme="ep4",
        dt=1e-3,
        t_end=2e-3,
        start=starts,
    )


def bent(x: np.ndarray) -> np.ndarray:
    """A parabola."""
    return np.array([0 * x[0], 0 * x[0], 1e-3 * x[0] ** 2])


MOVING: dict[str, Any] = {"scheme": "ep4", "dt": 0.01, "t_end": 0.01}
BAD = {
    "start from a mode: amplitude and velocity are 0; one of them must be": lambda p: sm.FromMode(),
    "start from a shape: displacement and rotation are missing": lambda p: sm.FromShape(),
    "start from a run: run is 3; it must be a run, or its directory": lambda p: sm.FromRun(3),
    "start from a mode: number is 0; it must be greater than 0": lambda p: sm.FromMode(0, 1.0),
    "start is FromMode.*; it must be left out, because scheme 'static'": lambda p: strip(
        start=sm.FromMode(1, 1.0)
    ),
    "FromRun must stand before all others": lambda p: strip(
        start=(sm.FromMode(1, 1.0), sm.FromRun(p)), **MOVING
    ),
    "a path starts from the unloaded structure": lambda p: strip(
        FORCE, path=sm.PathFollowing(), start=sm.FromRun(p)
    ),
    "there is no state .*nothing/state/state.json": lambda p: Simulation(
        strip(start=sm.FromRun("nothing"), **MOVING)
    ),
    "another mesh or model .degree was 2, is 3.; both must be the same": lambda p: Simulation(
        strip(start=sm.FromRun(p), **MOVING).with_options(degree=3)
    ),
    "it has no shell 'a'; it must have all bodies": lambda p: Simulation(pair(sm.FromRun(p))),
    "its displacements are large .scheme 'static'., those of this scene are small": lambda p: (
        Simulation(strip(scheme="linear-dynamics", dt=1.0, t_end=1.0, start=sm.FromRun(p)))
    ),
    "at is 0.123, and there is no frame; it must be one of": lambda p: Simulation(
        strip(start=sm.FromRun(p, at=0.123), **MOVING)
    ),
    "'[ab]' is 0.00.* away from what it is joined to": lambda p: Simulation(
        pair(sm.FromShape(bent, body="a"))
    ),
    "start from a shape of shell 'strip': displacement gives an array of shape": lambda p: (
        Simulation(strip(start=sm.FromShape(lambda x: x[:2]), **MOVING))
    ),
    "begins 0.25 away from the state": lambda p: Simulation(
        strip(start=sm.FromShape(lambda x: 0 * x + 0.25), **MOVING)
    ),
}


@pytest.mark.parametrize("message", BAD)
def test_bad_starts_get_a_sentence(message: str, path: tuple[Path, RunResult]) -> None:
    with pytest.raises(SceneError, match=message):
        BAD[message](path[0])


# shapes that map a strip or a rod to a line or point, or turn parts of it over, and what is left
COLLAPSED: dict[str, tuple[str, Any, Any]] = {
    "to a line": ("0 of the area", lambda x: np.array([0 * x[0], -x[1], 0 * x[0]]), None),
    "to a point": ("0 of the area", lambda x: -x, None),
    "turned over": ("-1 of the area", lambda x: np.array([-2 * x[0], 0 * x[0], 0 * x[0]]), None),
    "folded": (
        "-1 of the area",
        lambda x: np.array([np.where(x[0] > L / 2, L - 2 * x[0], 0 * x[0]), 0 * x[0], 0 * x[0]]),
        None,
    ),
    "only directors": (
        "of the area",
        None,
        lambda x: np.array([3.0 + 0 * x[0], 0 * x[0], 0 * x[0]]),
    ),
    "a rod to a point": ("0 of the length", lambda x: -x, None),
    "a rod turned over": ("-1 of the length", lambda x: -2 * x, None),
}


@pytest.mark.parametrize("case", COLLAPSED)
def test_shapes_that_collapse_are_refused(case: str) -> None:
    message, displacement, rotation = COLLAPSED[case]
    start = sm.FromShape(displacement, rotation)
    moving: dict[str, Any] = {"scheme": "ep", "dt": 0.01, "t_end": 0.01, "start": start}
    if "rod" in case:
        section = sm.RectangularSection(E=E, nu=0.3, width=H, height=H, density=1e3)
        rod = sm.Beam("rod", sm.Line((0, 0, 0), (L, 0, 0)), section, elements=4)
        scene = sm.Scene("rod", beams=rod, **moving)
    else:
        strip = sm.Shell("strip", sm.Rectangle(L, WIDTH), SECTION, mesh=(4, 1))
        scene = sm.Scene("strip", strip, **moving)
    with pytest.raises(SceneError, match=rf"start from a shape of .*: at .* {message}"):
        Simulation(scene)


def test_a_damaged_state_is_refused(path: tuple[Path, RunResult], tmp_path: Path) -> None:
    """What a start counts on has its checksum."""
    (tmp_path / "state").mkdir()
    for file in (path[0] / "state").iterdir():
        content = bytearray(file.read_bytes())
        if file.suffix == ".npz":
            content[-100] ^= 1
        (tmp_path / "state" / file.name).write_bytes(content)
    with pytest.raises(SceneError, match="is damaged"):
        Simulation(strip(start=sm.FromRun(tmp_path), **MOVING))


@pytest.mark.mpi
def test_two_ranks_start_from_a_frame_of_one(path, mpirun) -> None:  # type: ignore[no-untyped-def]
    """A mode, and a frame of a run on one rank, are the same on two ranks."""
    script = SCRIPT.format(path=str(path[0]), at=float(path[1].column("t")[-1]))
    one, two = (np.array([float(v) for v in mpirun(n, "-c", script).split()]) for n in (1, 2))
    # the Newton iterations of two ranks end apart by up to 5e-10
    np.testing.assert_allclose(two, one, rtol=1e-8)


SCRIPT = """
import shellmb as sm
from shellmb.running.execute import execute
section = sm.Isotropic(E=70e9, nu=0.0, thickness=2e-3, density=2700.0)
plate = sm.Shell("strip", sm.Rectangle(1.0, 0.25), section, mesh=(4, 1))
for start in (sm.FromRun("{path}", at={at}), sm.FromMode(2, 1e-3)):
    scene = sm.Scene("strip", plate, supports=sm.Clamped("left"), scheme="ep", dt=5e-3,
        t_end=1e-2, start=start)
    run = execute(scene, None)
    if run.simulation.model.comm.rank == 0:
        print(*run.column("strain_energy"), *run.column("kinetic_energy")[1:])
"""
