"""Hinges of edges: exact in the account, beside closed forms, rigid panels, two bodies with joints.

The kind: an angle between two directors, which a shell has no frame for, along a whole edge. So it
is compared with angles that bodies with frames have, and with the balance of moments.
"""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import shellmb as sm
from demos import latching_panel, panel_hinge, satellite
from shellmb.errors import SceneError
from shellmb.observers.account.energy import EnergyAccount
from shellmb.observers.account.momentum import Momentum
from shellmb.observers.forces.joints import JointForces
from shellmb.scene import (
    GROUND,
    Beam,
    Clamped,
    EdgeForce,
    EdgeHinge,
    Fixed,
    InitialVelocity,
    Isotropic,
    JointDamper,
    JointSpring,
    JointStop,
    Line,
    Lock,
    Modal,
    Motor,
    Rectangle,
    RectangularSection,
    RigidBody,
    Scene,
    Shell,
)
from shellmb.simulate.simulation import BaseObserver, Simulation

LENGTH, WIDTH = 0.5, 0.4
SKIN = Isotropic(E=70e9, nu=0.3, thickness=2e-3, density=2700.0)
SCHEMES = [("ep", None), ("ed", 1.0), ("ep4", None), ("ed3", 0.5)]
STIFFNESS = 2.0


def panels(kink: float = 0.7, rows: int = 1, **more: Any) -> list[Shell]:
    """Two panels that share an edge at an angle; the second has so many elements along it."""
    c, s = math.cos(kink), math.sin(kink)
    first = Shell("a", Rectangle(LENGTH, WIDTH), SKIN, mesh=(1, 1), **more)
    corner = (LENGTH, 0.0, 0.0)
    second = Rectangle(LENGTH, WIDTH, corner, axis1=(c, 0.0, s))
    return [first, Shell("b", second, SKIN, mesh=(1, rows), **more)]


def hinge(**more: Any) -> EdgeHinge:
    """The hinge between them, about +y."""
    return EdgeHinge("hinge", "a", "b", at="right", second_at="left", **more)


def free(scheme: str, alpha: float | None, rows: int = 1, **more: Any) -> Scene:
    """Two panels in free flight with a stressed spring, a damper and a stop in their hinge."""
    return Scene(
        "free",
        panels(rows=rows),
        joints=hinge(**more),
        force_elements=[
            JointSpring("spring", "hinge", STIFFNESS, rest=-1.5),
            JointDamper("damper", "hinge", 0.01),
            JointStop("stop", "hinge", lower=-0.1, stiffness=100.0, relative_damping=0.1),
        ],
        initial=InitialVelocity(linear=(0.3, 0.1, 0.0), spin=(2.0, 1.0, 3.0)),
        scheme=scheme,
        alpha=alpha,
        dt=0.01,
        t_end=0.04,
    )


@pytest.mark.parametrize(
    ("scheme", "alpha", "rows", "rigid_angle"),
    [
        ("ep", None, 2, True),
        ("ep", None, 1, False),
        ("ep4", None, 1, True),
        *(
            pytest.param(*scheme, rows, rigid, marks=pytest.mark.slow)
            for scheme in SCHEMES
            for rows in (1, 2)
            for rigid in (True, False)
        ),
    ],
)
def test_exact_in_the_account(scheme, alpha, rows, rigid_angle) -> None:
    """Energy in all schemes; momentum in EP. At nodes and between them, with one angle or many."""
    energy, forces = EnergyAccount(), JointForces()
    momentum = Momentum(energy)
    Simulation(free(scheme, alpha, rows, rigid_angle=rigid_angle)).run([energy, momentum, forces])
    values = forces.measure()
    # the stop has been hit, and so resists
    assert values["stop.torque"] < 0
    # worst seen 2e-15
    assert energy.error < 1e-13 * energy.exchanged
    sizes = {kind: np.abs(vector).max() for kind, vector in momentum.values.items()}
    assert momentum.drift["momentum"] < 1e-13 * sizes["momentum"]
    if scheme == "ep":
        assert momentum.drift["angular momentum"] < 1e-13 * sizes["angular momentum"]


def bent(
    scheme: str = "linear-statics", joint: EdgeHinge | None = None, load: float = 1.0, **more: Any
):
    """A clamped panel with another one on a sprung hinge, loaded at its end."""
    return Scene(
        "bent",
        panels(kink=0.0, **more),
        joints=joint or hinge(),
        force_elements=JointSpring("spring", "hinge", STIFFNESS),
        supports=Clamped("left", body="a"),
        loads=EdgeForce("right", (0.0, 0.0, load), body="b"),
        scheme=scheme,
    )


def rotation(scene: Scene) -> dict[str, float]:
    """What its hinge does at the end."""
    forces = JointForces()
    Simulation(scene).run([forces])
    return forces.measure()


SWAPPED = EdgeHinge("hinge", "b", "a", at="left", second_at="right", axis=(0.0, -1.0, 0.0))


@pytest.mark.parametrize(
    ("joint", "rows", "cell"),
    [
        (hinge(), 1, "quad"),
        (hinge(), 2, "quad"),
        (hinge(rigid_angle=True), 1, "quad"),
        (SWAPPED, 1, "quad"),
        (SWAPPED, 2, "quad"),
        (hinge(), 1, "tri"),
    ],
)
def test_torque_is_the_moment_of_the_load(joint, rows, cell) -> None:
    """Small displacements: the torque is F L, whatever the panels do; the angle that over k."""
    found = rotation(bent(joint=joint, rows=rows, cell=cell))
    # about +y the load turns it the other way
    angle = -WIDTH * LENGTH / STIFFNESS
    assert found["hinge.rotation"] == pytest.approx(angle, rel=1e-10)
    assert found["spring.torque"] == pytest.approx(STIFFNESS * angle, rel=1e-10)
    # the force on the second body
    assert found["hinge.F3"] == pytest.approx(-WIDTH if joint.second == "b" else WIDTH, rel=1e-10)


def test_small_loads_of_exact_panels() -> None:
    """As linear ones, to the square of the angle."""
    found = rotation(replace(bent("static", load=1e-3), dt=1.0))
    angle = -WIDTH * LENGTH / STIFFNESS * 1e-3
    assert found["hinge.rotation"] == pytest.approx(angle, rel=1e-6)


def test_supported_corners_are_no_contradiction() -> None:
    """A support at both shells' corner implies constraints there, which are left out."""
    scene = bent()
    sides = [Fixed("bottom", (None, 0.0, None), body=name) for name in ("a", "b")]
    found = rotation(replace(scene, supports=(*scene.supports, *sides)))
    angle = -WIDTH * LENGTH / STIFFNESS
    assert found["hinge.rotation"] == pytest.approx(angle, rel=1e-10)


def test_four_panels_about_a_vertex() -> None:
    """A closed loop of hinges implies some of its constraints; torques balance the load exactly."""
    places = {"a": (0, 0), "b": (1, 0), "c": (1, 1), "d": (0, 1)}
    across = [("a", "b"), ("d", "c")]
    along = [("b", "c"), ("a", "d")]
    hinges = [EdgeHinge(f"{m}{n}", m, n, at="right", second_at="left") for m, n in across]
    hinges += [EdgeHinge(f"{m}{n}", m, n, at="top", second_at="bottom") for m, n in along]
    scene = Scene(
        "vertex",
        [Shell(n, Rectangle(1, 1, (*p, 0)), SKIN, mesh=(1, 1)) for n, p in places.items()],
        joints=hinges,
        force_elements=[JointSpring(f"spring {h.name}", h.name, 5.0) for h in hinges],
        supports=Clamped("left", body="a"),
        loads=EdgeForce("right", (0, 0, 0.5), body="c"),
        scheme="linear-statics",
    )
    found = rotation(scene)
    # moments of 0.5 N at (2, 1.5) about the lines x = 1 and y = 1
    assert found["ab.rotation"] + found["dc.rotation"] == pytest.approx(-0.5 / 5.0, rel=1e-9)
    assert found["bc.rotation"] + found["ad.rotation"] == pytest.approx(0.25 / 5.0, rel=1e-9)


def spun(turns: float, model: str = "exact") -> Scene:
    """A panel that turns about its edge on the ground, uniformly as nothing acts on it."""
    steps = int(8 * turns)
    return Scene(
        "spun",
        Shell("b", Rectangle(LENGTH, WIDTH), SKIN, mesh=(1, 1), model=model),
        joints=EdgeHinge("hinge", GROUND, "b", second_at="left", rigid_angle=True),
        initial=InitialVelocity(spin=(0.0, 0.02 * math.pi, 0.0)),
        scheme="ep",
        dt=100.0 / 8,
        t_end=100.0 / 8 * steps,
    )


def test_angle_counts_turns() -> None:
    """As a rigid panel's, through one turn and a half at 8 steps a turn."""
    flexible, rigid = (rotation(spun(1.5, model))["hinge.rotation"] for model in ("exact", "rigid"))
    # under forces of 1e-4 of its stiffness in bending it is as good as rigid
    assert flexible == pytest.approx(rigid, rel=1e-4)
    # the mid-point rule turns by 2 atan(w dt / 2) a step
    step = math.pi / 4
    assert rigid == pytest.approx(12 * 2 * math.atan(step / 2), rel=1e-9)


@pytest.mark.slow
def test_rigid_panels_are_a_double_pendulum() -> None:
    """Until its first latch, which is where the demo's closed equations have it."""
    time, which = panel_hinge.rigid_latch()
    assert which == "middle"
    run = sm.run(panel_hinge.scene("rigid", dt=0.02, t_end=1.04))
    (latched,) = run.summary["events"]["middle latched"]["times"]
    # of ED3 in 50 steps; 1e-6 at half the step
    assert latched == pytest.approx(time, rel=2e-5)


@pytest.mark.slow
def test_latching_panel_in_one_object() -> None:
    """The panel that demo latching_panel welds to a shaft, on a hinge of its edge."""
    welded = latching_panel.scene(t_end=1.6)
    joint = EdgeHinge("hinge", GROUND, "panel", second_at="left", axis=(0, -1, 0), rigid_angle=True)
    hinged = replace(welded, rigid_bodies=(), joints=joint)
    times = [sm.run(s).summary["events"]["latched"]["times"][0] for s in (welded, hinged)]
    # the shaft has 1e-4 of the panel's inertia
    assert times[1] == pytest.approx(times[0], rel=2e-4)


@pytest.mark.slow
def test_satellite_in_two_bodies() -> None:
    """Panels with roots, glued, and revolute joints: hinges of edges in place of all three."""
    built = satellite.scene(t_end=3.0)
    hinges = [
        EdgeHinge(f"{n} hinge", "bus", n, second_at="left", axis=(0, -s, 0), rigid_angle=True)
        for n, s in satellite.PANELS.items()
    ]
    hinged = replace(built, beams=(), glues=(), joints=hinges, output=sm.Output())
    turns = [sm.run(s).history["turn"] for s in (built, hinged)]
    # the roots are 9 % of a panel's mass, 1e-4 of its inertia about the hinge
    apart = float(np.abs(turns[0] - turns[1]).max() / turns[0].abs().max())
    assert apart < 0.02


class Angles(BaseObserver):
    """Columns of joints after each step."""

    def __init__(self) -> None:
        self.rows: list[dict[str, float]] = []
        self._forces = JointForces()

    def start(self, simulation: Simulation) -> None:
        self._forces.start(simulation)

    def solved(self, simulation: Simulation) -> None:
        self._forces.solved(simulation)

    def accepted(self, simulation: Simulation) -> None:
        self._forces.accepted(simulation)
        self.rows.append(self._forces.measure())


def test_lock_of_each_angle() -> None:
    """Locks hold what they find at each node; the mean is by Simpson's rule along the edge."""
    scene = free("ep", None)
    scene = replace(
        scene, locks=Lock("hinge", active=(0.02, 1.0)), force_elements=scene.force_elements[:2]
    )
    seen = Angles()
    Simulation(scene).run([seen])
    rows = [[row[f"hinge.{k}.rotation"] for k in (1, 2, 3)] for row in seen.rows]
    assert rows[2] == pytest.approx(rows[1], abs=1e-13)
    assert rows[3] == pytest.approx(rows[1], abs=1e-13)
    assert np.ptp(rows[1]) > 1e-6
    for row, angles in zip(seen.rows, rows, strict=True):
        assert row["hinge.rotation"] == pytest.approx(np.dot([1, 4, 1], angles) / 6, abs=1e-14)
    assert seen.rows[1]["hinge.lock_torque"] == 0.0
    assert abs(seen.rows[3]["hinge.lock_torque"]) > 0.1


BUS = RigidBody("bus", 1.0, (1.0, 1.0, 1.0))
ROD = Beam(
    "rod",
    Line((0, 0, 0), (1, 0, 0)),
    RectangularSection(E=70e9, nu=0.3, width=0.01, height=0.01, density=2700.0),
)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"joints": {"at": "right", "mass": 1.0}}, "mass is 1"),
        ({"joints": {"at": "right", "active": (0.0, 0.1)}}, "acts always"),
        ({"joints": {"at": (0.5, 0.0, 0.0)}}, "name of an edge"),
        ({"joints": EdgeHinge("hinge", "bus", GROUND)}, "neither rigid body 'bus' nor the ground"),
        ({"joints": EdgeHinge("hinge", "a", "b", at="right")}, "second_at is missing"),
        ({"joints": EdgeHinge("hinge", "a", "b", at="right", second_at="lft")}, "no edge 'lft'"),
        ({"joints": EdgeHinge("hinge", "bus", "b", at="center", second_at="left")}, "left out"),
        (
            {"joints": EdgeHinge("hinge", "rod", "b", second_at="left"), "beams": ROD},
            "is beam 'rod'",
        ),
        (
            {
                "joints": hinge(),
                "force_elements": Motor("motor", "hinge", lambda x, v, t: 0.0 * x + 1.0),
            },
            "must have rigid_angle=True",
        ),
    ],
)
def test_refused(change, said) -> None:
    """Bad hinges, each by a sentence before DOLFINx is loaded."""
    given = {"rigid_bodies": BUS, "scheme": "ep", "dt": 0.01, "t_end": 0.1, "shells": panels()}
    with pytest.raises(SceneError, match=said):
        if isinstance(change["joints"], dict):
            EdgeHinge("hinge", "a", "bus", **change["joints"])
        Scene("bad", **(given | change))


# edges that move as frames: of bodies in modes, and of rigid ones
MODES = Modal(modes=2)
FRAMED = [
    (MODES, "exact"),
    (MODES, MODES),
    ("exact", MODES),
    (MODES, "rigid"),
    ("rigid", MODES),
    ("floating-frame", MODES),
]


def modelled(scene: Scene, models: tuple[Any, Any]) -> Scene:
    """The scene with other models of both panels."""
    shells = zip(scene.shells, models, strict=True)
    return replace(scene, shells=tuple(replace(s, model=m) for s, m in shells))


@pytest.mark.parametrize(
    ("models", "scheme"),
    [
        (FRAMED[0], SCHEMES[0]),
        *(
            pytest.param(models, scheme, marks=pytest.mark.slow)
            for models in FRAMED
            for scheme in SCHEMES
        ),
    ],
)
def test_bodies_in_modes_exact_in_the_account(models, scheme) -> None:
    """Energy in all schemes, both momenta in EP, with frames at one edge or at both."""
    energy = EnergyAccount()
    momentum = Momentum(energy)
    scene = modelled(free(*scheme, rigid_angle=True), models)
    Simulation(scene).run([energy, momentum])
    # worst seen 2e-15
    assert energy.error < 1e-13 * energy.exchanged
    sizes = {kind: np.abs(vector).max() for kind, vector in momentum.values.items()}
    assert momentum.drift["momentum"] < 1e-13 * sizes["momentum"]
    if scheme[0] == "ep":
        assert momentum.drift["angular momentum"] < 1e-13 * sizes["angular momentum"]


@pytest.mark.parametrize(
    ("models", "joint"),
    [
        ((MODES, MODES), SWAPPED),
        *(
            pytest.param(models, joint, marks=pytest.mark.slow)
            for models in [("exact", MODES), (MODES, "exact"), (MODES, "floating-frame")]
            for joint in (hinge(), SWAPPED)
        ),
    ],
)
def test_bodies_in_modes_bend_as_exact_ones(models, joint) -> None:
    """Where edges stay straight (without Poisson's ratio) frames at them change nothing."""
    skin = replace(SKIN, nu=0.0)
    scene = replace(bent("static", joint, load=1e-3), dt=1.0)
    scene = replace(
        scene,
        shells=tuple(replace(s, section=skin) for s in scene.shells),
        probes=sm.Probe("tip", "right-top", component=2, body="b"),
    )
    exact = sm.run(scene).history.iloc[-1]
    found = sm.run(modelled(scene, models)).history.iloc[-1]
    # both are wrong by squares of rotations of 1e-4
    assert found["hinge.rotation"] == pytest.approx(exact["hinge.rotation"], rel=1e-7)
    assert found["tip"] == pytest.approx(exact["tip"], rel=1e-7)
    # along the scene's axes, whatever the models are
    assert found["hinge.F3"] == pytest.approx(exact["hinge.F3"], rel=1e-7)


@pytest.mark.slow
def test_bodies_in_modes_swing_as_exact_ones() -> None:
    """A panel in modes on a rigid one swings through a large angle as an exact one does.

    The spring turns the panels by 0.6 rad in a time of many of their own periods.
    """
    scene = free("ep4", None, rigid_angle=True)
    spring = JointSpring("spring", "hinge", 0.02, rest=-1.5)
    spin = InitialVelocity(spin=(0.0, 0.5, 0.0))
    scene = replace(scene, force_elements=spring, initial=spin, dt=0.05, t_end=1.0)
    turned = [
        rotation(modelled(scene, ("rigid", model)))["hinge.rotation"] for model in ("exact", MODES)
    ]
    assert abs(turned[0]) > 0.5
    assert turned[1] == pytest.approx(turned[0], rel=1e-4)


@pytest.mark.parametrize("models", [("rigid", "rigid"), ("rigid", "exact"), (MODES, MODES)])
def test_edges_of_frames_apart(models) -> None:
    """Frames would hold edges together over any distance. Kind: edges that a frame forgets."""
    scene = modelled(free("ep", None), models)
    apart = Rectangle(LENGTH, WIDTH, (LENGTH + 0.1, 0.0, 0.0))
    scene = replace(scene, shells=(scene.shells[0], replace(scene.shells[1], surface=apart)))
    with pytest.raises(SceneError, match=r"0\.1 away from the edge of shell 'a'"):
        Simulation(scene)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"second_at": "top"}, "are not parallel"),
        ({"axis": (1.0, 0.0, 0.0)}, "must be along the edge"),
    ],
)
def test_edges_that_do_not_fit(change, said) -> None:
    """What only the meshes tell."""
    scene = bent(joint=replace(hinge(), **change))
    with pytest.raises(SceneError, match=said):
        Simulation(scene)


@pytest.mark.slow
@pytest.mark.parametrize("rows", [1, 2])
def test_start_from_a_frame_far_turned(rows, tmp_path) -> None:
    """Vectors of the hinge follow from the bodies, also where these have turned far."""
    output = sm.Output(fields=("director", "velocity", "director_velocity"), frames=21)
    spring = JointSpring("spring", "hinge", 1.0, rest=-2.5)
    scene = replace(
        free("ep", None, rows), force_elements=spring, dt=0.02, t_end=0.4, output=output
    )
    whole = sm.run(scene, tmp_path / "whole", pictures=False).history
    start = sm.FromRun(tmp_path / "whole", at=float(whole["t"][14]))
    assert abs(whole["hinge.rotation"][14]) > 2.0
    rest = replace(scene, start=start, t_end=0.12, initial=(), output=sm.Output())
    # velocities at the end of a step of EP violate constraints a little, and are made consistent
    with pytest.warns(sm.ShellmbWarning, match="do not allow the velocities"):
        found = sm.run(rest).history["hinge.rotation"]
    assert found.iloc[-1] == pytest.approx(whole["hinge.rotation"].iloc[-1], rel=1e-5)
