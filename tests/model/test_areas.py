"""Areas of shells: clamped, driven, or bolted to a frame, as supports hold edges."""

from dataclasses import replace
from typing import Any

from mpi4py import MPI

import numpy as np
import pytest

from shellmb.errors import SceneError, ShellmbWarning
from shellmb.meshes.mesh import build_surface
from shellmb.model.model import Model
from shellmb.running.execute import execute
from shellmb.scene import (
    GROUND,
    Beam,
    Clamped,
    Driven,
    Driver,
    EdgeForce,
    Fixed,
    GmshModel,
    Gravity,
    HardSupport,
    Hinged,
    Isotropic,
    Line,
    Output,
    PointForce,
    Probe,
    Rectangle,
    RectangularSection,
    Revolute,
    RigidBody,
    Scene,
    Shell,
    Solver,
    Weld,
)

SKIN = Isotropic(E=2e9, nu=0.3, thickness=0.01, density=1000.0)
FLANGE = {"flange": lambda x: x[0] < 0.5}
SCHEMES = [("ep", 0.0), ("ed", 0.0), ("ed", 0.5), ("ep4", 0.0), ("ed3", 0.5)]
# one of each kind every day
SLOW = [("ed", 0.0), ("ed3", 0.5)]
MARKED = [pytest.param(*s, marks=pytest.mark.slow if s in SLOW else ()) for s in SCHEMES]
CORNER = (1.5, 0.25, 0.0)


def plate(**more: Any) -> Shell:
    """A plate from x = 0 to 1.5, of which x < 0.5 is a flange."""
    given = {"mesh": (6, 1), "areas": FLANGE} | more
    return Shell("plate", Rectangle(1.5, 0.5, origin=(0, -0.25, 0)), SKIN, **given)


def loaded(shell: Shell, **more: Any) -> Scene:
    probes = [Probe(f"u{'xyz'[k]}", CORNER, component=k, body="plate") for k in range(3)]
    tip = PointForce(CORNER, (3.0, 5.0, 40.0), body="plate")
    return Scene("flange", shell, **({"loads": tip, "probes": probes, "dt": 0.5} | more))


def corner(row: Any) -> np.ndarray:
    return row[["ux", "uy", "uz"]].to_numpy(float)


@pytest.mark.parametrize("cell", ["quad", "tri"])
def test_clamped_strip_leaves_a_shorter_plate(cell) -> None:
    short = Shell(
        "plate", Rectangle(1.0, 0.5, origin=(0.5, -0.25, 0)), SKIN, mesh=(4, 1), cell=cell
    )
    expected = execute(loaded(short, supports=Clamped("left"))).history.iloc[-1]
    assert np.linalg.norm(corner(expected)) > 0.1
    held = execute(loaded(plate(cell=cell), supports=Clamped("flange"))).history.iloc[-1]
    # triangles of the longer plate lie the other way round
    assert np.allclose(corner(held), corner(expected), rtol=1e-9, atol=1e-3 * (cell == "tri"))
    welded = execute(
        loaded(
            plate(cell=cell),
            joints=Weld("bolts", GROUND, "plate", at=(0.5, 0, 0), second_at="flange"),
        )
    ).history.iloc[-1]
    assert np.allclose(corner(welded), corner(held), rtol=1e-8)
    # what the bolts carry holds the load at the tip where that is now
    force = np.array([-3.0, -5.0, -40.0])
    found = np.array([welded[f"bolts.{c}"] for c in ("F1", "F2", "F3", "M1", "M2", "M3")])
    assert np.allclose(found[:3], force, rtol=1e-8)
    arm = np.array(CORNER) + corner(welded) - (0.5, 0, 0)
    assert np.allclose(found[3:], np.cross(arm, force), rtol=1e-6)


def test_other_supports_hold_areas_too() -> None:
    """Hinges at all nodes of a strip hold it, and its directors lean: softer than a clamp."""
    shell = plate()
    tips = []
    for supports in (
        Clamped("flange"),
        Hinged("flange"),
        [Fixed("flange", (0, 0, 0))],
        [Clamped("left"), Hinged("flange")],
    ):
        tips.append(execute(loaded(shell, supports=supports)).history.iloc[-1]["uz"])
    assert tips[1] == pytest.approx(tips[2], rel=1e-9)
    assert tips[0] < tips[3] < tips[1]


def angle(t: float) -> float:
    return 4.0 * t**2


TURNING = {"dt": 0.02, "t_end": 0.2, "loads": Gravity()}


def bolted(hub: RigidBody, **more: Any) -> Scene:
    """A plate on a hub that a motor turns."""
    joints = [
        Revolute("shaft", GROUND, "hub", at=(0, 0, 0), axis=(0, 0, 1)),
        Weld("bolts", "hub", "plate", second_at="flange"),
    ]
    drivers = Driver("motor", "shaft", rotation=angle)
    given = {"rigid_bodies": hub, "joints": joints, "drivers": drivers} | TURNING
    return loaded(more.pop("shell", plate()), **(given | more))


HUB = RigidBody("hub", 2.0, (0.1, 0.1, 0.1))
FRAME = RigidBody("hub", 0.0, (0.0, 0.0, 0.0))


@pytest.mark.parametrize(("scheme", "alpha"), MARKED)
def test_driven_flange_is_one_that_is_bolted_to_a_driven_hub(scheme, alpha) -> None:
    step = {"scheme": scheme, "alpha": alpha}
    held = {"supports": Driven("flange", rotation=angle), "output": Output(end_forces=True)}
    driven = execute(loaded(plate(), **(TURNING | step | held)))
    hubs = {k: execute(bolted(hub, **step)) for k, hub in (("heavy", HUB), ("massless", FRAME))}
    for result in (driven, *hubs.values()):
        assert result.summary["energy_balance_error"] < 1e-9
        assert result.summary["linear_momentum_drift"] < 1e-9
        assert (result.summary["constraint_max"] or 0.0) < 1e-11
        # each node of the flange is where a rigid motion takes it
        body = result.simulation.model.shells["plate"]
        X = body.mixed.nodes("u")
        u = result.simulation.problem.levels["plate"].q.x.array[body.mixed.dofs["u"]].reshape(-1, 3)
        flange = X[:, 0] < 0.5 + 1e-9
        c, s = np.cos(angle(0.2)), np.sin(angle(0.2))
        turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        assert np.allclose((X + u)[flange], X[flange] @ turn.T, rtol=0, atol=1e-11)
        assert np.abs(X + u - X @ turn.T)[~flange].max() > 1e-4
        apart = corner(result.history.iloc[-1]) - corner(driven.history.iloc[-1])
        assert np.abs(apart).max() < (2e-4 if scheme == "ed" else 1e-6)
    # (ED's velocity jumps are unknown where a flange is bolted, and follow from its displacements
    # where it is driven: the difference is 4e-5 with half the step, 1e-5 with a quarter)
    # the motor turns the hub, too: its moment of inertia times 8 rad/s^2
    heavy, light = (hubs[k].history.iloc[-1]["motor.torque"] for k in ("heavy", "massless"))
    if scheme == "ep":
        # the step turns it by up to 0.03 rad, and EP by twice the tangent of half of that
        assert heavy - light == pytest.approx(0.1 * 8.0, rel=1e-3)
        last = driven.history.iloc[-1]
        # about the origin, which is the shaft
        assert light == pytest.approx(last["plate.flange.Mz"], rel=1e-3)


def test_reduced_and_full_alike_and_a_rigid_shell_as_well() -> None:
    found = {
        name: corner(execute(bolted(HUB, scheme="ep", **more)).history.iloc[-1])
        for name, more in {
            "reduced": {},
            "full": {"solver": Solver(solve="full")},
            "rigid": {"shell": plate(model="rigid")},
        }.items()
    }
    assert np.allclose(found["full"], found["reduced"], rtol=0, atol=1e-9)
    c, s = np.cos(angle(0.2)), np.sin(angle(0.2))
    turned = np.array([1.5 * c - 0.25 * s, 1.5 * s + 0.25 * c, 0.0])
    assert np.allclose(found["rigid"], turned - CORNER, rtol=0, atol=1e-10)


def test_flange_on_the_end_of_a_beam() -> None:
    """A beam carries the plate's weight through an edge of it: force, and moment at its foot."""
    section = RectangularSection(E=2e11, nu=0.3, width=0.05, height=0.05, density=1e-9)
    scene = loaded(
        plate(areas={}),
        beams=Beam("arm", Line((-1, 0, 0), (0, 0, 0)), section, elements=1),
        supports=Clamped("start", body="arm"),
        joints=Weld("bolts", "arm", "plate", at="end", second_at="left"),
        loads=Gravity(),
        scheme="linear-statics",
    )
    last = execute(scene).history.iloc[-1]
    weight = 1000.0 * 0.01 * 0.75 * 9.81
    assert last["bolts.F3"] == pytest.approx(weight, rel=1e-9)
    assert last["bolts.M2"] == pytest.approx(-0.75 * weight, rel=1e-9)


def test_elements_are_in_an_area_by_most_of_them() -> None:
    areas = {"half": lambda x: x[0] < 0.7, "end": lambda x: x[0] > 1.25}
    said = r"areas\['half'\]: its boundary runs through 2 elements; .* 0.375 in place of about 0.34"
    with pytest.warns(ShellmbWarning, match=said):
        mesh = build_surface(plate(mesh=(6, 2), areas=areas), MPI.COMM_SELF)
    # lines are at 0.5, 0.75 and 1.25
    assert len(mesh.areas["half"]) == 6
    assert len(mesh.areas["end"]) == 2


def gmsh_plate(gmsh: Any, mesh: tuple[int, int]) -> None:
    """Two squares side by side: all of it is "plate", one is "flange"."""
    occ = gmsh.model.occ
    first, second = occ.addRectangle(0, 0, 0, 1, 1), occ.addRectangle(1, 0, 0, 1, 1)
    occ.fragment([(2, first)], [(2, second)])
    occ.synchronize()
    gmsh.model.addPhysicalGroup(2, [first, second], name="plate")
    gmsh.model.addPhysicalGroup(2, [first], name="flange")
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.5)


def test_physical_groups_are_areas() -> None:
    shell = Shell("plate", GmshModel(gmsh_plate, group="plate"), SKIN, geometry_order=1)
    mesh = build_surface(shell, MPI.COMM_SELF)
    count = mesh.mesh.topology.index_map(2).size_local
    assert set(mesh.areas) == {"flange"}
    centers = mesh.mesh.geometry.x[mesh.mesh.geometry.dofmaps[0]].mean(axis=1)
    assert np.array_equal(np.sort(mesh.areas["flange"]), np.flatnonzero(centers[:, 0] < 1))
    assert 0 < len(mesh.areas["flange"]) < count
    scene = Scene(
        "plate", shell, supports=Clamped("flange"), loads=PointForce((2, 1, 0), (0, 0, 1)),
        probes=Probe("tip", (2, 1, 0)),
    )  # fmt: skip
    last = execute(scene).history.iloc[-1]
    # the same elements by where they are
    shell = replace(shell, areas={"half": lambda x: x[0] < 1})
    same = execute(replace(scene, shells=shell, supports=Clamped("half"))).history.iloc[-1]
    assert same["tip"] == pytest.approx(last["tip"], rel=1e-12) and last["tip"] > 1e-3


@pytest.mark.parametrize(("scheme", "alpha"), MARKED)
def test_massless_frame_takes_part_in_the_motion_of_a_rigid_body(scheme, alpha) -> None:
    """A pendulum whose pin is on a frame that is welded to it, and one with the pin on itself."""
    bob = RigidBody("bob", 2.0, (0.1, 0.2, 0.3), position=(0.5, 0.1, 0.2))
    more: Any = {
        "loads": Gravity(), "scheme": scheme, "alpha": alpha, "dt": 0.02, "t_end": 0.4,
        "probes": Probe("z", "center", body="bob"),
    }  # fmt: skip
    on_frame = [
        Revolute("pin", GROUND, "hub", at=(0, 0, 0), axis=(0, 1, 0)),
        Weld("glue", "hub", "bob"),
    ]
    on_itself = Revolute("pin", GROUND, "bob", at=(0, 0, 0), axis=(0, 1, 0))
    first = execute(Scene("frame", rigid_bodies=[FRAME, bob], joints=on_frame, **more))
    second = execute(Scene("pendulum", rigid_bodies=bob, joints=on_itself, **more))
    assert first.summary["energy_balance_error"] < 1e-9
    z = [run.history["z"].to_numpy() for run in (first, second)]
    assert np.allclose(*z, rtol=0, atol=1e-10) and np.ptp(z[0]) > 0.1


WRONG = {
    "shell 'plate': an area is named 'left', as one of its edges or points is": lambda: plate(
        areas={"left": lambda x: x[0] < 0.1}
    ),
    "clamped edge: shell 'plate' has no edge 'flansh'; its edges are 'left', 'right', 'bottom', "
    "'top', its areas 'flange'": lambda: loaded(plate(), supports=Clamped("flansh")),
    "hard support: shell 'plate' has no edge 'flange'": lambda: loaded(
        plate(), supports=HardSupport("flange")
    ),
    "edge force: shell 'plate' has no edge 'flange'": lambda: loaded(
        plate(), supports=Clamped("left"), loads=EdgeForce("flange", (0, 0, 1))
    ),
    "shell 'plate': areas['a'] is true on no element of the mesh, which lies in 0 to 1.5": lambda: (
        loaded(plate(areas={"a": lambda x: x[0] < 0}), supports=Clamped("left"))
    ),
    "shell 'plate': areas['a'] fails": lambda: loaded(
        plate(areas={"a": lambda x: x[3] < 0}), supports=Clamped("left")
    ),
    "weld 'bolts': shell 'plate' has no point 'rim'": lambda: bolted(HUB, joints=[
        Weld("bolts", "hub", "plate", second_at="rim")]),
    "weld 'bolts': mass is 2; it must be 0 along an edge or an area": lambda: bolted(
        HUB, scheme="ep", drivers=(),
        joints=[Weld("bolts", "hub", "plate", second_at="flange", mass=2.0)],
    ),
    "rigid body 'hub': its mass is 0; it must be greater than 0": lambda: bolted(
        FRAME, scheme="ep", drivers=(),
        joints=[Weld("bolts", "hub", "plate", at=(0, -0.25, 0), second_at="left-bottom")],
    ),
    "weld 'bolts': the directors of 'plate' have no inertia": lambda: bolted(
        HUB, scheme="ep", shell=plate(rotary_inertia=False)
    ),
}  # fmt: skip


@pytest.mark.parametrize("message", WRONG)
def test_what_cannot_be_is_refused(message) -> None:
    with pytest.raises(SceneError) as caught:
        made = WRONG[message]()
        if isinstance(made, Scene):
            Model(made, MPI.COMM_WORLD)
    assert message in str(caught.value)


def test_an_area_that_nothing_holds_costs_nothing() -> None:
    from shellmb.demos.effects.count import count
    from shellmb.simulate.simulation import Simulation

    scene = loaded(plate(), supports=Clamped("left"))
    without = replace(scene, shells=plate(areas={}))
    assert count(Simulation(scene).problem) == count(Simulation(without).problem)
