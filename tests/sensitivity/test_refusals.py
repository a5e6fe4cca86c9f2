"""What has no derivatives is refused with a sentence before anything runs, or said."""

import warnings
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

import shellmb as sm
from shellmb.sensitivity.parameters import differentiated
from shellmb.sensitivity.perturbed_run import PerturbedRun
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
        (
            ("force",),
            {"force": 0.0},
            r"give its size, as in scales=\{'force': 1.0\} \(--scale force=1.0\)",
        ),
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
        ({"E": 0.0}, "scales gives 'E' the size 0; it must be finite, and not zero"),
        ({"E": np.nan}, "scales gives 'E' the size nan; it must be finite"),
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
    prepare = PerturbedRun.prepare

    def without_numbers(self: PerturbedRun, t: float, dt: float, until: float = 0.0) -> None:
        prepare(self, t, dt, until)
        next(iter(self.simulation.live().values()))[:] = np.nan

    monkeypatch.setattr(PerturbedRun, "prepare", without_numbers)
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
    # differences of runs: their square, over a load that begins within two steps; in the first step
    # nothing acts yet, and of 9e-4 derivatives have seven digits
    np.testing.assert_allclose(
        found.history["start"]["tip"], (above - below) / (2 * size), rtol=1e-3, atol=1e-10
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
    (said,) = found.warnings
    assert said.startswith("nothing depends on 'colour' between 0.99999 and 1.00001: its deriv")
    assert (found.history["colour"].dropna() == 0).all(axis=None)


def thrown(push=1.0, start=0.4, scheme="ep") -> sm.Scene:
    """A mass that a force pushes, and one that is carried along beside it."""
    body = dict(mass=1.0, inertia=(1, 1, 1))
    carried = sm.Ramp(start=start, duration=1.0)
    return sm.Scene(
        "thrown",
        rigid_bodies=(sm.RigidBody("b", **body), sm.RigidBody("c", position=(2, 0, 0), **body)),
        joints=sm.Prismatic("slide", sm.GROUND, "c", at=(2, 0, 0), axis=(0, 0, 1)),
        drivers=sm.Driver("motor", "slide", translation=carried),
        loads=sm.PointForce(
            (0, 0, 0), (push, 0, 0), body="b", time=sm.Ramp(start=start, duration=1.0)
        ),
        probes=(
            sm.Probe("x", "center", body="b", component=0),
            sm.Probe("z", (2, 0, 0), body="c", component=2),
        ),
        scheme=scheme,
        dt=0.1,
        t_end=0.6,
    )


def test_differences_that_vanish_in_the_scene() -> None:
    """The kind: a number that others swallow. It was 0.04, round-off over the difference."""
    found = sm.sensitivities(lambda a=1e-12: thrown(push=5.0 + a), ("a",))
    assert "gives a larger one" in found.warnings[0]
    assert (found.history["a"].dropna() == 0).all(axis=None)
    assert float(abs(found.fields["a"]["rigid bodies"].position).max()) == 0.0
    found = sm.sensitivities(lambda a=1e-12: thrown(push=5.0 + a), ("a",), scales={"a": 1.0})
    assert not found.warnings


def test_kinks_of_the_scene_function() -> None:
    """Both sides are alike, so that nothing seemed to depend on it."""
    found = sm.sensitivities(lambda a=0.0: thrown(push=abs(a)), ("a",), scales={"a": 1.0})
    assert found.warnings[0].startswith("the scene is the same at 'a' = -1e-05 and 1e-05, and")
    assert "such as abs, has none" in found.warnings[0]


@pytest.mark.parametrize("differentiate", [sm.sensitivities, sm.frequency_sensitivities])
def test_random_scenes(differentiate: Callable[..., object]) -> None:
    """Differences of two draws over that of the parameter were 4000 for 0.08."""
    drawn = np.random.default_rng(1)
    with pytest.raises(sm.SceneError, match=r"differs between two calls .* loads.*force.* a seed"):
        differentiate(lambda push=1.0: thrown(push=push + drawn.random()), ("push",))


def test_what_is_wrong_beside_the_run_names_the_parameter() -> None:
    def probed(place: float = 1.0) -> sm.Scene:
        tip = sm.Probe("tip", (place, 0.1, 0), component=2)
        return sm.Scene(**{**vars(scenes.plate(steps=1)), "probes": tip})

    said = "both sides of 'place' = 1, at 0.99999 and 1.00001: probe 'tip'"
    with pytest.raises(sm.SceneError, match=said):
        sm.sensitivities(probed, ("place",))


@pytest.mark.parametrize(
    ("scheme", "start", "said"),
    [
        # a load is taken in the middle of a step of EP, too, a motion at its end
        ("ep", 0.45, ["load 1"]),
        ("ep", 0.4, ["a prescribed motion"]),
        ("ep", 0.42, []),
        # both at the end of a step
        pytest.param(
            "generalized-alpha", 0.4, ["load 1", "a prescribed motion"], marks=pytest.mark.slow
        ),
        ("static", 0.4, ["a prescribed motion"]),
    ],
)
def test_corners_that_a_step_meets(scheme: str, start: float, said: list[str]) -> None:
    """Derivatives are means of both slopes, without a word: 7.2 for 0 or 14.4 in ED."""
    make = carried_in_statics if scheme == "static" else thrown
    found = sm.sensitivities(
        make, ("start",), values={"scheme": scheme, "start": start}, columns="probes"
    )
    corners = [w for w in found.warnings if "moves: derivatives after it are means" in w]
    assert [w.split(" has a corner ")[0].split("of time of ")[1] for w in corners] == said

    def motion(by: float) -> np.ndarray:
        run = sm.run(make(scheme=scheme, start=start + by), pictures=False)
        return run.history[["x", "z"]].to_numpy()

    size = 1e-7
    later, here, earlier = motion(size), motion(0.0), motion(-size)
    bent, slope = np.abs(later + earlier - 2 * here), np.abs(later - earlier)
    moved = slope > 1e-10
    kink = (bent[moved] / slope[moved]).max()
    # where nothing moves on one side it is 1, and a load has several instants in a step; what is
    # smooth leaves the distance of both, and round-off over it
    assert kink > 0.3 if said else kink < 1e-2


def carried_in_statics(scheme: str = "static", start: float = 0.4) -> sm.Scene:
    """A strip whose edge is lifted from a time on."""
    made = scenes.plate(scheme)
    lift = sm.Ramp(start=start, duration=1.0)
    moved = sm.Fixed("left", displacement=(0, 0, lift), director=(0, 0, 0))
    probes = tuple(sm.Probe(n, "right-top", component=2) for n in ("x", "z"))
    given = {"supports": moved, "probes": probes, "loads": (), "dt": 0.1, "t_end": 0.6}
    return sm.Scene(**{**vars(made), **given})


@pytest.mark.parametrize("number", [np.float32(400), np.int64(400), 400])
def test_numbers_of_numpy_are_numbers(number: float) -> None:
    made = differentiated(scenes.plate, {"force": number})
    (found,) = made.parameters(("force",), {"force": number})
    plain = differentiated(scenes.plate, {"force": 400.0})
    assert found == plain.parameters(("force",))[0]


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
    monkeypatch.setattr("shellmb.api.sensitivity.run.OWN", 2000)
    with pytest.raises(sm.SceneError, match=r"1 parameters are too many .* beside it of 0; free"):
        sm.sensitivities(scenes.plate, ("force",), values={"steps": 1})


def test_scenes_of_differences_warn_of_nothing() -> None:
    """Kind: scenes beside the one that is asked for, of which nobody knows; a rope is let out."""

    def lowered(rate: float = 0.3) -> sm.Scene:
        return sm.Scene(
            "lowered",
            rigid_bodies=sm.RigidBody("load", 2.0, (0.1,) * 3, (0, 0, -1.0)),
            joints=sm.Distance(
                "rope",
                "ground",
                "load",
                at=(0, 0, 0),
                second_at="center",
                length=lambda t: 1 + rate * t,
            ),
            initial=sm.InitialVelocity((0, 0, -0.3)),
            probes=sm.Probe("height", "center"),
            scheme="ep4",
            dt=0.05,
            t_end=0.1,
        )

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = sm.sensitivities(lowered, ("rate",), fields=False, columns="probes")
        back = sm.adjoint(lowered, lambda h: float(h["height"][-1]), parameters=("rate",))
    slopes = [found.history["rate"]["height"].iloc[-1], back.parameters["rate"]]
    assert slopes == pytest.approx([-0.1, -0.1], rel=1e-7)
