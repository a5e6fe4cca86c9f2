"""The number that is differentiated: a function of the histories of probes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import SceneError, ShellmbError
from shellmb.running.error_origin import in_words
from shellmb.scene import Modal, Scene
from shellmb.scene.lookup import listed
from shellmb.sensitivity.adjoint.differences import FOURTH

Objective = Callable[[Mapping[str, Floats]], float]

# what a probe may measure here, as it is linear in the state
QUANTITIES = ("displacement", "position", "velocity")
# distance of differences, relative to the largest value of a history
APART = 1e-4


def check_probes(scene: Scene) -> None:
    """Refuse probes that are not linear in the state.

    Raises:
        SceneError: If there are such probes, or none at all.
    """
    if not scene.probes:
        raise SceneError(
            f"adjoint: scene '{scene.name}' has no probe; the objective is a function of probes"
        )
    for probe in scene.probes:
        (body,) = scene.bodies_of(probe)
        if isinstance(getattr(body, "model", None), Modal):
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
    """Refuse, before a run, what is no function, or reads what no probe records.

    Raises:
        SceneError: If it is so.
    """
    if not callable(objective):
        raise SceneError(
            f"adjoint: the objective is {objective!r:.40}; it must be a function of histories"
        )
    names = ("t", *(probe.name for probe in scene.probes))
    try:
        objective(Histories({name: np.linspace(0.0, 1.0, 3) for name in names}))
    except SceneError:
        raise
    except Exception:
        return


def evaluated(objective: Objective, history: Mapping[str, Floats]) -> float:
    """The number.

    Raises:
        SceneError: If it is no finite number.
    """
    copied = Histories({name: values.copy() for name, values in history.items()})
    try:
        found: Any = objective(copied)
    except ShellmbError:
        raise
    except Exception as error:
        raise SceneError(f"adjoint: the objective fails: {in_words(error)}") from error
    try:
        value = float(found)
    except (TypeError, ValueError):
        value = np.nan
    if not np.isfinite(value):
        raise SceneError(f"adjoint: the objective is {found!r:.40}; it must be a finite number")
    return value


def slopes(objective: Objective, history: Mapping[str, Floats]) -> dict[str, Floats]:
    """Derivatives of the number by each value of each probe, by differences of fourth order.

    Args:
        objective: The number as a function of the histories.
        history: Values over the steps by probe, and "t".
    """
    found = {}
    for name, values in history.items():
        if name == "t":
            continue
        size = APART * (float(np.abs(values).max()) or 1.0)
        found[name] = np.zeros(len(values))
        for n in range(len(values)):
            for offset, weight in FOURTH:
                moved = Histories({key: array.copy() for key, array in history.items()})
                moved[name][n] += offset * size
                found[name][n] += weight * float(objective(moved)) / size
    return found
