"""Meshes of shells with more elements along each side, between whose nodes the old nodes stay."""

from __future__ import annotations

from dataclasses import replace

from shellmb.scene.shells.gmsh_surfaces import CAD, GmshFile, MeshFile
from shellmb.scene.shells.shell import Shell


def refined_times(shell: Shell) -> int | None:
    """Elements along a side of each one of the mesh's file; None of meshes that are made anew.

    Args:
        shell: The shell.
    """
    surface = shell.surface
    cad = isinstance(surface, GmshFile) and surface.path.suffix.lower() in CAD
    return None if cad or not isinstance(surface, GmshFile | MeshFile) else surface.refine


def divided(shell: Shell, times: int) -> Shell:
    """The shell with more elements: those of a file are divided, others are made anew.

    Args:
        shell: The shell.
        times: So many elements replace one along each side.

    Raises:
        SceneError: If there is no such mesh.
    """
    surface, refined = shell.surface, refined_times(shell)
    if isinstance(surface, GmshFile | MeshFile) and refined is not None:
        return replace(shell, surface=replace(surface, refine=times * refined))
    return replace(shell, mesh=(times * shell.mesh[0], times * shell.mesh[1]))
