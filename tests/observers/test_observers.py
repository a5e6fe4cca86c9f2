"""Observers: momenta with point forces, grids for files, the times of frames, names of columns."""

from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest

from shellmb.errors import SceneError
from shellmb.observers.history import History
from shellmb.running.execute import execute
from shellmb.scene import (
    Clamped,
    EdgeForce,
    InitialVelocity,
    Isotropic,
    Output,
    PointForce,
    Probe,
    Ramp,
    Rectangle,
    Scene,
    Shell,
)
from shellmb.show.space.shapes import lattice
from shellmb.simulate.simulation import BaseObserver

STEEL = Isotropic(E=210e9, nu=0.25, thickness=2e-3, density=7870.0)
PLATE = Shell("plate", Rectangle(1.0, 0.08), STEEL, mesh=(6, 2))
MASS = 1.0 * 0.08 * 2e-3 * 7870.0


@pytest.mark.parametrize("scheme", ["ep", "ed"])
def test_impulse_of_point_forces_explains_the_momenta(scheme):
    force = (1.0, -2.0, 3.0)
    loads = PointForce("right-top", force, time=Ramp(5e-3))
    scene = Scene(
        "s",
        PLATE,
        loads=loads,
        scheme=scheme,
        alpha=0.5 if scheme == "ed" else None,
        dt=1e-3,
        t_end=1e-2,
    )
    result = execute(scene)
    assert result.summary["linear_momentum_drift"] < 1e-11
    # the mean of the ramp over its first half is 1/2
    impulse = [result.history[f"momentum_{axis}"].iloc[-1] for axis in "xyz"]
    assert np.allclose(impulse, np.array(force) * 7.5e-3, rtol=1e-10)
    # ED does not conserve it: the error of the scheme, and that is reported
    angular = result.summary["angular_momentum_drift"]
    assert 1e-11 < angular < 1e-2 if scheme == "ed" else angular < 1e-11
    jump = result.history["jump"].iloc[1:]
    assert jump.notna().all() if scheme == "ed" else jump.isna().all()


def test_rigid_motion_is_measured_as_such():
    spin = InitialVelocity(linear=(1, 0, 0), spin=(0, 0, 3), about=(0.5, 0.04, 0))
    probes = (
        Probe("x", "left-top", "position", 0),
        Probe("v", "left-top", "velocity", "norm"),
        Probe("d", "left-top", "director", 2),
    )
    scene = Scene("s", PLATE, initial=spin, probes=probes, scheme="ep", dt=1e-3, t_end=2e-3)
    first = execute(scene).history.iloc[0]
    assert first["momentum_x"] == pytest.approx(MASS)
    inertia = MASS * (1.0**2 + 0.08**2) / 12
    # about the origin: the centre moves past it at a distance of 0.04
    assert first["angular_momentum_z"] == pytest.approx(3 * inertia - 0.04 * MASS)
    assert first["x"] == pytest.approx(0, abs=1e-12)
    assert first["v"] == pytest.approx(np.hypot(1 - 3 * 0.04, 3 * 0.5))
    assert first["d"] == pytest.approx(1)


def test_linear_statics_is_observed_where_it_is():
    load = EdgeForce("right", (0, 0, 0.1 / 0.08))
    scene = Scene(
        "s",
        PLATE,
        supports=Clamped("left"),
        loads=load,
        probes=Probe("tip", "right-top"),
        scheme="linear-statics",
    )
    result = execute(scene)
    bending = 210e9 * 2e-3**3 / 12 * 0.08
    assert result.history["tip"].iloc[-1] == pytest.approx(0.1 / (3 * bending), rel=0.03)
    assert result.summary["director_max"] is None


@pytest.mark.parametrize(("count", "steps"), [(3, 10), (4, 10), (50, 10), (1, 10), (11, 10)])
def test_frames_are_equally_spaced_and_include_both_ends(tmp_path, monkeypatch, count, steps):
    from shellmb.observers.files import frames as module

    # what is in them does not matter here
    monkeypatch.setattr(module, "RequestedFields", Mock())
    frames = module.Frames(tmp_path)
    taken: list[float] = []
    frames._take = lambda simulation: (  # type: ignore[method-assign]
        taken.append(simulation.t),
        frames._times.append(simulation.t),
    )
    simulation = SimpleNamespace(t=0.0, t_end=1.0)
    mechanism = SimpleNamespace(joints={})
    simulation.model = SimpleNamespace(
        meshed={}, own={}, rigid=None, modal=(), mechanism=mechanism, comm=SimpleNamespace(rank=0)
    )
    simulation.model.rigid_meshes = {}
    simulation.scheme = SimpleNamespace(dynamic=True)
    simulation.model.scene = SimpleNamespace(rigid_bodies=())
    simulation.model.potentials = simulation.model.contacts = ()
    simulation.scene = SimpleNamespace(output=Output(frames=count))
    frames.start(simulation)
    for _ in range(steps):
        simulation.t = min(simulation.t + 1 / steps, 1.0) if _ < steps - 1 else 1.0
        frames.accepted(simulation)
    assert taken[0] == 0 and taken[-1] == 1
    assert len(taken) == min(max(count, 2), steps + 1)


def test_pieces_of_a_cell_cover_it():
    for degree in (2, 3):
        for corners, area in ((4, 1.0), (3, 0.5)):
            points, pieces, around = lattice(degree, corners)
            xy = points[pieces]
            x, y = xy[..., 0], xy[..., 1]
            areas = 0.5 * np.sum(x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1), axis=1)
            assert np.allclose(areas, area / degree**2)
            assert areas.sum() == pytest.approx(area)
            assert len(around) == corners * degree + 1


def test_two_columns_of_one_name_are_refused():
    class Measures(BaseObserver):
        def measure(self):
            return {"t": 0.0}

    history = History([Measures()])
    simulation = SimpleNamespace(model=SimpleNamespace(comm=None))
    with pytest.raises(SceneError, match="two columns are named 't'"):
        history.start(simulation)
