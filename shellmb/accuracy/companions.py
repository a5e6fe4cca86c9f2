"""Companions of a scene: the same with larger steps, and with other elements."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from shellmb.errors import SceneError
from shellmb.scene import GmshFile, MeshFile, Scene

# of a tolerance by which steps are chosen, in place of twice the step
LOOSER = 10.0
# a motion is resolved by so many steps at least
FEWEST = 10


def with_steps(scene: Scene, doublings: int) -> Scene:
    """The scene with larger steps; with a larger tolerance where steps are chosen by one.

    Args:
        scene: The scene.
        doublings: How often the step is doubled.

    Raises:
        SceneError: If it is impossible.
    """
    control = scene.control
    if control.tolerance is not None:
        tolerance = min(control.tolerance * LOOSER**doublings, 0.5)
        return replace(scene, control=replace(control, tolerance=tolerance))
    times = 2**doublings
    limits = {"min_dt": control.min_dt, "max_dt": control.max_dt}
    changes: dict[str, Any] = {k: v * times for k, v in limits.items() if v is not None}
    assert scene.dt is not None
    return replace(scene, dt=scene.dt * times, control=replace(control, **changes))


def doublings_of_meshes(scene: Scene) -> int:
    """How often the step may be doubled where two meshes are compared, at most three times.

    Args:
        scene: The scene.
    """
    assert scene.dt is not None and scene.t_end is not None
    steps = scene.t_end / scene.dt
    return next((n for n in (3, 2, 1) if steps >= FEWEST * 2**n), 0)


def degree_of(scene: Scene) -> int | None:
    """Least degree of the elements; None without shells and beams that deform.

    Args:
        scene: The scene.
    """
    return min((b.degree for b in scene.meshed if b.model != "rigid"), default=None)


def with_other_degree(scene: Scene) -> Scene:
    """The scene with elements of degree 3 in place of 2, or of 2 in place of 3.

    Args:
        scene: The scene, with elements.

    Raises:
        SceneError: If it is impossible: nodes are at other places.
    """
    return scene.with_options(degree=3 if degree_of(scene) == 2 else 2)


def with_twice_the_elements(scene: Scene) -> Scene:
    """The scene with twice the elements along each side, whose nodes stay nodes.

    Args:
        scene: The scene, with elements.

    Raises:
        SceneError: If a mesh is read from a file.
    """
    for shell in scene.shells:
        if isinstance(shell.surface, GmshFile | MeshFile):
            raise SceneError(f"the mesh of '{shell.name}' is read from a file and stays as it is")
    shells = tuple(replace(s, mesh=(2 * s.mesh[0], 2 * s.mesh[1])) for s in scene.shells)
    beams = tuple(replace(b, elements=2 * b.elements) for b in scene.beams)
    return replace(scene, shells=shells, beams=beams)
