"""Files of states (`.vtu`) read back, if they are as the run wrote them.

VTK believes sizes and offsets, and a file that was cut or spoilt ends the process. So each file has
a checksum of itself, in a comment behind its first line, and what VTK gets is compared with it.
"""

from pathlib import Path

from vtkmodules.vtkCommonDataModel import vtkUnstructuredGrid
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

from shellmb.errors import SceneError
from shellmb.files.checksums import checksum
from shellmb.files.reading import read_bytes


def seal_grid(content: bytes) -> bytes:
    """A file with its checksum.

    Args:
        content: Its content, as VTK writes it.
    """
    first, _, rest = content.partition(b"\n")
    return b"\n".join((first, f"<!-- sha256 {checksum(first + rest)} -->".encode(), rest))


def read_grid(file: Path) -> vtkUnstructuredGrid:
    """The grid of a state, with all its arrays.

    Args:
        file: Its file.

    Raises:
        SceneError: If it is damaged.
    """
    check_grid(file)
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(file))
    reader.Update()
    return reader.GetOutput()


def check_grid(file: Path) -> None:
    """Check a file before VTK reads it.

    Args:
        file: The file.

    Raises:
        SceneError: If it is not as it was written.
    """
    content = read_bytes(file)
    first, _, rest = content.partition(b"\n")
    if seal_grid(first + b"\n" + rest.partition(b"\n")[2]) != content:
        raise SceneError(
            f"{file} is damaged (it does not have its checksum); it must be as the run wrote it"
        )
