"""Levels in words: mesh, step and scheme, errors, times."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import isfinite

from shellmb.accuracy.companions import Change
from shellmb.accuracy.request.choose import Choice
from shellmb.accuracy.request.levels import Level
from shellmb.accuracy.studies.quantity import Quantity
from shellmb.scene import Scene, Shell
from shellmb.scene.shells.shell import refined_times


def mesh_label(scene: Scene) -> str:
    """Meshes of a scene: "12x4+8 elements".

    Args:
        scene: The scene.
    """
    counts = [
        _shell_label(body) if isinstance(body, Shell) else f"{body.elements} elements"
        for body in scene.meshed
        if body.model != "rigid"
    ]
    return "+".join(dict.fromkeys(counts))


def _shell_label(shell: Shell) -> str:
    times = refined_times(shell)
    if times is None:
        return f"{shell.mesh[0]}x{shell.mesh[1]}"
    return "mesh of the file" + (f" divided by {times}" if times > 1 else "")


def label(scene: Scene) -> str:
    """Mesh, step and scheme of a scene: "12x4, dt = 0.001, ep4".

    Args:
        scene: The scene.
    """
    mesh = mesh_label(scene)
    step = f"dt = {scene.dt:.4g}"
    if scene.step_control.step_error is not None:
        step = f"step error {scene.step_control.step_error:.3g}"
    steps = [] if scene.static and scene.path is None else [step]
    return ", ".join([*([mesh] if mesh else []), *steps, scene.scheme_name])


def line(
    levels: Sequence[Level],
    quantity: Quantity,
    size: float,
    following: Choice | None,
    labelled: Callable[[Change], str],
) -> str:
    """The progress of a request in one line.

    Args:
        levels: Its levels.
        quantity: What is judged.
        size: What errors are relative to.
        following: The next level; None: there is none.
        labelled: Gives the mesh, the step and the scheme of a level in words.
    """
    level = levels[-1]
    parts = {"mesh": level.mesh, "step": level.step, "others": level.others}
    due = ", ".join(f"{k} {percent(v, size)}" for k, v in parts.items() if v)
    said = (
        f"level {len(levels)}: {level.label}: {quantity} = {level.value:.6g} "
        f"+- {percent(level.error, size)} ({due}), {seconds(level.total)} so far"
    )
    if following is None:
        return said
    return f"{said}; next: {labelled(following.change)}, {seconds(following.seconds)}"


def percent(error: float, size: float) -> str:
    """A relative error.

    Args:
        error: The error.
        size: What it is relative to.
    """
    return f"{100 * error / (size or 1.0):.2g} %" if isfinite(error) else "not known"


def seconds(value: float) -> str:
    """A time in few digits.

    Args:
        value: The time [s].
    """
    if value < 0.1:
        return f"{1000 * value:.2g} ms"
    return f"{value:.2g} s" if value < 100 else f"{value:.0f} s"
