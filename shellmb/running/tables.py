"""Reads the JSON files of a run directory."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import ValidationError

from shellmb.errors import SceneError
from shellmb.files.reading import read_json


class Damaged(Exception):
    """A file of a run directory is not what the run wrote; the text says which and how."""


def read_table(file: Path) -> dict[str, Any]:
    """The values of a JSON file.

    Args:
        file: The file.

    Raises:
        Damaged: If it is none.
    """
    try:
        return read_json(file)
    except SceneError as error:
        raise Damaged(str(error)) from None


def first_error(error: ValidationError) -> str:
    """First error of a file, from pydantic's report.

    Args:
        error: It.
    """
    first = error.errors(include_url=False)[0]
    where = ".".join(map(str, first["loc"]))
    return f"{where}: {first['msg']}" if where else str(first["msg"])
