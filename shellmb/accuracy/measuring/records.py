"""Measurements as JSON, in a folder or on stdout."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from shellmb.files.plain import plain
from shellmb.files.writing import write_text


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
