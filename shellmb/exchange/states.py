"""States of a scene in motion as bytes: arrays and JSON, so that reading them executes nothing."""

from __future__ import annotations

import io
import json
from dataclasses import asdict
from typing import Any

import numpy as np

from shellmb.simulate.stepping import StepInfo
from shellmb.system.direct.solver import Factors

REST = "rest"


def to_bytes(state: Any) -> bytes:
    """Bytes of a state of a `SceneMotion`.

    Args:
        state: As from its `state`.
    """
    outputs, arrays, simulation, observers, last, before, lines, factors = state
    rest = {
        "outputs": outputs,
        "simulation": simulation,
        "observers": observers,
        "last": None if last is None else asdict(last),
        "before": before,
        "lines": lines,
        "factors": None if factors is None else factors.value,
    }
    file = io.BytesIO()
    text = np.frombuffer(json.dumps(rest).encode(), dtype=np.uint8)
    np.savez(file, **{f"/{name}": array for name, array in arrays.items()}, **{REST: text})
    return file.getvalue()


def from_bytes(given: bytes) -> Any:
    """A state again.

    Args:
        given: As from `to_bytes`.
    """
    with np.load(io.BytesIO(given)) as found:
        arrays = {name.removeprefix("/"): found[name] for name in found.files if name != REST}
        rest = json.loads(found[REST].tobytes())
    last, factors = rest["last"], rest["factors"]
    return (
        rest["outputs"],
        arrays,
        rest["simulation"],
        [(kept, None if mark is None else tuple(mark)) for kept, mark in rest["observers"]],
        None if last is None else StepInfo(**last),
        rest["before"],
        rest["lines"],
        None if factors is None else Factors(factors),
    )
