"""The number that is differentiated: a function of histories of probes and reserves."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.running.error_origin import user_failures
from shellmb.scene import Scene
from shellmb.scene.lookup import listed, said

# differences of fourth order where derivatives are not written: places beside the middle, in
# distances, and their weights in a derivative, over the distance
FOURTH = ((-2, 1 / 12), (-1, -2 / 3), (1, 2 / 3), (2, -1 / 12))

Objective = Callable[[Mapping[str, Floats]], float]

# what a probe may measure here, as it is linear in the state
QUANTITIES = ("displacement", "position", "velocity")
# distance of differences, relative to the largest value of a history; where the number is not
# smooth over it, a closer one, which leaves ten digits
APART, CLOSER = 1e-4, 1e-6
# part of the changes by which those of a smooth number differ over both distances: the square of
# the distance, times the square of the power, and round-off
KINK = 1e-2
WEIGHTS = np.array([weight for _, weight in FOURTH])


def names_of(scene: Scene) -> list[str]:
    """Names of the histories that the number may depend on."""
    return [*(probe.name for probe in scene.probes), *(each.name for each in scene.reserves)]


def check_probes(scene: Scene) -> None:
    """Refuse probes that are not linear in the state.

    Raises:
        SceneError: If there are such probes, reserves of bodies in modes, or none of both.
    """
    if not names_of(scene):
        raise SceneError(
            f"adjoint: scene '{scene.name}' has no probe and no reserve; the objective is a "
            "function of these"
        )
    for reserve in scene.reserves:
        shell = scene.shell(reserve.body, said(reserve))
        if shell.modes:
            raise SceneError(
                f"adjoint: {said(reserve)} is of shell '{shell.name}', which is reduced to modes; "
                "leave it out, or use `sensitivities`"
            )
    for probe in scene.probes:
        (body,) = scene.bodies_of(probe)
        if body.modes:
            raise SceneError(
                f"adjoint: probe '{probe.name}' is on '{body.name}', which is reduced to modes; it "
                "must be on a body with nodes or on a rigid one; `sensitivities` has derivatives "
                "of all probes"
            )
        plain = probe.quantity in QUANTITIES and probe.component != "norm" and probe.frame is None
        if not plain:
            raise SceneError(
                f"adjoint: probe '{probe.name}' records {probe.quantity} ({probe.component}); it "
                f"must be a component of {', '.join(QUANTITIES)} in the scene's axes"
            )
        if probe.quantity == "velocity" and scene.static:
            raise SceneError(f"adjoint: probe '{probe.name}' records a velocity; statics has none")


class Histories(dict[str, Floats]):
    """Histories by the names of probes, and "t"; others are an error."""

    def __missing__(self, name: object) -> Floats:
        raise SceneError(f"adjoint: the objective reads {name!r}; there are {listed(self)}")


def check_objective(objective: Objective, scene: Scene) -> None:
    """Refuse, before a run, what is no function, returns nothing, or reads what no probe records.

    Raises:
        SceneError: If it is so.
    """
    if not callable(objective):
        raise SceneError(
            f"adjoint: the objective is {objective!r:.40}; it must be a function of histories"
        )
    try:
        found: Any = objective(Histories({n: np.arange(3) / 2 for n in ("t", *names_of(scene))}))
    except SceneError:
        raise
    except (Exception, SystemExit):
        return
    if found is None or isinstance(found, str):
        raise SceneError(f"adjoint: the objective is {_shown(found)}; it must be a finite number")


def evaluated(objective: Objective, history: Mapping[str, Floats]) -> float:
    """The number.

    Raises:
        SceneError: If it is no finite number, or another one in a second call.
    """
    value = _number(objective, history)
    again = _number(objective, history)
    if again != value:
        raise SceneError(
            f"adjoint: the objective is {value:.9g}, and {again:.9g} in a second call with the "
            "same histories; it must be a function of them alone"
        )
    return value


def _number(objective: Objective, history: Mapping[str, Floats]) -> float:
    """The number at some histories, which it may change: they are copies.

    Raises:
        SceneError: If it is no finite number.
    """
    copied = Histories({name: values.copy() for name, values in history.items()})
    with user_failures(SceneError, "adjoint: the objective fails"):
        found: Any = objective(copied)
    plain = not isinstance(found, list | tuple) and np.asarray(found).shape == ()
    if not (plain and np.asarray(found).dtype.kind in "fiu" and np.isfinite(found)):
        raise SceneError(f"adjoint: the objective is {_shown(found)}; it must be a finite number")
    return float(found)


def _shown(found: Any) -> str:
    """Text of what an objective returned, in few characters, without names of NumPy's numbers."""
    return f"{found.item() if isinstance(found, np.generic) else found!r}"[:40]


def slopes(
    objective: Objective, history: Mapping[str, Floats], middle: float, said: list[str]
) -> dict[str, Floats]:
    """Derivatives of the number by each value of each probe, by differences of fourth order.

    Where it is not smooth over their distance, as a largest value near another one, they are taken
    closer; a sentence names histories in which it is not smooth there, too.

    Args:
        objective: The number as a function of the histories.
        history: Values over the steps by probe, and "t".
        middle: The number there.
        said: Receives the warnings.

    Raises:
        SceneError: If it is no finite number beside the histories of the run.
    """
    found = {}
    for name, values in history.items():
        if name == "t":
            continue
        for apart in (APART, CLOSER):
            size = apart * (float(np.abs(values).max()) or 1.0)
            beside = [_around(objective, history, name, n, size) for n in range(len(values))]
            change = np.array(beside) - middle
            found[name] = change @ WEIGHTS / size
            # what starts at zero stays there, as the length of a way does
            if _smooth(change[1:] if values[0] == 0 else change):
                break
        else:
            said.append(
                f"the objective has a kink in the history of '{name}', such as a largest "
                "value that is reached twice, or loses digits in a sum; its derivative by that "
                "history is a mean of several or round-off: use a smooth number, such as a mean "
                "of high powers",
            )
    return found


def _around(
    objective: Objective, history: Mapping[str, Floats], name: str, n: int, size: float
) -> list[float]:
    """The number where one value of a history is moved.

    Raises:
        SceneError: If it is no finite number there.
    """
    found = []
    for offset, _ in FOURTH:
        moved = {**history, name: history[name].copy()}
        moved[name][n] += offset * size
        try:
            with np.errstate(invalid="ignore", divide="ignore"):
                found.append(_number(objective, moved))
        except SceneError as error:
            raise SceneError(
                f"adjoint: the objective has no derivative by '{name}' at t = "
                f"{history['t'][n]:g}, where it is {history[name][n]:g}: at "
                f"{moved[name][n]:g}, {str(error).removeprefix('adjoint: ')}"
            ) from error
    return found


def _smooth(around: Floats) -> bool:
    """Decide whether numbers around the middle, which is zero, follow a polynomial there.

    Slopes over both distances are alike, and so are curvatures, for a smooth number.

    Args:
        around: Differences from the middle, shape (values, 4), at `FOURTH`.
    """
    two_below, below, above, two_above = around.T
    most = np.abs(around).max()
    odd = (two_above - two_below) - 2 * (above - below)
    even = (two_above + two_below) - 4 * (above + below)
    return bool(np.all(np.abs([odd, even]) <= KINK * most))
