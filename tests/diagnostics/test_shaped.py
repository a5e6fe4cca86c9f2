"""Kind: bodies in motion, with joints, or on points, beside the same under loads of their shape.

True are differences of statics from finer meshes, in per cent; RIGHT is below two (`shellmb verify
--case "elements/*"`: cantilever, straight beam out of plane, two pins, point force).
"""

import json
from dataclasses import replace
from time import process_time
from typing import Any

from mpi4py import MPI

import numpy as np
import pytest

import shellmb as sm
from shellmb.demos.verification.problems.elements.rows import Mesh
from shellmb.diagnostics.elements import coarse
from shellmb.diagnostics.elements.coarse import Coarse
from shellmb.diagnostics.elements.finer import compared
from shellmb.errors import Stopped
from shellmb.observers.fields.nodal import state
from shellmb.running.execute import execute
from shellmb.running.saved import read_saved
from shellmb.scene import Scene
from shellmb.simulate.simulation import BaseObserver, Simulation
from tests.diagnostics.test_coarse import tube
from tests.diagnostics.test_edges import plain, strip
from tests.diagnostics.test_estimates import AROUND, plate
from tests.diagnostics.test_locked import hanging

RIGHT = 0.0
STRIP = sm.Rectangle(1.0, 0.1)
ACROSS = sm.EdgeForce("right", (0.0, 0.0, 1e-7))


def moving(scene: Scene, dt: float = 5.0, steps: int = 20) -> Scene:
    """The scene in time."""
    return replace(scene, scheme="ep", dt=dt, t_end=steps * dt, probes=())


def beam(cell: Any, **more: Any) -> Scene:
    """A strip that bends in motion."""
    shell = sm.Shell("strip", STRIP, plain(1e-2), (6, 1), cell=cell)
    return Scene("beam", shell, **{"scheme": "ep", "dt": 5.0, "t_end": 200.0, **more})


def halves(cell: Any, load: sm.EdgeForce) -> Scene:
    """That strip of two pieces that are joined, which turn as one."""
    whole = beam(cell, loads=load)
    pieces = [
        replace(whole.shells[0], name=name, surface=replace(STRIP, length=0.5, origin=(x, 0, 0)))
        for name, x in (("inner", 0.0), ("outer", 0.5))
    ]
    pieces = [replace(piece, mesh=(3, 1)) for piece in pieces]
    join = sm.Join("inner", "outer", at="right", second_at="left")
    loads = replace(load, body="outer")
    return replace(whole, shells=pieces, joins=join, loads=loads)


def arm(cell: Any, name: str, section: sm.Isotropic, load: Any) -> Scene:
    """A strip on a hinge at the end of another one, which bends far more than it."""
    bends, surface = beam(cell, supports=sm.Clamped("left", body="strip")), replace(STRIP)
    far = sm.Shell(name, replace(surface, origin=(1.0, 0.0, 0.0)), section, (6, 1), cell=cell)
    return replace(
        bends,
        shells=(*bends.shells, far),
        joints=sm.EdgeHinge("hinge", "strip", name, at="right", second_at="left"),
        loads=(sm.SurfaceForce((0.0, 0.0, 1e-6), body="strip"), load),
        t_end=100.0,
    )


def wing(times: int) -> Scene:
    """A clamped panel, and a flap that a spring swings out, nearly rigid."""
    skin = sm.Isotropic(E=70e9, nu=0.3, thickness=2e-3, density=2700)
    panel, flap = sm.Rectangle(0.5, 0.3), sm.Rectangle(0.3, 0.3, origin=(0.5, 0, 0))
    return Scene(
        "wing",
        [
            sm.Shell("panel", panel, skin, mesh=(2 * times, times)),
            sm.Shell("flap", flap, skin, mesh=(2 * times, 2 * times)),
        ],
        supports=sm.Clamped("left", body="panel"),
        joints=sm.EdgeHinge("hinge", "panel", "flap", at="right", second_at="left"),
        force_elements=sm.JointSpring("spring", "hinge", 2.0, rest=1.75),
        scheme="ed3",
        dt=0.005,
        t_end=0.05,
    )


def sheet(cell: Any, supports: Any, load: Any) -> Scene:
    """A sheet of 2x1 in its plane."""
    shell = sm.Shell("sheet", sm.Rectangle(2.0, 1.0), plain(1e-3), (8, 4), cell=cell)
    return Scene("sheet", shell, supports=supports, loads=load, scheme="linear-statics")


PINS = (
    sm.Fixed("left-bottom", (0.0, 0.0, 0.0)),
    sm.Fixed("right-bottom", (None, 0.0, 0.0)),
    sm.Fixed("left-top", (None, None, 0.0)),
)
DOWN = sm.EdgeForce("top", (0.0, -1e-9, 0.0))
CORNER = sm.PointForce((2.0, 0.5, 0.0), (0.0, 1e-9, 0.0))
TWIST = sm.SurfaceForce(
    lambda x: np.stack([0 * x[0], 0 * x[0], 1e-5 * (x[1] - 0.05) * (x[0] - 1.5)]), body="light"
)
HINGE = sm.EdgeHinge("hinge", sm.GROUND, "strip", second_at="left")
KICK = sm.EdgeForce("right", (0.0, 0.0, 1e-6), time=lambda t: float(t < 3))
DRIVEN = sm.Driven(AROUND, rotation=lambda t: 1e-5 * t)
PUSH = sm.SurfaceForce((0.0, 0.0, 1e-8))
WEIGHT = sm.Gravity((0.0, 0.0, -1e-6))


def scenes(cell: Any) -> dict[str, tuple[Scene, float]]:
    """By name the scene, and what is true."""
    quad = cell == "quad"
    swings = {"joints": HINGE, "loads": WEIGHT, "dt": 20.0, "t_end": 1000.0}
    return {
        "twisted in motion": (moving(strip(cell, (6, 1), plain(1e-2))), 5.3 if quad else 6.7),
        "bent in motion": (beam(cell, supports=sm.Clamped("left"), loads=ACROSS), RIGHT),
        "flies": (beam(cell, loads=KICK), RIGHT),
        "flies in two pieces": (halves(cell, KICK), RIGHT),
        "swings on a hinge": (beam(cell, **swings), RIGHT),
        "plate in motion": (moving(plate(cell, 4, plain(1e-2)), 10.0), RIGHT if quad else 6.3),
        "driven plate": (
            replace(moving(plate(cell, 4, plain(1e-2)), 10.0), supports=DRIVEN, loads=PUSH),
            RIGHT if quad else 6.3,
        ),
        "driven strip": (
            beam(cell, supports=sm.Driven("left", rotation=lambda t: 1e-3 * t), loads=ACROSS),
            RIGHT,
        ),
        "driven hypar": (
            replace(
                hanging(1e-3, 8, 0.25, cell=cell),
                scheme="static",
                supports=sm.Driven("left", rotation=lambda t: 0.2 * t),
                probes=(),
            ),
            22.0 if quad else 6.4,
        ),
        "tube in motion": (
            moving(tube(Mesh(cell, (4, 4)), 2e-2, sm.Pressure(4e-7))),
            6.8 if quad else 20.6,
        ),
        "twisted beside what bends": (
            arm(cell, "light", sm.Isotropic(1.0, 0.3, thickness=1e-2, density=1e-3), TWIST),
            5.1 if quad else 6.7,
        ),
        "two pins": (sheet(cell, PINS, DOWN), RIGHT),
        "point force": (sheet(cell, sm.Clamped("left"), CORNER), RIGHT),
    }


@pytest.mark.parametrize("cell", ["quad", "tri"])
@pytest.mark.parametrize("name", scenes("quad"))
def test_within_a_factor_of_two(name: str, cell: Any) -> None:
    """From two per cent on, and nothing is said of what is right."""
    scene, true = scenes(cell)[name]
    simulation, watch = Simulation(scene), Coarse(None)  # type: ignore[arg-type]
    simulation.run([watch])
    start = process_time()
    said = sum(100 * (c.value or 0.0) for c in watch.cautions(simulation))
    print(f"{name}, {cell}: {said:.1f} %, true {true} %, in {process_time() - start:.1f} s")
    assert true / 2 < said < 2 * true if true > 2 else said == 0.0


def test_what_flies_is_off_by_its_own_deformation() -> None:
    """Not by that which its neighbour has in its place, beside which it was off by 97 %.

    Over ten steps its energy is 3.6 % more than on elements that are a quarter as wide, on those
    that are half as wide 0.4 %.
    """
    said = []
    for times in (1, 2):
        simulation, watch = Simulation(wing(times)), Coarse(None)  # type: ignore[arg-type]
        simulation.run([watch])
        said.append(list(watch.cautions(simulation)))
    (caution,), nothing = said
    assert not nothing
    assert caution.body == "flap" and 0.018 < (caution.value or 0.0) < 0.072
    assert "5 % of its deformation, of up to 0.00033 m" in caution.says


def test_what_moves_rigidly_has_no_error() -> None:
    """Its energy is round-off, on better elements as well."""
    (shell,) = tube(Mesh("tri", (4, 4)), 2e-2, sm.Pressure(4e-7)).shells
    down = sm.Fixed(("left", "right"), (0.0, 0.0, lambda t: 1e-3 * t), (0.0, 0.0, 0.0))
    scene = Scene("tube", shell, supports=down, scheme="static")
    simulation, watch = Simulation(scene), Coarse(None)  # type: ignore[arg-type]
    simulation.run([watch])
    assert not list(watch.cautions(simulation))


def test_what_rolls_is_no_linear_scene() -> None:
    """Jumps of resultants tell there, and the run ends as any other."""
    scene = moving(tube(Mesh("quad", (4, 4)), 2e-2, sm.Pressure(4e-7)), steps=4)
    wheel = sm.RigidBody("wheel", 1.0, (1.0, 1.0, 1.0), position=(5.0, 0.0, 1.0))
    road = {"at": (5.0, 0.0, 0.0), "normal": (0, 0, 1), "axis": (0, 1, 0), "radius": 1.0}
    rolls = sm.Rolling("rolls", sm.GROUND, "wheel", **road)
    scene = replace(scene, rigid_bodies=wheel, joints=rolls)
    with pytest.raises(sm.SceneError):
        scene.with_options(scheme="linear-statics", dt=scene.t_end)
    simulation, watch = Simulation(scene), Coarse(None)  # type: ignore[arg-type]
    simulation.run([watch])
    assert not compared(simulation, {"shell": state(simulation, "shell")}, ["shell"])
    assert all("jumps of resultants" in caution.says for caution in watch.cautions(simulation))


def test_a_path_that_a_support_drives_far_ends_as_any_other() -> None:
    """With the support held there is no path to follow, and nothing to compare in that way."""
    shells = strip("quad", (4, 1), plain(2e-3)).shells
    ends = sm.Clamped("left"), sm.Driven("right", axis=(1, 0, 0), rotation=lambda f: 1.2 * f)
    path = {"scheme": "static", "path": sm.PathFollowing(), "dt": 0.25}
    simulation = Simulation(Scene("twisted", shells, supports=ends, **path))
    simulation.run([])
    compared(simulation, {"strip": state(simulation, "strip")}, ["strip"])


class Stop(BaseObserver):
    """Stops behind a step."""

    def accepted(self, simulation: Simulation) -> None:
        """Stop behind step 40."""
        if simulation.step == 40:
            raise Stopped(15)


def test_what_was_stopped_is_not_compared(monkeypatch, tmp_path) -> None:
    """A second signal in the meantime would lose the summary."""
    scene = moving(strip("quad", (6, 1), plain(1e-2)), steps=60)
    monkeypatch.setattr(coarse, "compared", lambda *given: pytest.fail("it is compared"))
    with pytest.raises(Stopped):
        execute(scene, tmp_path / "run", [Stop()], pictures=False)
    assert json.loads((tmp_path / "run" / "summary.json").read_text())["steps"] == 40


def test_a_run_that_goes_on_warns_as_a_whole_one(tmp_path) -> None:
    """It was deformed most before it was stopped."""
    scene = moving(strip("quad", (6, 1), plain(1e-2)), steps=60)
    let_go = [replace(load, time=lambda t: float(t < 50)) for load in scene.loads]
    scene = replace(scene, scheme="ed", alpha=0.5, loads=let_go)
    whole = execute(scene)
    with pytest.raises(Stopped):
        execute(scene, tmp_path / "run", [Stop()], pictures=False)
    saved = read_saved(tmp_path / "run", MPI.COMM_WORLD)
    rest = execute(scene, tmp_path / "run", pictures=False, saved=saved, new=False)
    found = [[w.value for w in r.warnings if w.watch == "coarse mesh"] for r in (whole, rest)]
    assert found[0] == found[1] and len(found[0]) == 1


def test_round_off_is_not_compared() -> None:
    """A strip that falls flat bends by round-off alone: it was said to be off by 21 %."""
    flat = sm.Rectangle(0.6, 0.05, origin=(-0.3, 0.0, 0.11))
    steel = sm.Isotropic(E=70e9, nu=0.3, thickness=5e-4, density=2700.0)
    scene = Scene(
        "strip",
        sm.Shell("strip", flat, steel, mesh=(8, 1)),
        loads=sm.Gravity(),
        initial=sm.InitialVelocity(linear=(0, 0, -1.5)),
        contacts=sm.Contact("ground", sm.Plane(), stiffness=1e9, smoothing=1e-4),
        scheme="ed3",
        dt=4e-3,
        t_end=0.12,
    )
    run = sm.run(scene, pictures=False)
    assert run.history["strain_energy"].max() < 1e-20
    assert "coarse mesh" not in {w["watch"] for w in run.summary["warnings"]}
