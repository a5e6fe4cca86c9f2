"""Checksums of what a run goes on with."""

import hashlib
import json
from collections.abc import Mapping
from typing import Any

# name, in a JSON file, of the checksum of all the rest
CHECKSUM = "sha256"


def checksum(content: bytes) -> str:
    """SHA-256 of the content of a file.

    Args:
        content: It.
    """
    return hashlib.sha256(content).hexdigest()


def as_list(array: Any) -> Any:
    """An array for JSON.

    Args:
        array: It.
    """
    return array.tolist()


def add_checksum(values: Mapping[str, Any]) -> dict[str, Any]:
    """Values of a JSON file with their checksum.

    Args:
        values: Plain values; a checksum among them does not count.
    """
    plain = {name: value for name, value in values.items() if name != CHECKSUM}
    text = json.dumps(plain, sort_keys=True, default=as_list)
    return {**plain, CHECKSUM: checksum(text.encode())}


def is_intact(values: Mapping[str, Any]) -> bool:
    """Decide whether values that were read have the checksum that they were written with.

    Args:
        values: They.
    """
    return values.get(CHECKSUM) == add_checksum(values)[CHECKSUM]


def seal_grid(content: bytes) -> bytes:
    """A file of a grid with its checksum, in a comment behind its first line.

    Args:
        content: Its content, which is XML.
    """
    first, _, rest = content.partition(b"\n")
    return b"\n".join((first, f"<!-- sha256 {checksum(first + rest)} -->".encode(), rest))
