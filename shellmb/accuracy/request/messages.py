"""Levels and costs of accuracy in words and in a picture."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import ceil, floor, isfinite, log10
from pathlib import Path

from shellmb.accuracy.family import Change
from shellmb.accuracy.request.choose import Choice, choose
from shellmb.accuracy.request.levels import Level
from shellmb.accuracy.studies.quantity import Quantity
from shellmb.scene import Beam, Scene, Shell


def mesh_label(scene: Scene) -> str:
    """Meshes of a scene: "12x4+8 elements".

    Args:
        scene: The scene.
    """
    return "+".join(dict.fromkeys(_mesh_label(b) for b in scene.meshed if not b.rigid))


def _mesh_label(body: Shell | Beam) -> str:
    times = body.refined_times
    if times is None:
        return "x".join(map(str, body.sides)) + (" elements" if len(body.sides) == 1 else "")
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


@dataclass(frozen=True)
class Offer:
    """Cost of an error.

    Args:
        error: The error, relative.
        seconds: Processor time of the run [s].
        label: Mesh, step and scheme.
        predicted: Whether it was not run.
    """

    error: float
    seconds: float
    label: str
    predicted: bool

    def __str__(self) -> str:
        about = "about " if self.predicted else ""
        return f"{100 * self.error:.2g} %: {about}{seconds(self.seconds)}, {self.label}"


def offers(
    levels: Sequence[Level], accuracy: float, size: float, labelled: Callable[[Change], str]
) -> list[Offer]:
    """Costs of powers of ten of the error, down to a tenth of the required one.

    Args:
        levels: The levels.
        accuracy: The relative error requested.
        size: What errors are relative to.
        labelled: Gives the mesh, the step and the scheme of a level in words.
    """
    known = [level.error for level in levels if isfinite(level.error)]
    worst = max(known, default=0.0) / (size or 1.0)
    first = min(max(ceil(log10(max(worst, accuracy))) - 1, floor(log10(accuracy))), -1)
    last = floor(log10(accuracy * (1 + 1e-9))) - 1
    targets = {10.0**k for k in range(last, first + 1)} | {accuracy, accuracy / 10}
    found = []
    for target in sorted(targets, reverse=True):
        good = [level for level in levels if level.error <= target * size]
        if good:
            best = min(good, key=lambda level: level.seconds)
            found.append(Offer(target, best.seconds, best.label, False))
        elif (choice := choose(list(levels), target * size, farther=True)) is not None:
            found.append(Offer(target, choice.seconds, labelled(choice.change), True))
    return found


def draw(levels: Sequence[Level], found: Sequence[Offer], size: float, file: Path) -> None:
    """Draw error over processor time.

    Args:
        levels: The levels.
        found: Offers; predicted ones are hollow.
        size: What errors are relative to.
        file: The picture.
    """
    from shellmb.observers.drawing import picture

    with picture(file, 6.0, 4.0) as made:
        axes = made.subplots()
        times = [level.seconds for level in levels]
        for name in ("error", "mesh", "step"):
            parts = [getattr(level, name) / (size or 1.0) for level in levels]
            if any(parts):
                style = "o-" if name == "error" else ".--"
                axes.loglog(times, parts, style, label="sum" if name == "error" else name)
        ahead = [offer for offer in found if offer.predicted]
        if ahead:
            at, errors = [o.seconds for o in ahead], [o.error for o in ahead]
            axes.loglog(at, errors, "o", mfc="white", color="C0", label="predicted")
        for level in levels:
            axes.annotate(level.label, (level.seconds, level.error / (size or 1.0)), fontsize=7)
        axes.set(xlabel="processor time of the run [s]", ylabel="relative error [-]")
        axes.legend()
