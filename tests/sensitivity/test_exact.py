"""Derivatives of whole runs are those that central differences of whole runs give.

The kind: a derivative of any column of any run by any parameter of a scene function. Schemes,
bodies and kinds of parameters are varied; the reference is runs that know nothing of derivatives.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import shellmb as sm
from shellmb.options.run import Options
from shellmb.running.execute import execute
from tests.sensitivity import scenes

ROOT = Path(__file__).parents[2]
# relative distance of the reference, whose own error is a few times its square
APART = 1e-4
# what users are told; the reference's own error is 1e-8 to 2e-7 of it
EXACT = 1e-6
# derivatives that are zero, as of momenta across the plane of a motion: their round-off, relative
# to the column over the parameter and to the derivatives of columns of the same name
ZERO = 1e-6
# what is round-off by itself
NOISE = {"energy_balance", "director_error", "constraint_error"}
# options of runs, and what they are in a scene
TIGHT = {"newton": "full", "newton_tolerance": 1e-11}
SHARP: dict[str, object] = {"newton": "full", "tolerance": 1e-11}

CASES = [
    pytest.param(scenes.plate, {"scheme": "ep"}, ("length",), id="plate-ep"),
    pytest.param(scenes.mechanism, {"scheme": "ed"}, ("arm",), id="mechanism-ed"),
    pytest.param(scenes.vault, {"scheme": "ep4"}, ("radius",), id="vault-ep4"),
    # its natural strain works, and what is observed of that is at the time of the run
    pytest.param(scenes.heated, {"scheme": "ep"}, ("curvature",), id="heated-ep"),
    pytest.param(scenes.modal_plate, {"scheme": "ep"}, ("thickness",), id="modal-ep"),
]
PLATE = ("thickness", "E", "density", "length", "force", "frequency", "speed", "damping")
MECHANISM = ("stiffness", "viscosity", "cord", "mass", "arm", "rate", "radius")
MOTIONS = ("ep", "ed", "ep4", "ed3", "generalized-alpha")
MODAL = ("ep", "ed", "ep4", "static")
MANY = [
    *((scenes.plate, s, PLATE) for s in scenes.DAMPED),
    (scenes.plate, "generalized-alpha", PLATE[:-1]),
    (scenes.plate, "linear-dynamics", ("thickness", "length", "speed")),
    *((scenes.plate, s, ("thickness", "E", "length", "force")) for s in scenes.STATIC),
    *((scenes.vault, s, ("radius", "thickness", "force", "gravity")) for s in (*MOTIONS, "static")),
    *((scenes.mechanism, s, MECHANISM) for s in MOTIONS),
    *((scenes.modal_plate, s, ("thickness", "E", "length", "force", "frequency")) for s in MODAL),
    *((scenes.modal_mechanism, s, ("stiffness", "mass", "arm", "rate", "radius")) for s in MODAL),
    *((scenes.heated, s, ("strain", "curvature", "thickness", "E", "length")) for s in MOTIONS),
    *((scenes.panels, s, ("stiffness", "viscosity", "thickness", "width")) for s in scenes.DAMPED),
    *((scenes.balloon, s, ("pressure", "exponent", "ambient", "radius")) for s in scenes.DAMPED),
    *((scenes.meeting, s, ("stiffness", "thickness", "E", "shift")) for s in scenes.DAMPED),
    *((scenes.plucked, s, ("amplitude", "velocity", "shape", "thickness")) for s in scenes.DAMPED),
]


def differences(make: Callable[..., sm.Scene], given: dict, name: str, value: float) -> dict:
    """Derivatives of all columns by central differences of whole runs."""

    def columns(at: float) -> dict:
        scene = make(**given | {name: at})
        run = execute(replace(scene, solver=replace(scene.solver, **SHARP)))
        return {key: run.column(key) for key in run.rows[0]}

    above, below = value * (1 + APART), value * (1 - APART)
    a, b = columns(above), columns(below)
    return {key: (a[key] - b[key]) / (above - below) for key in a}


def largest(values: np.ndarray) -> float:
    return float(np.nanmax(np.abs(values), initial=0.0))


def stem(column: str) -> str:
    """What parts of a vector or an energy have in common: `momentum` of `momentum_x`, `hinge.F`."""
    return "energy" if column.endswith("energy") else column.rstrip("xyz123").rstrip("_FM")


def assert_exact(
    make: Callable[..., sm.Scene],
    given: dict,
    names: tuple,
    within: float = EXACT,
    wider: dict[str, float] | None = None,
    **options,
) -> None:
    """All columns are within a part of the largest derivative, some of them within a wider one."""
    found = sm.sensitivities(make, names, values=given, fields=False, **TIGHT, **options)
    run, compared = found.run.history, 0
    for p in found.parameters:
        exact = differences(make, given, p.name, p.value)
        for column in found.history[p.name].columns:
            if column in NOISE:
                continue
            wrong = largest(found.history[p.name][column] - exact[column])
            size = largest(exact[column])
            same = [c for c in exact if stem(c) == stem(column)]
            alike, size_of = (max(largest(of[c]) for c in same) for of in (exact, run))
            round_off = ZERO * max(alike, size_of / abs(p.value))
            bound = (wider or {}).get(column, within) * size + round_off + 1e-12
            assert wrong <= bound, (p.name, column, wrong / size)
            compared += size > round_off
    assert compared > 3 * len(names)


@pytest.mark.parametrize(("make", "given", "names"), CASES)
def test_derivatives_are_exact(make: Callable[..., sm.Scene], given: dict, names: tuple) -> None:
    assert_exact(make, given, names)


@pytest.mark.slow
@pytest.mark.parametrize(("make", "scheme", "names"), MANY)
def test_derivatives_are_exact_everywhere(
    make: Callable[..., sm.Scene], scheme: str, names: tuple
) -> None:
    assert_exact(make, {"scheme": scheme}, names)


@pytest.mark.slow
def test_bodies_with_linear_strains_have_exact_derivatives() -> None:
    def plate(thickness: float = 4e-3, length: float = 1.0) -> sm.Scene:
        return Options(model="floating-frame").apply(
            scenes.plate(thickness=thickness, length=length)
        )

    assert_exact(plate, {}, ("thickness", "length"))


@pytest.mark.slow
def test_given_volumes_and_hinges_of_one_angle_have_exact_derivatives() -> None:
    assert_exact(scenes.balloon, {"fluid": True}, ("swelling", "thickness", "radius"))
    assert_exact(scenes.panels, {"rigid": True}, ("stiffness", "viscosity", "width"))


# a contact of each kind and a stop that lasts for a few steps, in turn with each scheme
SHORT = [
    (scenes.knock, {"kind": "plane"}, "place"),
    (scenes.stopped, {"scheme": "ed3", "smoothing": 1e-5}, "limit"),
]
SHORT_SLOW = [
    *(
        (scenes.knock, {"kind": kind, "scheme": MOTIONS[k % 4]}, "place")
        for k, kind in enumerate(scenes.OBSTACLES)
    ),
    (scenes.knock, {"scheme": "ed3", "friction": 0.3, "slip_speed": 0.05}, "stiffness"),
    (scenes.knock, {"scheme": "ep", "obstacle_body": "wall"}, "stiffness"),
    (scenes.knock, {"scheme": "ep4", "relative_damping": 2.0}, "stiffness"),
    (scenes.knock, {"scheme": "ed", "smoothing": 0.0, "dt": 5e-3, "steps": 40}, "stiffness"),
    (scenes.stopped, {"scheme": "ep4", "relative_damping": 2.0}, "limit"),
    (scenes.stopped, {"scheme": "ep", "smoothing": 0.0}, "limit"),
    (scenes.stopped, {"scheme": "ed3", "turns": False}, "limit"),
    (scenes.stopped, {"scheme": "ed", "turns": False, "relative_damping": 2.0}, "stiffness"),
    (scenes.meeting, {"scheme": "ep"}, "stiffness"),
    (scenes.carried, {"scheme": "ep4"}, "stiffness"),
]


@pytest.mark.parametrize(
    ("make", "given", "name"),
    [*SHORT, *(pytest.param(*each, marks=pytest.mark.slow) for each in SHORT_SLOW)],
)
def test_short_contacts_and_stops_have_exact_derivatives_by_default(
    make: Callable[..., sm.Scene], given: dict, name: str
) -> None:
    """The kind: factors of the run are those of a state before the contact began, or of another.

    They were believed to contract as in free flight; derivatives were 2 to 3 per cent off.
    """
    found = sm.sensitivities(make, (name,), values=given, columns="probes")
    value = found.parameters[0].value
    exact = differences(make, given, name, value)
    for column in found.history[name].columns:
        slope = found.history[name][column].to_numpy()
        size = largest(exact[column])
        assert size < 1e-9 or largest(slope - exact[column]) <= 1e-5 * size, column
    # what may be asked of it
    assert found.run.scene.name == make(**given).name


@pytest.mark.slow
def test_contact_and_friction_have_exact_derivatives() -> None:
    # the reference: friction turns its sign within a few distances of its differences
    assert_exact(scenes.skid, {}, ("stiffness", "friction", "speed"), within=1e-5)
    assert_exact(scenes.meeting, {"friction": 0.3}, ("stiffness", "friction"), within=1e-5)


@pytest.mark.slow
def test_obstacles_that_move_have_exact_derivatives() -> None:
    # by where the obstacle is on its body, too
    given = ("stiffness", "friction", "speed", "height")
    assert_exact(scenes.carried, {}, given, within=1e-5)


@pytest.mark.slow
def test_controllers_have_exact_derivatives() -> None:
    names = ("gain", "integral", "mass", "target")
    assert_exact(scenes.controlled, {}, names)
    # sensors read other columns than those of probes
    found = sm.sensitivities(scenes.controlled, ("gain",), columns="probes", **TIGHT)
    assert found.history["gain"]["tip"].iloc[-1] != 0.0


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["ep", "ed", "ep4"])
def test_all_unknowns_in_one_matrix_give_the_same(scheme: str) -> None:
    """Without the reduction directors and multipliers are unknowns like others."""
    assert_exact(scenes.vault, {"scheme": scheme}, ("radius", "thickness"), solve="full")
    assert_exact(scenes.mechanism, {"scheme": scheme}, ("arm", "stiffness"), solve="full")


def test_taylor_remainder_is_of_second_order() -> None:
    value, apart = 4e-3, (4e-2, 2e-2)
    found = sm.sensitivities(scenes.plate, ("thickness",), columns="probes", **TIGHT)

    def tip(thickness: float) -> np.ndarray:
        scene = scenes.plate(thickness=thickness)
        return execute(replace(scene, solver=replace(scene.solver, **SHARP))).column("tip")

    start, slope = tip(value), found.history["thickness"]["tip"].to_numpy()
    rest = [np.abs(tip(value * (1 + h)) - start - value * h * slope).max() for h in apart]
    # 0.05: terms of third order
    assert abs(np.log2(rest[0] / rest[1]) - 2) < 0.05


def test_run_is_bit_for_bit_that_without_derivatives() -> None:
    alone = execute(scenes.plate(scheme="ed"))
    beside = sm.sensitivities(scenes.plate, ("E",), values={"scheme": "ed"}, fields=False)
    for name in set(alone.rows[0]) - {"wall_s"}:
        np.testing.assert_array_equal(alone.column(name), beside.run.history[name], name)


@pytest.mark.slow
def test_two_ranks_find_the_same(mpirun: Callable[..., str]) -> None:
    source = """
import shellmb as sm
from mpi4py import MPI
from tests.sensitivity import scenes

found = sm.sensitivities(
    scenes.plate, ("length",), values={"scheme": "ed"}, newton="full", newton_tolerance=1e-11
)
if MPI.COMM_WORLD.rank == 0:
    print(repr(float(found.history["length"]["total_energy"].iloc[-1])))
"""
    source = f"import sys; sys.path.append({str(ROOT)!r}){source}"
    one, two = (float(mpirun(n, "-c", source).split()[-1]) for n in (1, 2))
    # round-off over the distance of both sides
    assert two == pytest.approx(one, rel=1e-7)


@pytest.mark.slow
def test_automatic_newton_gives_the_same_derivatives() -> None:
    """Old factors are for an iteration that ends where new ones do at once."""
    full, auto = (
        sm.sensitivities(
            scenes.plate, ("thickness",), values={"steps": 8}, columns="probes", newton=newton
        ).history["thickness"]
        for newton in ("full", "auto")
    )
    # the tolerance of the iteration, times what forces amplify it by
    np.testing.assert_allclose(auto["tip"], full["tip"], rtol=1e-6, atol=1e-9)
