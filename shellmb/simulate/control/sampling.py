"""Controllers in a run: when they are sampled, what they answer, and their memory."""

import copy
import math
import traceback
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mpi4py import MPI

import numpy as np

from shellmb.errors import ControlError
from shellmb.model.signals import Signals
from shellmb.restart import Restartable
from shellmb.scene.control.controllers import Law
from shellmb.scene.lookup import said
from shellmb.scene.values.validate import in_words, show

# a sample is due from this part of its period before it
ROUND_OFF = 1e-9
# how values are kept that JSON does not know
ARRAY, TUPLE, DICT = "array", "tuple", "dict"


class Sampler(Restartable):
    """A controller in a run.

    Args:
        law: The controller.

    Attributes:
        readings: What its sensors read at the last sample, by their names.
        outputs: What it gave, by name.
    """

    remembered = ("readings", "outputs", "_count", "_last")

    def __init__(self, law: Law) -> None:
        self.law = law
        self.readings = {sensor.name: math.nan for sensor in law.sensors}
        self.outputs = dict.fromkeys(law.outputs, 0.0)
        self._memory: Any = copy.deepcopy(law.state)
        self._count = 0
        self._last: float | None = None

    @property
    def next(self) -> float:
        """Time of the next sample, s; infinite where it is sampled at every step."""
        return math.inf if self.law.period is None else self._count * self.law.period

    def due(self, t: float) -> bool:
        """Decide whether a sample is due before a step that begins at a time [s]."""
        period = self.law.period
        return period is None or t >= self.next - ROUND_OFF * period

    def ask(self, t: float, read: Mapping[str, float], comm: MPI.Comm) -> bool:
        """Take a sample; collective.

        Args:
            t: Time, s.
            read: What all sensors read.
            comm: Communicator: the law is evaluated on the first rank.

        Returns:
            Whether the outputs of a controller that holds them have changed.

        Raises:
            ControlError: If the law fails, or gives something else than finite numbers.
        """
        self.readings = {label: read[label] for label in self.readings}
        found: Any = None
        wrong: str | None = None
        if comm.rank == 0:
            try:
                found = self._answer(t)
            except (Exception, SystemExit) as error:
                wrong = f"{said(self.law)} at t = {t:.9g}: {self._error_origin(error)}"
        if comm.size > 1:
            found, wrong = comm.bcast((found, wrong))
        if wrong is not None:
            raise ControlError(wrong)
        outputs, self._memory = found
        changed = outputs != self.outputs and self.law.period is not None
        self.outputs = outputs
        self._count, self._last = self._count + 1, t
        return changed

    def _answer(self, t: float) -> tuple[dict[str, float], Any]:
        since = 0.0 if self._last is None else t - self._last
        readings = np.array(list(self.readings.values()))
        answer = self.law.act(t, readings, self._memory, since)
        if not (isinstance(answer, tuple) and len(answer) == 2):
            raise _Wrong(f"its law gives {show(answer)}; it must give outputs, state")
        given, memory = answer
        names = self.law.outputs
        try:
            values = np.atleast_1d(np.asarray(given, dtype=float)).ravel()
        except (TypeError, ValueError):
            raise _Wrong(f"its outputs are {show(given)}; they must be numbers") from None
        if len(values) != len(names):
            raise _Wrong(
                f"its law gives {len(values)} outputs; it must give {len(names)}: "
                f"{', '.join(names)}"
            )
        outputs = dict(zip(names, values.tolist(), strict=True))
        for name, value in outputs.items():
            if not math.isfinite(value):
                read = ", ".join(f"{label} = {v:.6g}" for label, v in self.readings.items())
                raise _Wrong(
                    f"its output '{name}' is {value}, where {read}; it must be a finite number"
                )
        # refused here, and not when it is to be saved
        packed(memory)
        return outputs, memory

    def _error_origin(self, error: BaseException) -> str:
        if isinstance(error, _Wrong):
            return str(error)
        frame = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{Path(frame.filename).name}, line {frame.lineno}"
        return f"its law fails ({where}: {in_words(error)}); it must give outputs, state"

    def command(self, t: float, signals: Signals) -> None:
        """Hold the outputs from a time [s] on."""
        for name, value in self.outputs.items():
            signals.command(t, (self.law.name, name), value)

    def state(self) -> dict[str, Any]:
        """State for a restart."""
        return super().state() | {"memory": packed(self._memory)}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take up a saved state."""
        super().restore(state)
        self._memory = unpacked(state["memory"])


class _Wrong(Exception):
    """Error of a law that gave what it must not."""


def packed(value: Any) -> Any:
    """A controller's memory for JSON.

    Raises:
        _Wrong: If it holds anything that cannot be saved.
    """
    if value is None or isinstance(value, bool | int | float | str):
        # also numbers of NumPy that are floats of Python by their class
        return float(value) if isinstance(value, np.floating) else value
    if isinstance(value, np.ndarray | np.generic) and np.asarray(value).dtype.kind in "biuf":
        array = np.asarray(value)
        return {ARRAY: array.tolist(), "dtype": array.dtype.str, "shape": list(array.shape)}
    if isinstance(value, tuple):
        return {TUPLE: [packed(v) for v in value]}
    if isinstance(value, list):
        return [packed(v) for v in value]
    if isinstance(value, dict) and all(isinstance(k, str) for k in value):
        return {DICT: {k: packed(v) for k, v in value.items()}}
    raise _Wrong(
        f"its state holds {show(value)}, which cannot be saved; it must be made of numbers, texts, "
        "arrays of numbers, and lists, tuples and dicts of these"
    )


def unpacked(value: Any) -> Any:
    """A memory from what was saved.

    Args:
        value: As from `packed`.
    """
    if isinstance(value, list):
        return [unpacked(v) for v in value]
    if not isinstance(value, dict):
        return value
    if ARRAY in value:
        array = np.array(value[ARRAY], dtype=value["dtype"]).reshape(value["shape"])
        return array if value["shape"] else array[()]
    if TUPLE in value:
        return tuple(unpacked(v) for v in value[TUPLE])
    return {k: unpacked(v) for k, v in value[DICT].items()}
