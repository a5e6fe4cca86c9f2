"""Any value for any option of the Python interface: taken, or refused by name before it runs."""

import inspect
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import shellmb as sm
from shellmb.errors import ShellmbError

STEEL = sm.Isotropic(E=210e9, nu=0.25, thickness=2e-3, density=7870.0)


def scene(E: float = 210e9) -> sm.Scene:
    section = sm.Isotropic(E=E, nu=0.25, thickness=2e-3, density=7870.0)
    return sm.Scene(
        "small",
        sm.Shell("plate", sm.Rectangle(1.0, 0.08), section, mesh=(6, 2)),
        supports=sm.Clamped("left"),
        probes=sm.Probe("tip", "right-top", component=2),
        scheme="ep",
        dt=1e-3,
        t_end=2e-3,
    )


DATA = pd.DataFrame({"t": [1e-3, 2e-3], "tip": [1e-4, 2e-4]})
CALLS: dict[Any, dict[str, Any]] = {
    sm.run: {"scene": scene()},
    sm.modes: {"scene": scene()},
    sm.matrices: {"scene": scene()},
    sm.study: {"scene": scene(), "quantity": "tip"},
    sm.fit: {"scene": scene, "data": DATA, "parameters": ["E"]},
    sm.sensitivities: {"scene": scene, "parameters": ["E"]},
}
# of no option
WRONG = {"a complex number": 1j, "an object": object(), "a table": np.zeros((3, 3)), "bytes": b"x"}
# how the types of options are written that are looked at before anything else
CHECKED = ("bool", "int", "float", "tuple[int", "Mapping", "Callable[[str]", "Sequence", "Path")
# several values of an option, each of which is looked at where it is used
LATER = {"rates", "axis", "about", "budget"}


@pytest.mark.parametrize("call", CALLS, ids=lambda call: call.__name__)
def test_values_of_no_kind_are_refused_by_name(call) -> None:
    """Kind: a value of another type, which ended in an error of Python's somewhere within."""
    tried = 0
    for name, parameter in inspect.signature(call).parameters.items():
        written = str(parameter.annotation)
        if name in LATER or not written.startswith(CHECKED):
            continue
        for what, value in WRONG.items():
            with pytest.raises(sm.SceneError) as refused:
                call(**{**CALLS[call], name: value})
            assert str(refused.value).startswith(f"{call.__name__}: {name} is "), what
            tried += 1
    assert tried >= 4 * 4


@pytest.mark.parametrize(
    ("call", "options", "said"),
    [
        (sm.modes, {"loaded": 1}, "modes: loaded is 1; it must be True or False"),
        (sm.modes, {"buckling": "no"}, "modes: buckling is 'no'; it must be True or False"),
        (sm.modes, {"count": 2.0}, "modes: count is 2.0; it must be a whole number"),
        (sm.modes, {"count": 10**400}, "modes: count is 1000.*; it must be a whole number"),
        (sm.modes, {"at": 10**400}, "modes: at is 1000.*; it must be a number"),
        (sm.modes, {"mesh": (4, 2, 1)}, r"modes: mesh is \(4, 2, 1\); it must be two counts as in"),
        (sm.modes, {"mesh": 8}, "modes: mesh is 8; it must be two counts as in"),
        (sm.modes, {"state": "a" * 300}, "modes: state is 'aaa.*; it must be a path, of names"),
        (sm.matrices, {"divide": 0.5}, "matrices: divide is 0.5; it must be a whole number"),
        (sm.run, {"scheme": ["ep", "ed"]}, r"run: scheme is \['ep', 'ed'\]; it must be a text"),
        (sm.fit, {"noise": True}, "fit: noise is True; it must be a number, or numbers by"),
        (sm.fit, {"tell": "x"}, "fit: tell is 'x'; it must be a function"),
        (sm.fit, {"scene": "sudden_load", "runs": 0}, "fit: runs is 0; it must be at least 1"),
        (sm.fit, {"runs": 0}, "fit: runs is 0; it must be at least 1"),
    ],
)
def test_values_that_are_not_meant(call, options, said) -> None:
    with pytest.raises(sm.SceneError, match=said):
        call(**{**CALLS[call], **options})


def test_numbers_of_numpy_and_lists_are_welcome() -> None:
    found = sm.matrices(scene(), np.False_, mesh=[np.int64(2), 1], divide=np.int32(1))
    assert found.M.shape == sm.matrices(scene(), mesh="2x1").M.shape


def test_values_that_end_no_call_in_an_error_of_python() -> None:
    """Kind: any argument of any function, given anything; what is taken is not run."""
    values = {
        "nothing": None,
        "text": "x",
        "a letter that no file has": "a\0b",
        "negative": -1,
        "not a number": float("nan"),
        "endless": 10**400,
        "object": object(),
        "things": [object()],
        "numbers": [1],
        "by no name": {1: 2},
    }
    calls = CALLS | {
        sm.sweep: {"scene": scene, "parameters": {"E": [1e9]}, "executor": "x"},
        sm.resume: {"out": "nothing", "comm": "x"},
        sm.adjoint: {"scene": scene, "objective": max, "comm": "x"},
        sm.frequency_sensitivities: {"scene": scene, "parameters": ["E"], "count": "x"},
        sm.load: {"directory": "nothing"},
        sm.load_scene: {"scene": "nothing"},
        sm.rank: {"found": 1},
        sm.stacking_angles: {"notation": "x"},
        sm.thermal_strain: {"section": STEEL, "expansions": "x", "temperature": 1.0},
    }
    bad = {}
    for call, given in calls.items():
        # a second value that no call takes, behind all those that are looked at
        given = given | ({"comm": "x"} if "comm" in inspect.signature(call).parameters else {})
        for name, parameter in inspect.signature(call).parameters.items():
            if parameter.kind is parameter.VAR_KEYWORD:
                continue
            for what, value in values.items():
                if call in (sm.study, sm.fit) and (name in given or value is None):
                    continue
                try:
                    call(**{**given, name: value})
                except sm.SceneError:
                    pass
                except Exception as error:
                    bad[call.__name__, name, what] = f"{type(error).__name__}: {error}"
    assert not bad


@pytest.mark.parametrize(
    ("former", "today"), [("step_tolerance", "step_error"), ("tolerance", "newton_tolerance")]
)
def test_a_former_name_is_refused_with_the_new_one(former: str, today: str) -> None:
    for function in (sm.run, sm.study, sm.fit, sm.sensitivities):
        with pytest.raises(sm.SceneError, match=f"{former} is now called {today}; write {today}="):
            function(**CALLS[function], **{former: 1e-3})


def test_methods_of_what_calls_return_take_no_values_of_any_kind_either(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Kind: any argument of any method that the reference lists; each ended in a bare error.

    `LinearSystem.poles(-1)` gave all but one of the poles, and `Sensitivities.reserves` of a scene
    without any had none. A method is called with the values of `meant` but for one.
    """
    monkeypatch.chdir(tmp_path)
    forced = replace(scene(), loads=sm.PointForce("right-top", (0, 0, 1.0)))
    run = sm.run(forced, pictures=False)
    found: list[Any] = [
        run,
        sm.modes(forced, rates=[0.0, 5.0], axis=(0, 0, 1), count=1),
        sm.modes(run, count=1),
        sm.matrices(forced),
        sm.linearise(forced),
        sm.response(forced, frequencies=[1.0]),
        sm.SceneMotion(forced),
    ]
    meant = {"point": (0.0, 0.0, 0.0), "count": 1, "mode": 1, "dt": "x", "body": "plate"}
    meant |= {"rate": 5.0, "path": "x.y", "directory": "a\0b", "at": (9.0, 0, 0), "state": None}
    methods = "frame plies plot at modes row state_space select modal poles"
    methods += " to_scipy save load trial nodes take_up"
    values = (None, "x", -1, float("nan"), 10**400, object(), [object()], [1], {1: 2}, 1j)
    bad, tried = {}, 0
    for of in found:
        for method in filter(partial(hasattr, of), methods.split()):
            call = getattr(of, method)
            known = inspect.signature(call).parameters
            given = {name: meant[name] for name, p in known.items() if p.default is p.empty}
            for name, value in product(known, values):
                tried += 1
                try:
                    call(**given | {name: value})
                except ShellmbError:
                    pass
                except Exception as error:
                    bad[type(of).__name__, method, name, repr(value)[:9]] = repr(error)
    assert not bad and tried > 250
    with pytest.raises(sm.SceneError, match="count is -1; it must be at least 1"):
        found[4].poles(-1)
    assert sm.sensitivities(scene, ["E"], fields=False).reserves.empty
