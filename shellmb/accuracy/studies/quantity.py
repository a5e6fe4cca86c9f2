"""The quantity that a study judges: a result of the scene, or a column of the history."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from scipy.interpolate import CubicSpline

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.scene import Scene
from shellmb.scene.lookup import listed

# one number of a curve, and differences of whole curves
NUMBERS = ("end", "max", "min", "mean")
CURVES = ("l2", "sup")
NORMS = (*NUMBERS, *CURVES)
# points of the curve between two steps, where a largest value is looked for
BETWEEN = 8


@dataclass(frozen=True)
class Quantity:
    """Quantity that is compared.

    Args:
        name: Name of a result, or of a column of the history.
        norm: None for a result. Of a column: "end", "max", "min", "mean" are numbers of the curve,
            "l2" and "sup" compare curves: the root mean square, or the largest, of their difference
            over that of the reference.

    A column is a curve: a cubic spline through its values at the ends of the steps. The curve of
    means over steps, as forces of joints and sections are, goes through values at the middles of
    steps that have these means. So what a large step leaves out between its ends is an error only
    as far as it is lost.
    """

    name: str
    norm: str | None = None

    def __str__(self) -> str:
        return self.name if self.norm is None else f"{self.name}:{self.norm}"

    @property
    def is_curve(self) -> bool:
        """Decide whether whole curves are compared."""
        return self.norm in CURVES

    def take(
        self, results: Mapping[str, float], history: pd.DataFrame, means: Collection[str] = ()
    ) -> dict[str, Any]:
        """Record of a run: the number, and the curve where curves are compared.

        Args:
            results: The results of the scene.
            history: The history of the run.
            means: Names of the columns that are means over a step.

        Raises:
            SceneError: If there is no such quantity.
        """
        if self.norm is None:
            if self.name not in results:
                raise SceneError(_unknown(self.name, results, history))
            return {"value": float(results[self.name])}
        if self.name not in history.columns:
            raise SceneError(_unknown(self.name, results, history))
        return self.of_curve(*curve(history, self.name, self.name in means))

    def of_curve(self, t: Floats, y: Floats) -> dict[str, Any]:
        """Record of a curve.

        Args:
            t: Times, s.
            y: Values.
        """
        if self.is_curve:
            return {"value": float(y[-1]), "t": t.tolist(), "y": y.tolist()}
        return {"value": _number(t, y, self.norm or "end")}

    def difference(self, found: Mapping[str, Any], reference: Mapping[str, Any]) -> float:
        """Difference of a run from another one, relative to that one; absolute if it is zero.

        Args:
            found: What `take` kept of the run.
            reference: What it kept of the other one; without a curve only numbers are compared.
        """
        if not self.is_curve:
            size = abs(reference["value"]) or 1.0
            return abs(found["value"] - reference["value"]) / size
        t, y = np.array(reference["t"]), np.array(reference["y"])
        own = np.array(found["t"])
        inside = (t >= own[0] - 1e-12) & (t <= own[-1] + 1e-12)
        t, y = t[inside], y[inside]
        away = _spline(own, np.array(found["y"]))(t) - y
        if self.norm == "sup":
            return float(np.abs(away).max() / (np.abs(y).max() or 1.0))
        size = float(np.sqrt(np.trapezoid(y**2, t))) or 1.0
        return float(np.sqrt(np.trapezoid(away**2, t))) / size


def parse_quantity(text: str) -> Quantity:
    """A quantity from "NAME" or "COLUMN:NORM".

    Raises:
        SceneError: If there is no such norm.
    """
    name, colon, norm = text.strip().rpartition(":")
    if not colon:
        return Quantity(norm)
    if norm not in NORMS or not name:
        listed = ", ".join(NORMS)
        raise SceneError(
            f"study: quantity is '{text}'; it must be the name of a result, or COLUMN:NORM with "
            f"one of the norms {listed}"
        )
    return Quantity(name, norm)


def default_quantity(scene: Scene, who: str = "study: ", given: str = "--quantity") -> Quantity:
    """The first probe: at the end of a static scene, over time of a dynamic one.

    Args:
        scene: The scene.
        who: Who asks, for the error.
        given: How another one is given.

    Raises:
        SceneError: If there is no probe.
    """
    if not scene.probes:
        raise SceneError(
            f"{who}the scene '{scene.name}' has no probe; give {given}, a name of its results "
            "or COLUMN:NORM of its history"
        )
    return Quantity(scene.probes[0].name, "end" if scene.static else "l2")


def curve(history: pd.DataFrame, name: str, mean: bool = False) -> tuple[Floats, Floats]:
    """Times and values of a column; of means over a step the values at its middle.

    These are the slopes of a cubic spline through the integral, of fourth order there; a mean in
    place of a value would be an error of second order of any scheme.

    Args:
        history: The history of a run.
        name: Name of the column.
        mean: Whether its values are means over a step; the first one, at the start, is then no
            part of the curve.
    """
    t = history["t"].to_numpy(dtype=float)
    y = history[name].to_numpy(dtype=float)
    if mean and len(t) > 2 and np.isfinite(y[1:]).all():
        integral = CubicSpline(t, np.concatenate([[0.0], np.cumsum(y[1:] * np.diff(t))]))
        t = (t[1:] + t[:-1]) / 2
        return t, np.asarray(integral(t, 1))
    known = np.isfinite(y)
    return t[known], y[known]


def _spline(t: Floats, y: Floats) -> Any:
    return CubicSpline(t, y) if len(t) > 1 else (lambda times: np.full_like(times, y[0]))


def _number(t: Floats, y: Floats, norm: str) -> float:
    if norm == "end" or len(t) < 2:
        return float(y[-1])
    if norm == "mean":
        return float(_spline(t, y).integrate(t[0], t[-1]) / (t[-1] - t[0]))
    k = int(y.argmax() if norm == "max" else y.argmin())
    if k in (0, len(t) - 1):
        # a cubic goes beyond the start of a motion from rest, which the motion does not
        return float(y[k])
    steps = np.arange(BETWEEN * (len(t) - 1) + 1) / BETWEEN
    fine = _spline(t, y)(np.interp(steps, np.arange(len(t)), t))
    return float(fine.max() if norm == "max" else fine.min())


def _unknown(name: str, results: Mapping[str, float], history: pd.DataFrame) -> str:
    return (
        f"study: quantity is '{name}'; it must be one of the scene's results, "
        f"{listed(results) or 'none'}, or COLUMN:NORM with a column of the history, "
        f"{listed(history.columns)}"
    )
