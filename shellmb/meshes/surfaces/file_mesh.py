"""Meshes read from files: Nastran's and Abaqus' by readers of our own, others by meshio."""

from __future__ import annotations

from shellmb.errors import SceneError
from shellmb.meshes.files.abaqus import read_abaqus
from shellmb.meshes.files.meshio_files import read_meshio
from shellmb.meshes.files.nastran import is_nastran, read_nastran
from shellmb.meshes.files.shellmesh import shell_mesh
from shellmb.meshes.raw import RawMesh
from shellmb.scene import MeshFile, Shell

__all__ = ["file_mesh"]

# endings that are Nastran's, and such as may be
NASTRAN, PERHAPS = {".bdf", ".nas", ".fem"}, {".dat"}


def file_mesh(shell: Shell) -> RawMesh:
    """Read the shell's mesh.

    Args:
        shell: A shell with a :class:`MeshFile`.

    Raises:
        SceneError: If the file cannot be read, or what it has makes no shell.
    """
    surface = shell.surface
    assert isinstance(surface, MeshFile)
    path, ending = surface.path, surface.path.suffix.lower()
    who = f"shell '{shell.name}': {path}"
    try:
        if ending in NASTRAN or (ending in PERHAPS and is_nastran(path)):
            found = read_nastran(path, who)
        elif ending == ".inp":
            found = read_abaqus(path, who)
        else:
            found = read_meshio(path, f"shell '{shell.name}'")
    except OSError as error:
        raise SceneError(f"{who} is not read ({error.strerror})") from error
    return shell_mesh(found, shell, surface.group)
