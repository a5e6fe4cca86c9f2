"""`all.pvd`: all files of all bodies at all times, which ParaView opens at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from xml.sax.saxutils import quoteattr

from shellmb.observers.files.gridfiles import GridFiles
from shellmb.observers.files.growingfile import GrowingFile

HEAD = (
    '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n'
    "<Collection>\n"
)
END = "\n</Collection>\n</VTKFile>\n"


class Collection:
    """The list of the files, complete at all times; VTK has a reader for it and no writer.

    Args:
        path: The file.
        files: Files of each part by its name.
    """

    def __init__(self, path: Path, files: Mapping[str, GridFiles]) -> None:
        self._path, self._files = path, files
        self._list: GrowingFile | None = None
        self._listed: set[int] = set()

    def list(self, times: Sequence[float]) -> None:
        """Add the states that are not in it and that all parts have.

        Args:
            times: Times of all states so far.
        """
        if self._list is None:
            self._list = GrowingFile(self._path, HEAD, "\n", END)
        new = [
            k
            for k in range(len(times))
            if k not in self._listed and all(f.has(k) for f in self._files.values())
        ]
        items = [
            f'<DataSet timestep="{times[k]!r}" part="{part}" name={quoteattr(name)} '
            f"file={quoteattr(files.file(k).name)}/>"
            for k in new
            for part, (name, files) in enumerate(self._files.items())
        ]
        if items:
            self._list.add(items)
            self._listed |= set(new)

    def close(self) -> None:
        """Close it."""
        if self._list is not None:
            self._list.close()
            self._list = None
