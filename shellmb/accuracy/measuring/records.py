"""Measurements as JSON, in a folder or on stdout."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

from shellmb.files.writing import write_text


def plain(value: Any, **renamed: str) -> Any:
    """Values that JSON knows: no dataclasses, and null for what is not finite.

    Args:
        value: Numbers, texts, containers of them, dataclasses; one with a `to_dict` says itself
            what is kept of it.
        renamed: Names of fields that are called otherwise in JSON, where Python has a word for it.
    """
    if hasattr(value, "to_dict"):
        value = value.to_dict()
    if is_dataclass(value):
        value = {f.name: getattr(value, f.name) for f in fields(value)}
    if isinstance(value, dict):
        return {renamed.get(key, key): plain(item, **renamed) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item, **renamed) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def to_json(value: Any, **renamed: str) -> str:
    """Plain values as JSON (`plain`)."""
    return json.dumps(plain(value, **renamed), indent=1, allow_nan=False)


def write(name: str, text: str, draw: Callable[[Path], None] | None, folder: Path) -> None:
    """Write `NAME.json`, and `NAME.png` where there is something to draw; on the first rank.

    Args:
        name: What the files are called.
        text: The JSON.
        draw: Draws the picture into a file.
        folder: Where; made if it is not there.
    """
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / f"{name}.json", text + "\n")
    if draw is not None:
        draw(folder / f"{name}.png")
