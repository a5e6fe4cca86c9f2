"""Starts from states of other runs, far from the reference configuration and in several units.

The kind: something that acts at the start and that the state does not know, or units that a bound
is written in. Heat, ground, a spring and a load act at once, on a plate that they bend far.
"""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from shellmb.running.execute import execute
from shellmb.scene import (
    Clamped,
    Contact,
    EdgeForce,
    FromMode,
    FromRun,
    Gravity,
    Isotropic,
    NaturalStrain,
    Output,
    PathFollowing,
    Plane,
    PointForce,
    Rectangle,
    Scene,
    Shell,
    Solver,
)
from shellmb.simulate.simulation import BaseObserver, Simulation
from tests.hard.conftest import EVERY


class Units(NamedTuple):
    """Numbers of a metre, a kilogram and a second."""

    length: float = 1.0
    mass: float = 1.0
    time: float = 1.0

    def __call__(self, value: float, length: int = 0, mass: int = 0, time: int = 0) -> float:
        """Number of a value in these units."""
        return value * self.length**length * self.mass**mass * self.time**time


SI, SMALL = Units(), Units(1e3, 1e6, 1e-3)
# lowest period of the plate 30 s, in flight; on the ground it is a fifth of that
STEP, STEPS = 3.0, 10


def loaded(unit: Units, scheme: str, alpha: float | None = None, **more: Any) -> Scene:
    """A heated plate that its weight and a force press on soft ground."""
    stress = {"length": -1, "mass": 1, "time": -2}
    section = Isotropic(
        E=unit(1.0, **stress),
        nu=0.3,
        thickness=unit(0.05, length=1),
        density=unit(1.0, length=-3, mass=1),
    )
    bent = tuple(unit(k, length=-1) for k in (0.3, -0.2, 0.1))
    surface = Rectangle(unit(1.0, length=1), unit(0.5, length=1))
    ground = Contact(
        "ground",
        Plane((0.0, 0.0, unit(-0.1, length=1))),
        stiffness=unit(0.05, length=-2, mass=1, time=-2),
        smoothing=unit(1e-3, length=1),
    )
    force = {"length": 1, "mass": 1, "time": -2}
    return Scene(
        "loaded",
        Shell(
            "plate",
            surface,
            section,
            mesh=(2, 1),
            natural=NaturalStrain((0.02, 0.01, 0.01), bent),
        ),
        supports=Clamped("left"),
        loads=[
            Gravity((0.0, 0.0, unit(-1e-4, length=1, time=-2))),
            EdgeForce("right", (unit(-2e-6, mass=1, time=-2), 0.0, unit(-1e-5, mass=1, time=-2))),
            PointForce("right-top", (0.0, unit(1e-6, **force), unit(-2e-6, **force))),
        ],
        contacts=ground,
        scheme=scheme,
        alpha=alpha,
        solver=Solver(tolerance=1e-12),
        **more,
    )


def moving(unit: Units, **more: Any) -> dict[str, Any]:
    """Steps of a motion."""
    dt = unit(STEP, time=1)
    return {"dt": dt, "t_end": STEPS * dt, **more}


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> dict[Units, Path]:
    """Ends of static paths in both units."""
    found = {}
    for unit in (SI, SMALL):
        found[unit] = tmp_path_factory.mktemp("path") / "run"
        follow = PathFollowing(load_end=1.0)
        # the least of them, too: the path turns where the ground is met
        scene = loaded(unit, "static", path=follow, dt=0.05, t_end=50.0)
        execute(scene, found[unit], pictures=False)
    return found


def places(simulation: Simulation) -> np.ndarray:
    """Displacements of the plate over its length."""
    body = simulation.model.shells["plate"].mixed.dofs["u"]
    size = simulation.model.length
    return np.asarray(simulation.problem.state("plate").x.array[body.ravel()] / size)


class Farthest(BaseObserver):
    """Largest displacement from the start, over the length."""

    most = 0.0

    def start(self, simulation: Simulation) -> None:
        self._first = places(simulation)

    def accepted(self, simulation: Simulation) -> None:
        self.most = max(self.most, float(np.abs(places(simulation) - self._first).max()))


@pytest.mark.parametrize("unit", [SI, SMALL], ids=["SI", "small units"])
@pytest.mark.parametrize(("scheme", "alpha"), EVERY)
def test_bent_by_heat_and_ground_it_stays_at_rest(scheme, alpha, unit, path, watch, worst) -> None:
    """The end of a path under its loads, in steps of half a period."""
    seen = Farthest()
    scene = loaded(unit, scheme, alpha, **moving(unit), start=FromRun(path[unit]))
    watched = watch(scene, seen)
    # it is bent by a tenth of its length, and lies on the ground
    assert watched.energy.values["ground.energy"] > 0
    assert np.abs(places(watched.simulation)).max() > 0.05
    worst("motion, of the length", seen.most, 1e-12)
    watched.check(worst)


@pytest.mark.parametrize("unit", [SI, SMALL], ids=["SI", "small units"])
@pytest.mark.parametrize(("scheme", "alpha"), EVERY)
def test_a_mode_about_a_loaded_state(scheme, alpha, unit, path, watch, worst) -> None:
    """A mode of a tenth of the length throws the plate off the ground and back onto it."""
    mode = FromMode(1, unit(0.1, length=1))
    start = (FromRun(path[unit]), mode)
    seen = Farthest()
    watched = watch(loaded(unit, scheme, alpha, **moving(unit), start=start), seen)
    assert seen.most > 0.05
    watched.check(worst)


@pytest.mark.parametrize(("scheme", "alpha"), EVERY)
def test_released_and_taken_on_in_another_scheme(
    scheme, alpha, path, watch, worst, tmp_path: Path
) -> None:
    """Without its force it rises; a frame of that motion starts all schemes with its energy."""
    fields = ("director", "velocity", "director_velocity")
    free = loaded(SI, "ep4", **moving(SI), start=FromRun(path[SI]))
    free = replace(free, loads=free.loads[:1], output=Output(fields=fields, frames=STEPS + 1))
    run = execute(free, tmp_path / "free", pictures=False)
    at = float(run.column("t")[STEPS // 2])
    energy = run.column("total_energy")[STEPS // 2]
    assert run.column("kinetic_energy")[STEPS // 2] > 1e-2 * energy
    start = FromRun(tmp_path / "free", at=at)
    more = loaded(SI, scheme, alpha, **(moving(SI) | {"dt": STEP / math.e}), start=start)
    watched = watch(replace(more, loads=more.loads[:1]))
    worst("energy of the frame", abs(watched.total[0] / energy - 1), 1e-9)
    watched.check(worst)
