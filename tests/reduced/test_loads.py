"""Distributed loads on bodies in modes: against the exact ones, and what they do to momenta."""

from dataclasses import replace
from functools import partial
from typing import Any

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import numpy as np
import pytest

from shellmb.running.execute import RunResult, execute
from shellmb.running.natural_modes.vibration import natural_modes
from shellmb.scene import (
    Beam,
    Clamped,
    EdgeForce,
    EdgeMoment,
    FollowerEdgeForce,
    FollowerLineForce,
    FollowerSurfaceForce,
    Gravity,
    InitialVelocity,
    Isotropic,
    Join,
    Line,
    LineForce,
    LineMoment,
    Modal,
    PointForce,
    Pressure,
    Probe,
    Rectangle,
    RectangularSection,
    RigidBody,
    Scene,
    Shell,
    Spherical,
    SurfaceForce,
    Weld,
)
from tests import scenes

PLATE = Isotropic(E=70e9, nu=0.3, thickness=5e-3, density=2700.0)
BAR = RectangularSection(E=70e9, nu=0.3, width=0.01, height=0.02, density=2700.0)
ROOT = (0.1, 0.0, 0.0)
APART = 1e-4
SLOW = pytest.mark.slow
SCHEMES = [
    ("ep", 0.0),
    *(pytest.param(*pair, marks=SLOW) for pair in (("ed", 1.0), ("ep4", 0.0), ("ed3", 0.5))),
]


plate = partial(scenes.plate, PLATE, (1.0, 0.4), mesh=(4, 2))


def test_forces_at_two_points_of_a_body_need_no_names() -> None:
    """A frame is made for each, named after the force."""

    def tip(model: Any) -> float:
        forces = PointForce((1.0, 0.4, 0.0), (0, 0, 0.5)), PointForce((1.0, 0.0, 0.0), (0, 0, 0.3))
        scene = Scene(
            "two",
            plate(model=model),
            supports=Clamped("left"),
            loads=forces,
            probes=Probe("tip", (1.0, 0.4, 0.0), component=2),
            scheme="static",
        )
        return float(execute(scene).history.tip.iloc[-1])

    # a deflection of a thousandth: squares of rotations are smaller
    assert tip(Modal(modes=2)) == pytest.approx(tip("exact"), rel=1e-4)


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_loads_give_a_free_body_their_impulses(scheme, alpha) -> None:
    """A dead force, a pressure that turns with the body, and a moment, as it tumbles."""
    force, area = np.array([3.0, 2.0, -8.0]), 0.4

    def moved(modes: int, *loads: Any) -> RunResult:
        spin = InitialVelocity((1.0, 0, 0), (3.0, 1.0, 2.0))
        times = {"scheme": scheme, "alpha": alpha, "dt": 5e-3, "t_end": 0.1}
        return execute(
            Scene("free", plate(model=Modal(modes=modes)), initial=spin, loads=loads, **times)
        )

    # the kernels are those of `test_reduced`: seven modes, six of them of the loads
    every = EdgeForce("right", tuple(force)), Pressure(20.0), EdgeMoment("top", (0, 1, 2.0))
    pushed = moved(1, *every)
    assert pushed.summary["energy_balance_error"] < 1e-12
    assert pushed.summary["linear_momentum_drift"] < 1e-12
    # EP counts moments as its rows see them; ED, EP4 and ED3 to their order
    bound = {"ep": 1e-12, "ed": 1e-3, "ep4": 1e-5, "ed3": 1e-5}[scheme]
    assert pushed.summary["angular_momentum_drift"] < bound
    # of a dead force alone the impulse is known
    history = moved(4, SurfaceForce(tuple(force))).history
    gained = [history[f"momentum_{k}"].iloc[[0, -1]].diff().iloc[-1] for k in "xyz"]
    assert np.allclose(gained, 0.1 * area * force, rtol=1e-9)


def test_a_pressure_stays_across_what_it_bends() -> None:
    """So a cantilever's root feels some of it along its length: its part `integral p w'`.

    The pressure is along the normal `(-w', 1)`, on an area that bending does not change.
    """
    scene = Scene(
        "bent",
        plate(model=Modal(modes=6)),
        supports=Clamped("left"),
        loads=Pressure(30.0),
        probes=Probe("tip", (1.0, 0.2, 0.0)),
        scheme="static",
        dt=1.0,
    )
    last = execute(scene).history.iloc[-1]
    across, along = last["plate.left.F3"], last["plate.left.F1"]
    # the square of the slopes
    assert across == pytest.approx(-30.0 * 0.4, rel=1e-4)
    # of the middle line: edges bend a little differently
    assert along == pytest.approx(30.0 * 0.4 * last["tip"], rel=2e-2)


def test_a_load_on_a_place_that_is_held_bends_nothing() -> None:
    """It adds no mode: round-off that is made as large as one would be a wild one."""
    scene = Scene(
        "held",
        plate(model=Modal(modes=6)),
        supports=Clamped("left"),
        scheme="ep",
        dt=1.0,
        t_end=1.0,
    )

    def modal(load: Any) -> Any:
        (data,) = natural_modes(replace(scene, loads=load), count=1).model.modal
        return data

    there, at_tip = (modal(EdgeForce(edge, (1.0, 2.0, 3.0))) for edge in ("left", "right"))
    assert there.count == 6
    # one for each way that the body may be turned
    assert at_tip.count == 6 + 3
    assert at_tip.clamped == pytest.approx(there.clamped, rel=1e-3)


ON_SHELLS = {
    "edge": EdgeForce("right", (30.0, 20.0, -5.0)),
    "surface": SurfaceForce(lambda x: np.stack([20 * x[1], 10 * x[0], -15 * x[0] * x[1]])),
    "pressure": Pressure(lambda x: 40 * x[0]),
    "turning surface": FollowerSurfaceForce((5.0, 3.0, -10.0)),
    "turning edge": FollowerEdgeForce("right", (5.0, 2.0, -8.0)),
    "moment": EdgeMoment("right", (0.5, 3.0, 0.0)),
    "moments": EdgeMoment("right", lambda x: np.stack([0 * x[0], 5 + 5 * x[1], 0 * x[1]])),
}


def on_a_hub(body: dict[str, Any], load: Any, tip: tuple[float, float, float]) -> RunResult:
    probes = [Probe(f"x{k}", tip, "position", k, body="body") for k in range(3)]
    scene = Scene(
        "swinging",
        **body,
        rigid_bodies=RigidBody("hub", 1.0, (2e-2, 2e-2, 2e-2)),
        joints=[
            Spherical("shaft", "ground", "hub", at=(0, 0, 0)),
            Weld("bolts", "hub", "body", second_at="left" if "shells" in body else None, at=ROOT),
        ],
        loads=load,
        probes=probes,
        scheme="ep4",
        dt=5e-3,
        t_end=0.25,
    )
    return execute(scene)


def compared(make: Any, load: Any, tip: tuple[float, float, float]) -> tuple[float, float, float]:
    """How far the tip moves, how far apart it is, and the ratio of the works of the load."""
    exact, modal = (on_a_hub(make(m), load, tip) for m in ("exact", Modal(modes=6)))
    names = [f"x{k}" for k in range(3)]
    x = exact.history[names]
    apart = np.abs(x - modal.history[names]).to_numpy().max()
    print(apart)
    one, other = (run.history["work_loads"].iloc[-1] for run in (exact, modal))
    assert modal.summary["energy_balance_error"] < 1e-12
    return float(np.abs(x - x.iloc[0]).to_numpy().max()), float(apart), other / one


@SLOW
@pytest.mark.parametrize("name", ON_SHELLS)
def test_moves_as_the_full_shell_does(name) -> None:
    def make(model: Any) -> dict[str, Any]:
        surface = Rectangle(1.0, 0.4, (0.1, -0.2, 0.0))
        return {"shells": Shell("body", surface, PLATE, mesh=(4, 2), model=model)}

    moved, apart, work = compared(make, ON_SHELLS[name], (1.1, 0.2, 0.0))
    assert moved > 2e-3
    # the square of the rotations
    assert apart < APART
    # a moment that is there at once shakes more modes than six
    assert work == pytest.approx(1.0, rel=5e-2 if name.startswith("moment") else 1e-3)


ON_BEAMS = {
    "dead": LineForce((0.5, 0.4, -2.0)),
    "turning": FollowerLineForce((0.5, 0.4, -2.0)),
    "moment": LineMoment((1.0, 1.0, 0.2)),
    "weight": Gravity((0.0, 3.0, -9.81), body="body"),
}


@SLOW
@pytest.mark.parametrize("name", ON_BEAMS)
def test_moves_as_the_full_beam_does(name) -> None:
    def make(model: Any) -> dict[str, Any]:
        line = Line(ROOT, (1.1, 0, 0))
        return {"beams": Beam("body", line, BAR, elements=6, model=model)}

    moved, apart, work = compared(make, ON_BEAMS[name], (1.1, 0.0, 0.0))
    assert moved > 2e-3
    assert apart < APART
    # a moment that is there at once shakes more modes than six
    assert work == pytest.approx(1.0, rel=5e-2 if name.startswith("moment") else 1e-3)


@SLOW
def test_weight_of_a_part_of_a_body() -> None:
    """Of one of two plates that are joined at an angle: it turns what it bends."""

    def make(model: Any) -> dict[str, Any]:
        first = Shell("body", Rectangle(1.0, 0.4, (0.1, -0.2, 0.0)), PLATE, mesh=(4, 2))
        second = Rectangle(1.0, 0.2, (0.1, 0.2, 0.0), axis2=(0, 0, 1))
        shells = (first, Shell("flange", second, PLATE, mesh=(4, 1)))
        shells = tuple(replace(s, model=model) for s in shells)
        return {"shells": shells, "joins": Join("body", "flange", "top", "bottom")}

    moved, apart, work = compared(make, Gravity(body="flange"), (1.1, 0.2, 0.0))
    assert moved > 2e-3
    assert apart < APART
    assert work == pytest.approx(1.0, rel=1e-3)
