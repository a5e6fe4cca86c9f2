"""States of a scene in motion as bytes: arrays and JSON, so that reading them executes nothing."""

from __future__ import annotations

import io
import json
from typing import Any

import numpy as np

from shellmb.files.checksums import as_list

REST = "rest"


def to_bytes(state: Any) -> bytes:
    """Bytes of a state of a `SceneMotion`.

    Args:
        state: As from its `state`.
    """
    arrays, rest = state
    plain = json.dumps(rest, default=as_list).encode()
    file, text = io.BytesIO(), np.frombuffer(plain, dtype=np.uint8)
    found: dict[str, Any] = {REST: text, **{f"/{name}": array for name, array in arrays.items()}}
    np.savez(file, **found)
    return file.getvalue()


def from_bytes(given: bytes) -> Any:
    """A state again.

    Args:
        given: As from `to_bytes`.
    """
    with np.load(io.BytesIO(given)) as found:
        arrays = {name.removeprefix("/"): found[name] for name in found.files if name != REST}
        return arrays, json.loads(found[REST].tobytes())
