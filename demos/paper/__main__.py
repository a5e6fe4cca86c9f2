"""The command `python -m demos.paper`, from the folder of the checkout."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from demos.paper.example import Example
from demos.paper.make import find_examples, make
from demos.paper.page import PAGE, differences, with_table
from demos.paper.report import print_made
from shellmb.accuracy.measuring import to_json
from shellmb.cli.failures import App, failures_reported, first_rank, tell
from shellmb.cli.options import JsonOption, PicturesOption
from shellmb.cli.report import say
from shellmb.errors import SceneError
from shellmb.files.writing import write_text

app = App(pretty_exceptions_enable=False)


@app.command()
@failures_reported
def figures(
    section: Annotated[
        str | None, typer.Argument(metavar="[6.1|6.2|6.3]", help="Section; all if left out.")
    ] = None,
    runs: Annotated[
        Path, typer.Option("--from", help="Folder of the runs; finished ones in it are used.")
    ] = Path("runs", "figures"),
    out: Annotated[Path, typer.Option(help="Folder of the pictures.")] = Path("demos", "figures"),
    only: Annotated[
        list[str] | None, typer.Option(metavar="RUN", help="Only this run; may be repeated.")
    ] = None,
    check: Annotated[
        bool,
        typer.Option("--check", help=f"Fail unless {PAGE.name} lists these verdicts and figures."),
    ] = False,
    write: Annotated[
        bool, typer.Option("--write", help=f"Write the tables of statements in {PAGE.name}.")
    ] = False,
    json: JsonOption = False,
    no_pictures: PicturesOption = False,
) -> None:
    """Make the paper's figures and compare its statements with ours, from scratch or finished runs.

    The runs of an example take minutes to hours; one that was stopped goes on where it was.
    """
    examples = find_examples(section)
    if write and only:
        raise SceneError("figures: --write needs all runs of a section; leave out --only")
    if only:
        examples = _with_runs(examples, only)

    judged = []
    for example in examples:
        pictures = None if no_pictures else out / example.section
        made = make(example, runs / example.section, pictures, only or [], tell)
        judged += made.judged
        if write and first_rank():
            write_text(PAGE, with_table(PAGE.read_text(), example.section, made.judged))
        if first_rank() and not json:
            print_made(made)
    if first_rank() and json:
        say(to_json(judged, passed="pass"))
    found = differences(PAGE.read_text(), judged) if check else []
    for one in found:
        tell(one)
    if found:
        raise typer.Exit(1)


def _with_runs(examples: list[Example], names: Sequence[str]) -> list[Example]:
    there = {run.name for e in examples for run in e.runs}
    for name in names:
        if name not in there:
            known = ", ".join(f"'{run.name}'" for e in examples for run in e.runs)
            raise SceneError(f"figures: there is no run '{name}'; give one of {known}")
    return [e for e in examples if not {run.name for run in e.runs}.isdisjoint(names)]


if __name__ == "__main__":
    app()
