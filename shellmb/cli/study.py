"""The command `shellmb study`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from shellmb.cli.failures import first_rank, tell
from shellmb.cli.options import (
    Cell,
    Clock,
    EndOption,
    JsonOption,
    PicturesOption,
    SetOption,
    Solve,
)
from shellmb.cli.report import print_list, say
from shellmb.errors import SceneError

if TYPE_CHECKING:
    from shellmb.studies.report import Finding
    from shellmb.studies.sweep import Sweep

    # name of its files, folder, what was found
    type Done = tuple[str, Path, list[Finding]]


def _list(metavar: str, text: str) -> object:
    return typer.Option(metavar=metavar, help=text)


def study(
    scene: Annotated[
        str | None, typer.Argument(metavar="[SCENE]", help="Bundled scene, or a Python file.")
    ] = None,
    dt: Annotated[str | None, _list("S,S,...", "Time or load steps [s].")] = None,
    mesh: Annotated[str | None, _list("NxM,...", "Elements of shells along both sides.")] = None,
    scheme: Annotated[str | None, _list("ep,ed,...", "Time schemes, or statics.")] = None,
    alpha: Annotated[str | None, _list("A,A,...", "Dissipations, from 0 to 1.")] = None,
    degree: Annotated[str | None, _list("2,3", "Degrees of the elements.")] = None,
    cell: Annotated[str | None, _list("quad,tri", "Cell types.")] = None,
    model: Annotated[
        str | None, _list("exact,linear,...", "How bodies deform: exact, linear, modal:K, rigid.")
    ] = None,
    solve: Annotated[str | None, _list("reduced,full", "Unknowns of linear systems.")] = None,
    tolerance: Annotated[
        str | None,
        _list("T,T,...", "Tolerances of steps that follow their error, beside fixed steps."),
    ] = None,
    newton_tolerance: Annotated[
        str | None, _list("T,T,...", "Tolerances of Newton's method.")
    ] = None,
    quantity: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="A result of the scene, or COLUMN:NORM of its history with the norm end, max, "
            "min, mean, l2 or sup; may be repeated; the first probe if left out.",
        ),
    ] = None,
    exact: Annotated[
        float | None, typer.Option(help="Exact value; else a finer run is the reference.")
    ] = None,
    reference: Annotated[
        str | None, typer.Option(help="Scheme of the finer run; EP4, or the least dissipative ED.")
    ] = None,
    refine: Annotated[int, typer.Option(help="How much finer it is than the finest run.")] = 2,
    repeat: Annotated[int | None, typer.Option(help="Rounds of all; 3 if left out.")] = None,
    body: Annotated[
        str | None, typer.Option(help="The only shell or beam that gets mesh, degree, cell.")
    ] = None,
    t_end: EndOption = None,
    parameters: SetOption = None,
    clock: Annotated[Clock, typer.Option(help="Wall or processor times.")] = Clock.wall,
    bundled: Annotated[
        str | None, typer.Option(metavar="NAME", help="A bundled study, `all`, or `list`.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Records, numbers, picture; a study in it goes on.")
    ] = None,
    json: JsonOption = False,
    no_pictures: PicturesOption = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Do not tell each run.")] = False,
) -> None:
    """What accuracy costs in time: error against time of all combinations of what is named.

    Every option with commas is a list. Records are kept in `--out` (runs/study-SCENE if left out)
    run by run; a study that was stopped goes on there. Times are of the steps, set-up and
    compiling excluded, the median of several rounds in turn.
    """
    from shellmb.running.request import parse_mesh, parse_parameters
    from shellmb.studies.choice import Base
    from shellmb.studies.quantity import parse_quantity
    from shellmb.studies.sweep import Sweep

    axes: dict[str, Any] = {
        "dt": _values("dt", dt, _positive),
        "mesh": _values("mesh", mesh, parse_mesh),
        # the scene may have one of its own beside ours; which there are is checked with it
        "scheme": _values("scheme", scheme, str),
        "alpha": _values("alpha", alpha, float),
        "degree": _values("degree", degree, int),
        "cell": _values("cell", cell, _one_of(*Cell)),
        "model": _values("model", model, str),
        "solve": _values("solve", solve, _one_of(*Solve)),
        "tolerance": _values("newton-tolerance", newton_tolerance, _positive),
        "step_tolerance": _values("tolerance", tolerance, _positive),
    }
    others = {"quantity": quantity, "exact": exact, "reference": reference, "body": body}
    others |= {"t-end": t_end, "set": parameters, **axes}
    given = [name for name, value in others.items() if value not in (None, (), [])]
    if bundled is not None or scene is None:
        _refuse(scene, bundled, given)
        done = _run_bundled(bundled or "list", repeat, clock.value, out, quiet)
        _finish(done, json, not no_pictures)
        return
    sweep = Sweep(
        Base(scene, tuple(parse_parameters(parameters or []).items()), t_end, body),
        tuple(parse_quantity(q) for q in quantity or []),
        **{k: v for k, v in axes.items() if v},
        exact=exact,
        reference=reference,
        refine=refine,
        repeat=3 if repeat is None else repeat,
    )
    folder = out or Path("runs", f"study-{Path(scene).stem}")
    found = _run("", sweep, folder, clock.value, quiet)
    _finish([("study", folder, found)], json, not no_pictures)


def _refuse(scene: str | None, bundled: str | None, given: list[str]) -> None:
    """Say what does not go together."""
    if bundled is None and given:
        raise SceneError(
            f"study: scene is missing; it must be named where {', '.join(given)} is given"
        )
    if bundled is not None and (scene is not None or given):
        named = ", ".join([*([] if scene is None else ["a scene"]), *given])
        raise SceneError(f"study: bundled is '{bundled}'; beside it {named} must be left out")


def _run_bundled(
    name: str, repeat: int | None, clock: str, out: Path | None, quiet: bool
) -> list[Done]:
    from shellmb.studies.cases.bundled import BUNDLED, find_bundled

    if name == "list":
        if first_rank():
            print_list({b.name: b.what for b in BUNDLED}, {"studies": [b.name for b in BUNDLED]})
        return []
    done = []
    for item in find_bundled(name):
        folder = (out or Path("runs", "studies")) / item.name
        findings: list[Finding] = []
        for k, part in enumerate(item.parts):
            sweep = part.sweep if repeat is None else replace(part.sweep, repeat=repeat)
            place = folder / str(k + 1) if len(item.parts) > 1 else folder
            findings += _run(part.title, sweep, place, clock, quiet)
        done.append((item.name, folder, findings))
    return done


def _run(title: str, sweep: Sweep, folder: Path, clock: str, quiet: bool) -> list[Finding]:
    from shellmb.studies.report import evaluate
    from shellmb.studies.runner import measure

    def report(text: str) -> None:
        if not quiet:
            tell(f"{title or sweep.base.scene}: {text}")

    try:
        measured = measure(sweep, folder, report)
    except KeyboardInterrupt:
        tell(f"stopped; the same command goes on in {folder}")
        raise
    return evaluate(measured, clock, title)


def _finish(done: list[Done], as_json: bool, pictures: bool) -> None:
    """Print and write what was found, on the first rank."""
    if not first_rank() or not done:
        return
    from shellmb.measuring.records import to_json, write
    from shellmb.measuring.tables import console
    from shellmb.studies.picture import draw
    from shellmb.studies.report import print_finding

    to = console(160)
    for name, folder, findings in done:
        drawn = partial(draw, [(f.title, f.judged) for f in findings])
        write(name, to_json(findings), drawn if pictures else None, folder)
        if not as_json:
            for finding in findings:
                print_finding(finding, to)
            say(f"written to {folder}")
    if as_json:
        say(to_json([f for _, _, findings in done for f in findings]))


def _values[T](name: str, text: str | None, convert: Callable[[str], T]) -> tuple[T, ...]:
    """Values of a list with commas."""
    if text is None:
        return ()
    try:
        return tuple(dict.fromkeys(convert(part.strip()) for part in text.split(",")))
    except ValueError:
        raise SceneError(
            f"study: {name} is '{text}'; it must be values of its kind with commas between them"
        ) from None


def _positive(text: str) -> float:
    value = float(text)
    if not 0 < value < float("inf"):
        raise ValueError(text)
    return value


def _one_of(*known: str) -> Callable[[str], str]:
    def convert(text: str) -> str:
        if text not in known:
            listed = " or ".join(f"'{k}'" for k in known)
            raise SceneError(f"study: '{text}' is not possible here; it must be {listed}")
        return text

    return convert
