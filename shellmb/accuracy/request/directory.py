"""A request in its directory, begun or gone on with.

Levels are in folders of their own, the last one is the run itself.
"""

import shutil
from dataclasses import asdict, fields, replace
from math import isfinite
from pathlib import Path
from typing import Any

from shellmb.accuracy.family import sides_of, with_fewer
from shellmb.accuracy.request.levels import (
    KEPT,
    LEVELS,
    Store,
    Target,
    UnknownQuantity,
    frequency_number,
)
from shellmb.accuracy.request.messages import draw, offers
from shellmb.accuracy.request.search import ModeSearch, Outcome, Running, Search
from shellmb.errors import SceneError, Stopped, of_first
from shellmb.files.locks import is_temporary
from shellmb.files.reading import read_json, undamaged
from shellmb.observers.summary import write_json
from shellmb.options.run import ACCURACY, AccuracyOptions
from shellmb.running.directory import LOCK, claimed, refuse_used, written
from shellmb.running.request import REQUEST, resume_command
from shellmb.running.standard import SUMMARY
from shellmb.scene import Scene
from shellmb.scene.fingerprint import differences, fingerprint

# picture in the directory
PICTURE = "accuracy.png"
# elements along a side of which half are enough to tell anything
FEW = 4
# what belongs to the request and not to its last run
OWN = {LOCK, ACCURACY, REQUEST, LEVELS, PICTURE}


def run_to_accuracy(
    scene: Scene, wanted: AccuracyOptions, out: Path, how: Running, pictures: bool = True
) -> Outcome:
    """Run levels of a scene until an error is met; the last one is the run in the directory.

    A request that was stopped, or asks for less or more now, goes on from its levels.

    Args:
        scene: The scene.
        wanted: What is requested.
        out: The directory.
        how: How levels are run.
        pictures: Whether pictures are drawn.

    Raises:
        SceneError: If there is no such quantity, the scene is impossible, or `out` holds something
            else.
        ConvergenceError: If the scene fails at all steps of the first level.
        Stopped: If a signal ended a level; those before it are kept.
    """
    comm = how.comm
    requested = _understood(scene, Target(**vars(wanted)), how)
    with claimed(out, comm, new=False):
        stored, begun = of_first(comm, lambda: (_stored(out), _has_levels(out)))
        other = "" if stored is None else _difference(stored, scene, requested)
        if stored is None:
            refuse_used(out, comm)
        elif other and begun:
            raise SceneError(
                f"out is {out}, which holds levels of another request ({other}); give another "
                "directory"
            )
        elif other and comm.rank == 0:
            # that request was refused, or ended in its first level
            shutil.rmtree(out / LEVELS, ignore_errors=True)
        about: dict[str, Any] = asdict(requested) | {"scene": fingerprint(scene), "met": None}
        if comm.rank == 0:
            with written(out, comm):
                _put_back(out, stored)
                write_json(out / ACCURACY, about)
                if how.request is not None:
                    write_json(out / REQUEST, how.request.to_dict())
        comm.Barrier()
        try:
            search, outcome = _search(scene, requested, out, how)
        except Stopped as error:
            says = f"{resume_command(out, how.request)} repeats the level it was in"
            if is_temporary(out):
                says = "nothing of it is left when Python ends; give out to go on later"
            raise Stopped(error.signal, says) from None
        size = search.size
        found = offers(outcome.levels, requested.accuracy, size, search.label)
        about |= asdict(search.wanted) | {
            "met": outcome.met,
            "says": outcome.says,
            "quantity": str(search.quantity),
            "size": size,
            "levels": [asdict(level) for level in outcome.levels],
            "offers": [asdict(offer) | {"says": str(offer)} for offer in found],
        }
        if comm.rank == 0:
            with written(out, comm):
                # before the files of the last level, of which it says what they are: a request that
                # is stopped among them puts them back
                write_json(out / ACCURACY, about)
                _move(out / LEVELS / str(len(outcome.levels)), out)
                if pictures:
                    _draw(out, outcome, size, found)
        comm.Barrier()
    run = None if outcome.run is None else replace(outcome.run, out=out)
    return replace(outcome, run=run)


def wanted_in(out: Path) -> Target:
    """Request stored in a directory.

    Args:
        out: The directory.

    Raises:
        SceneError: If the file of the request is damaged.
    """
    stored = read_json(out / ACCURACY)
    with undamaged(out / ACCURACY):
        found = Target(**{f.name: stored[f.name] for f in fields(Target) if f.name in stored})
    return found


def coarser(scene: Scene, body: str | None) -> Scene | None:
    """The scene with half the elements along each side; None where there is no such mesh.

    Args:
        scene: The scene.
        body: The only body that gets them; None: all.
    """
    chosen = [b for b in scene.meshed if body in (None, b.name)]
    read = any(s.surface.of_file for s in scene.shells if s in chosen)
    if read or min(sides_of(chosen), default=0) < FEW:
        return None
    try:
        return with_fewer(scene, 2, body)
    except SceneError:
        return None


def _understood(scene: Scene, wanted: Target, how: Running) -> Target:
    """Parse what is wanted; "f1" is of modes if the scene has no probe or results of that name.

    Raises:
        SceneError: If there is no such quantity, as far as is known before a run.
    """
    try:
        wanted.quantity(scene, measures=how.results is not None)
    except UnknownQuantity:
        if frequency_number(wanted.of) is None or not how.modes:
            raise
        return replace(wanted, modes=True)
    return wanted


def _search(scene: Scene, wanted: Target, out: Path, how: Running) -> tuple[Search, Outcome]:
    """Search from half the mesh, or from the scene's own where places are no nodes of that.

    Then the same for modes, where no result of a run has the name of a frequency.
    """
    half = coarser(scene, wanted.body)
    begins = [(half, "half")] if half is not None else []
    begins.append((scene, "given"))
    ahead = list(begins)
    while True:
        begin, base = ahead.pop(0)
        kind = ModeSearch if wanted.modes else Search
        search = kind(begin, wanted, Store(out, how.comm, base), how)
        try:
            return search, search.run()
        except UnknownQuantity:
            if wanted.modes or frequency_number(wanted.of) is None or not how.modes:
                raise
            wanted, ahead = replace(wanted, modes=True), list(begins)
        except SceneError:
            if search.levels or not ahead:
                raise
        of_first(how.comm, lambda: shutil.rmtree(out / LEVELS, ignore_errors=True))


def _stored(out: Path) -> dict[str, Any] | None:
    file = out / ACCURACY
    return read_json(file) if file.is_file() else None


def _has_levels(out: Path) -> bool:
    """Decide whether a level of a request is complete: the last one is the run at its end."""
    files = (out / LEVELS).glob(f"*-{KEPT}")
    return (out / SUMMARY).is_file() or any(read_json(file)["levels"] for file in files)


def _difference(stored: dict[str, Any], scene: Scene, wanted: Target) -> str:
    """Find what differs in the scene or quantity of a stored request; empty: nothing."""
    found = differences(stored.get("scene", {}), fingerprint(scene))
    found = [d for d in found if d[0] != "errors"]
    named = asdict(wanted)
    other = [k for k in ("of", "auto", "body", "loaded") if stored.get(k, named[k]) != named[k]]
    if found:
        return f"{found[0][0]} was {found[0][1]}, is {found[0][2]}"
    return other[0] if other else ""


def _put_back(out: Path, stored: dict[str, Any] | None) -> None:
    """The run of a request that had ended, or all but ended, is a level again."""
    if stored is not None and stored.get("levels"):
        place = out / LEVELS / str(len(stored["levels"]))
        place.mkdir(parents=True, exist_ok=True)
        for path in [p for p in out.iterdir() if p.name not in OWN]:
            path.rename(place / path.name)


def _move(level: Path, out: Path) -> None:
    for path in [p for p in level.iterdir() if p.name != LOCK] if level.is_dir() else []:
        path.rename(out / path.name)
    shutil.rmtree(level, ignore_errors=True)


def _draw(out: Path, outcome: Outcome, size: float, found: Any) -> None:
    from shellmb.show.pictures import budget_of, draw_directory

    known = [level for level in outcome.levels if isfinite(level.error) and level.error > 0]
    if known:
        draw(known, found, size, out / PICTURE)
    draw_directory(out, budget=budget_of(outcome.levels[-1].total))
