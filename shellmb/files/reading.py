"""Files that are read only if they are files, and no larger than what memory can take.

What a directory calls a file may be a link to one without an end, or a pipe that nobody writes.
"""

import io
import json
import os
import stat
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from shellmb.errors import SceneError

# part of the memory that one file may take, and what a file of JSON may be long [bytes]
SHARE, JSON = 0.25, 200_000_000
# what is raised where the content of a file is not as expected; pydantic's errors are of values
_WRONG = (ValueError, TypeError, KeyError, RecursionError, EOFError, OSError, zipfile.BadZipFile)


class Damaged(SceneError):
    """A file that is not what was written, or cannot be read; the text says which and how."""


@contextmanager
def undamaged(file: Path) -> Iterator[None]:
    """Context in which the content of a file is taken as it was written.

    Args:
        file: The file.

    Raises:
        Damaged: If it is otherwise.
    """
    try:
        yield
    except _WRONG as error:
        raise Damaged(f"{file} is damaged ({_first(error)})") from None


def read_bytes(file: Path, most: float | None = None) -> bytes:
    """The content of a file.

    Args:
        file: The file.
        most: How long it may be, bytes; None: a part of this machine's memory.

    Raises:
        Damaged: If it is no file, too long, or cannot be read.
    """
    try:
        found = file.stat()
        if not stat.S_ISREG(found.st_mode):
            raise Damaged(f"{file} is damaged (it is no file, but a folder, a device or a pipe)")
        memory = SHARE * os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
        limit = memory if most is None else min(most, memory)
        if found.st_size > limit:
            raise Damaged(
                f"{file} is damaged (it has {found.st_size:.3g} bytes, and at most {limit:.3g} are "
                "read)"
            )
        return file.read_bytes()
    except OSError as error:
        raise Damaged(f"{file} cannot be read ({error.strerror})") from None


def read_json(file: Path) -> dict[str, Any]:
    """The table in a file of JSON.

    Args:
        file: The file.

    Raises:
        Damaged: If it is no such file.
    """
    with undamaged(file):
        values = json.loads(read_bytes(file, JSON))
    if not isinstance(values, dict):
        raise Damaged(f"{file} is damaged (it holds no table)")
    return values


def read_series(file: Path) -> dict[Path, float]:
    """Files of states with their times.

    Args:
        file: The list of them, which stands beside them.

    Raises:
        Damaged: If it is no such list.
    """
    with undamaged(file):
        entries = read_json(file)["files"]
        found = {file.parent / Path(e["name"]).name: float(e["time"]) for e in entries}
    return found


def unpacked(file: Path, content: bytes) -> dict[str, Any]:
    """The arrays of a state, by name.

    No run writes numbers there that are not finite: those are found whatever their checksum.

    Args:
        file: Their file.
        content: Its content.

    Raises:
        Damaged: If it holds no arrays, or some of their numbers are not finite.
    """
    with undamaged(file), np.load(io.BytesIO(content), allow_pickle=False) as archive:
        check_archive(archive.zip, len(content))
        arrays = {key: archive[key] for key in archive.files}
    for key, array in arrays.items():
        if array.dtype.kind in "fc" and not np.isfinite(array).all():
            raise Damaged(f"{file} is damaged (its array '{key}' has a value that is not finite)")
    return arrays


def check_archive(archive: zipfile.ZipFile, packed: int) -> None:
    """Refuse an archive of arrays that are written as they are, whose sizes do not say so.

    Args:
        archive: It.
        packed: Bytes of the whole of it.

    Raises:
        ValueError: If it would become larger than it is.
    """
    items = archive.infolist()
    if any(i.compress_type != zipfile.ZIP_STORED for i in items) or (
        sum(i.file_size for i in items) > packed
    ):
        raise ValueError("its arrays are not as long as it says")


def _first(error: Any) -> str:
    """Text of an error, of pydantic's report that of the first one."""
    if not hasattr(error, "errors"):
        return str(error)
    first = error.errors(include_url=False)[0]
    where = ".".join(map(str, first["loc"]))
    return f"{where}: {first['msg']}" if where else str(first["msg"])
