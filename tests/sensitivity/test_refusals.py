"""What has no derivatives is refused with a sentence before anything runs, or said."""

from itertools import pairwise

import numpy as np
import pytest

import shellmb as sm
from shellmb.sensitivity.parameters import differentiated, parameters_of
from shellmb.sensitivity.shadow import Shadow
from tests.sensitivity import scenes


def elements(count: float = 3.0) -> sm.Scene:
    """A scene whose mesh follows a number."""
    steel = sm.Isotropic(210e9, 0.3, thickness=4e-3, density=7800.0)
    shell = sm.Shell("strip", sm.Rectangle(1, 0.2), steel, mesh=(int(count + 0.5), 1))
    return sm.Scene("mesh", shell, supports=sm.Clamped("left"), scheme="ep", dt=1e-3, t_end=1e-3)


def stepped(dt: float = 1e-3) -> sm.Scene:
    """A scene whose step is a parameter."""
    return scenes.plate(dt=dt)


def ignored(thickness: float = 4e-3, colour: float = 1.0) -> sm.Scene:
    """A parameter without use."""
    return scenes.plate(thickness=thickness, steps=1)


@pytest.mark.parametrize(
    ("names", "values", "said"),
    [
        (("width",), {}, "scene 'plate' has no parameter 'width'; it has 'scheme', 'alpha'"),
        ((), {}, "no parameter is named; name at least one"),
        (("E", "E"), {}, "parameter 'E' is named twice"),
        (("scheme",), {}, "parameter 'scheme' is 'ep'; it must be a number"),
        (("force",), {"force": 0.0}, r"give its size, as in scales=\{'force': 1.0\}"),
        (("dt",), {}, "parameter 'dt' changes dt from"),
        (("E",), {"E": np.array([2e11])}, r"parameter 'E' is array\(\[2.e\+11\]\); it must be a"),
    ],
)
def test_bad_parameters(names: tuple, values: dict, said: str) -> None:
    with pytest.raises(sm.SceneError, match=said):
        sm.sensitivities(scenes.plate, names, values=values)


@pytest.mark.parametrize(
    ("scales", "said"),
    [
        ({"nose": 1.0}, "scales has 'nose', which is no parameter here; parameters are 'E'"),
        ({"E": "big"}, "scales gives 'E' the size 'big'; it must be a number"),
        # differences that vanish in the value would say that nothing depends on it
        ({"E": 1e-9}, r"gives 'E' the size 1e-09.* give a size of at least 2.1e\+06"),
    ],
)
def test_bad_sizes(scales: dict, said: str) -> None:
    with pytest.raises(sm.SceneError, match=said):
        sm.sensitivities(scenes.plate, ("E",), scales=scales)


def test_other_bad_input() -> None:
    with pytest.raises(sm.SceneError, match="found is a function; it must be what"):
        sm.rank(scenes.plate)  # type: ignore[arg-type]
    with pytest.raises(sm.SceneError, match="count is 0; it must be at least 1"):
        sm.frequency_sensitivities(scenes.plate, ("E",), count=0)


def test_forces_beside_the_run_that_are_no_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    # as of a law in UFL with a root that ends at the value: its derivative is no number
    prepare = Shadow.prepare

    def without_numbers(self: Shadow, t: float, dt: float, until: float = 0.0) -> None:
        prepare(self, t, dt, until)
        next(iter(self.simulation.live().values()))[:] = np.nan

    monkeypatch.setattr(Shadow, "prepare", without_numbers)
    said = "no finite number in the step from t = 0 with 'E' = 2.099979e.11 or 2.100021e.11"
    with pytest.raises(sm.ConvergenceError, match=said):
        sm.sensitivities(scenes.plate, ("E",), columns="probes", fields=False)


def test_scene_is_a_function() -> None:
    with pytest.raises(sm.SceneError, match="scene is a Scene; it must be a function"):
        sm.sensitivities(scenes.plate(), ("E",))  # type: ignore[arg-type]


def jumping(start: float = 2.5e-3, phase: float = 0.0) -> sm.Scene:
    """A load that begins at once, or without a jump."""
    made, time = scenes.plate(), sm.Sine(30.0, phase, start) if phase < 1 else sm.Step(start)
    return sm.Scene(**{**vars(made), "loads": sm.EdgeForce("right", (0, 0, 1.0), time=time)})


@pytest.mark.parametrize("phase", [0.5, 2.0])
def test_jumps_of_loads_move(phase: float) -> None:
    """A jump within a step acts as a whole or not at all: its time would have no derivative."""
    with pytest.raises(sm.SceneError, match=r"'start' moves the jump of a load or motion at t = 0"):
        sm.sensitivities(jumping, ("start",), values={"phase": phase})


def test_corners_of_loads_may_move() -> None:
    found = sm.sensitivities(jumping, ("start",), columns="probes")
    assert not found.warnings
    size = 1e-5
    above, below = (
        sm.run(jumping(2.5e-3 + by), pictures=False).history["tip"] for by in (size, -size)
    )
    # differences of runs: their square, over a load that begins within two steps
    np.testing.assert_allclose(
        found.history["start"]["tip"], (above - below) / (2 * size), rtol=1e-3, atol=1e-12
    )


def test_lengths_of_a_mechanism_with_redundant_constraints() -> None:
    """Coefficients of redundant constraints move with lengths, and the same ones are redundant."""

    def four_bar(height: float = 1.0) -> sm.Scene:
        corners = [(0, 0, 0), (0, 0, height), (1.2, 0, 1.1 * height), (1, 0, 0)]
        rods = [
            sm.RigidBody(f"rod_{k}", 1.0, (0.1, 0.1, 0.1), position=tuple(np.mean(both, axis=0)))
            for k, both in enumerate(pairwise(corners))
        ]
        names = [sm.GROUND, *(rod.name for rod in rods), sm.GROUND]
        return sm.Scene(
            "four-bar",
            rigid_bodies=rods,
            joints=[
                sm.Revolute(f"pin_{k}", *pair, at=corners[k], axis=(0, 1, 0))
                for k, pair in enumerate(pairwise(names))
            ],
            loads=sm.Gravity(),
            probes=sm.Probe("x", "center", body="rod_1", component=0),
            redundant="drop",
            scheme="ep",
            dt=0.01,
            t_end=0.05,
        )

    slope = sm.sensitivities(four_bar, ("height",), columns="probes").history["height"]["x"]
    above, below = (sm.run(four_bar(1 + by), pictures=False).history["x"] for by in (1e-4, -1e-4))
    # the square of differences of 1e-4, of numbers whose derivatives are of their size
    np.testing.assert_allclose(slope, (above - below) / 2e-4, rtol=1e-6, atol=1e-9)


def test_mesh_keeps_its_topology() -> None:
    with pytest.raises(sm.SceneError, match="'count' changes the mesh"):
        sm.sensitivities(elements, ("count",), values={"count": 2.5})


def test_nothing_depends_on_it() -> None:
    found = sm.sensitivities(ignored, ("colour",), columns="probes")
    assert found.warnings == ("nothing depends on 'colour' near 1: its derivatives are zero",)
    assert (found.history["colour"].dropna() == 0).all(axis=None)


@pytest.mark.parametrize("number", [np.float32(400), np.int64(400), 400])
def test_numbers_of_numpy_are_numbers(number: float) -> None:
    made = differentiated(scenes.plate, {"force": number})
    (found,) = parameters_of(made, ("force",), {"force": number})
    assert found == parameters_of(made.at(force=400.0), ("force",))[0]


def test_derivatives_that_are_round_off_are_said() -> None:
    """Statics has no mass, and directors are turned by sums with round-off: not exactly zero."""
    found = sm.sensitivities(
        scenes.plate, ("density", "E"), values={"scheme": "static"}, errors=True, fields=False
    )
    errors, density = found.warnings
    assert errors.startswith("errors=True has no effect beside derivatives")
    assert density.startswith("no result and no probe depends on 'density' near 7800")


def test_more_parameters_than_mpi_has_communicators_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """MPI would end the program."""
    monkeypatch.setattr("shellmb.sensitivity.run.OWN", 2000)
    with pytest.raises(sm.SceneError, match=r"1 parameters are too many .* beside it of 0; free"):
        sm.sensitivities(scenes.plate, ("force",), values={"steps": 1})
