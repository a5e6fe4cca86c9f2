"""Files that are written whole or not at all, never through a link, and sealed by checksums.

A run directory may come from somebody else, and what looks like a file in it may be a link to any
file of the user's. So a file is written under a name of its own and takes its place in one go: what
stood there, a file or a link, is replaced, and what a link points to is left alone.
"""

import ctypes
import hashlib
import json
import math
import os
import stat
import uuid
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from operator import methodcaller
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from shellmb.errors import RunError

NEW = os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
# of the C library of Linux: files by their names, which change places
_CHANGE = getattr(ctypes.CDLL(None), "renameat2", None)
HERE, EXCHANGE = -100, 2

# name, in a JSON file, of the checksum of all the rest
CHECKSUM = "sha256"


@contextmanager
def drafted(file: Path, place: Callable[[Path, Path], object] | None = None) -> Iterator[Path]:
    """A new empty file beside another one, whose place it takes at the end, unless that fails.

    Args:
        file: The file.
        place: Puts the new file in the place of the other one; None: by its name.
    """
    draft = file.with_name(f".{uuid.uuid4().hex[:12]}{file.suffix}")
    os.close(os.open(draft, NEW, 0o666))
    try:
        yield draft
        (place or Path.replace)(draft, file)
    except BaseException:
        draft.unlink(missing_ok=True)
        raise


def write_bytes(file: Path, content: bytes) -> None:
    """Write a file.

    Args:
        file: The file.
        content: Its content.
    """
    with drafted(file) as draft:
        draft.write_bytes(content)


def write_text(file: Path, text: str) -> None:
    """Write a file.

    Args:
        file: The file.
        text: Its content.
    """
    write_bytes(file, text.encode())


def rewrite_text(file: Path, text: str) -> None:
    """Write a file that is written again and again, and is whole at any time.

    A rename onto a file waits for the disk (ext4: 3 ms), so that a power failure leaves one of
    both; files that change places do not. So it is for what can be made anew.

    Args:
        file: The file.
        text: Its content.
    """
    # what is cut to nothing and written waits for the disk, too
    with drafted(file, _exchange) as draft, draft.open("r+b") as new:
        new.write(text.encode())


def _exchange(draft: Path, file: Path) -> None:
    names = HERE, os.fsencode(draft), HERE, os.fsencode(file)
    if _CHANGE is None or not file.is_file() or file.is_symlink() or _CHANGE(*names, EXCHANGE):
        draft.replace(file)
    else:
        draft.unlink()


def open_new(file: Path) -> BinaryIO:
    """A new file in the place of whatever stands there, to be written bit by bit.

    Args:
        file: The file.
    """
    file.unlink(missing_ok=True)
    return os.fdopen(os.open(file, NEW, 0o666), "r+b")


def is_plain(file: Path) -> bool:
    """Decide whether something is a file that has no other name: no link, device or pipe.

    Args:
        file: Its name.

    Raises:
        FileNotFoundError: If there is nothing.
    """
    found = file.lstat()
    return stat.S_ISREG(found.st_mode) and found.st_nlink == 1


def make_folder(folder: Path) -> None:
    """Make a folder to write to, which is no link to another one.

    Args:
        folder: The folder, within a directory of ours.

    Raises:
        RunError: If a link stands there.
    """
    folder.mkdir(parents=True, exist_ok=True)
    if folder.is_symlink():
        raise RunError(
            f"{folder} is a link, and files would be written where it points to; put a folder "
            "there",
            alone=True,
        )


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
    if isinstance(value, np.generic | np.ndarray):
        return plain(value.tolist(), **renamed)
    return None if isinstance(value, float) and not math.isfinite(value) else value


def checksum(content: bytes) -> str:
    """SHA-256 of the content of a file.

    Args:
        content: It.
    """
    return hashlib.sha256(content).hexdigest()


def add_checksum(values: Mapping[str, Any]) -> dict[str, Any]:
    """Values of a JSON file with their checksum.

    Args:
        values: Plain values; a checksum among them does not count.
    """
    plain = {name: value for name, value in values.items() if name != CHECKSUM}
    text = json.dumps(plain, sort_keys=True, default=methodcaller("tolist"))
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
