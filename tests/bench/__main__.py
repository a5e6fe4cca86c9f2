"""The command `python -m tests.bench`, from the folder of the checkout."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from shellmb.cli.failures import App, failures_reported
from shellmb.cli.options import Clock

app = App(pretty_exceptions_enable=False)


class BenchScene(StrEnum):
    """Plates that are measured."""

    dynamic = "dynamic"
    triangles = "triangles"
    static = "static"


class BenchScheme(StrEnum):
    """Time schemes of the dynamic ones."""

    ep = "ep"
    ed = "ed"
    ep4 = "ep4"
    ed3 = "ed3"


class Peer(StrEnum):
    """Codes to compare with."""

    exudyn = "exudyn"
    opensees = "opensees"
    kratos = "kratos"
    ngsolve = "ngsolve"


@app.callback(invoke_without_command=True)
@failures_reported
def bench(
    context: typer.Context,
    scene: Annotated[
        list[BenchScene] | None, typer.Option(help="Plate; may be repeated; all if left out.")
    ] = None,
    scheme: Annotated[
        list[BenchScheme] | None, typer.Option(help="Time scheme; may be repeated.")
    ] = None,
    mesh: Annotated[
        list[str] | None,
        typer.Option(metavar="NxM", help="Mesh; may be repeated; 6x2 ... 64x64 if left out."),
    ] = None,
    steps: Annotated[int | None, typer.Option(min=1, help="Steps of a round.")] = None,
    repeat: Annotated[int | None, typer.Option(min=1, help="Number of rounds.")] = None,
    limit: Annotated[
        int | None,
        typer.Option(min=1, help="Unknowns beyond which the unreduced path is left out."),
    ] = None,
    memory: Annotated[bool, typer.Option("--memory", help="Peak memory of all.")] = False,
    clock: Annotated[Clock, typer.Option(help="Processor or wall times.")] = "wall",
    peer: Annotated[
        list[Peer] | None, typer.Option(help="Compare with another code; may be repeated.")
    ] = None,
    effects: Annotated[
        bool, typer.Option("--effects", help="A step with each effect and without it.")
    ] = False,
    effect: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="Of --effects; may be repeated.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for picture and numbers.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="A small mesh, few steps.")] = False,
    check: Annotated[bool, typer.Option("--check", help="Fail if a bar is missed.")] = False,
    json: Annotated[bool, typer.Option("--json", help="Print a JSON list.")] = False,
) -> None:
    """Measure what a step costs on this machine, part by part, by effects, or against another code.

    Wall times, or with `--clock cpu` processor times: these compare on a busy machine, too, but
    reading that clock takes a good part of a millisecond in some sandboxes. `--effects` and
    `--peer` read it once a round, and always take it.
    """
    if context.invoked_subcommand is not None:
        return
    from shellmb.options.described import parse_mesh

    if effects or effect:
        from tests.bench.effects.report import effect_plan_of, run_effects

        refused = {"scene": scene, "limit": limit, "memory": memory, "peer": peer, "check": check}
        by_effect = effect_plan_of(
            quick,
            [name for name, value in refused.items() if value],
            effects=effect,
            schemes=[s.value for s in scheme or []],
            meshes=[parse_mesh(m) for m in mesh or []],
            steps=steps,
            rounds=repeat,
        )
        run_effects(by_effect, out, json)
        return
    if peer:
        from tests.bench.peers.report import run_peer

        passed = run_peer([p.value for p in peer], out, json, quick, check)
    else:
        from tests.bench.report import plan_of, run_bench

        plan = plan_of(
            quick,
            scenes=[s.value for s in scene or []],
            schemes=[s.value for s in scheme or []],
            meshes=[parse_mesh(m) for m in mesh or []],
            steps=steps,
            rounds=repeat,
            limit=limit,
            memory=memory,
            clock=clock,
        )
        passed = run_bench(plan, out, json, check)
    if not passed:
        raise typer.Exit(1)


@app.command()
@failures_reported
def errors(
    case: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Part of the name of a case; may be repeated."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="File of records; that of the table if left out.")
    ] = None,
    again: Annotated[bool, typer.Option("--again", help="Also cases with a record.")] = False,
    docs: Annotated[
        bool, typer.Option("--docs", help="Write the table of docs/evidence/stated_errors.md.")
    ] = False,
) -> None:
    """Compare errors that runs state with true ones, of runs that are far finer or exact values.

    Cases that have a record are not run again; without any left, only the table is printed.
    """
    from tests.bench.errors.report import run_errors

    if not run_errors(case or [], out, again, docs):
        raise typer.Exit(1)


@app.command()
@failures_reported
def mechanisms(
    case: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="Mechanism; may be repeated.")
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="A few runs of each.")] = False,
    docs: Annotated[
        bool, typer.Option("--docs", help="Write the table of docs/theory/mechanisms.md.")
    ] = False,
) -> None:
    """Compare error against processor time of mechanisms with Exudyn and exact motions.

    Ours runs with all that a run observes. Names: chain3, chain10, chain100, slider_crank,
    flexible_slider_crank, four_bar, heavy_top.
    """
    from tests.bench.peers.mechanisms.report import run_mechanisms

    run_mechanisms(case or [], quick, docs)


@app.command()
@failures_reported
def steps(
    other: Annotated[
        Path | None, typer.Argument(help="Another checkout, or its environment.")
    ] = None,
    row: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="Part of a title; may be repeated.")
    ] = None,
    check: Annotated[
        bool, typer.Option("--check", help="Fail if a row takes over 1.05 times as long.")
    ] = False,
) -> None:
    """Compare times of steps with those of another checkout, round by round in turn.

    Processor times, observers and files included, of plates, mechanisms, and derivatives forwards
    and backwards. Both make their steps in turn, so other load affects both alike.
    """
    from tests.bench.steps.pairs import run_steps

    if not run_steps(other, row or [], check):
        raise typer.Exit(1)


@app.command()
@failures_reported
def first(
    scene: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="Bundled scene; may be repeated.")
    ] = None,
    repeat: Annotated[int, typer.Option(min=1, help="Processes of each; the least counts.")] = 2,
    docs: Annotated[
        bool, typer.Option("--docs", help="Write the table of docs/evidence/costs.md.")
    ] = False,
) -> None:
    """Measure the time from the import of each bundled scene to its first accepted step.

    Each runs in a process of its own with one thread, which reads all forms anew. Files are written
    as by `shellmb run`.
    """
    from tests.bench.steps.first import run_first

    run_first(scene or [], repeat, docs)


@app.command()
@failures_reported
def parts(
    docs: Annotated[
        bool, typer.Option("--docs", help="Write the table of docs/theory/linear_systems.md.")
    ] = False,
) -> None:
    """Measure what steps of chains are made of: residuals, Jacobians, factors, solutions."""
    from tests.bench.steps.parts import run_parts

    run_parts(docs)


if __name__ == "__main__":
    app()
