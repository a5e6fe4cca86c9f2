"""The work of `shellmb effects`: a survey or a comparison, printed as a table or JSON."""

from __future__ import annotations

from shellmb.cli.failures import first_rank, tell
from shellmb.demos.effects.catalogue.registry import changed
from shellmb.demos.effects.compare import compare
from shellmb.demos.effects.report import (
    comparison_json,
    print_comparison,
    print_survey,
    survey_json,
)
from shellmb.demos.effects.survey import survey
from shellmb.running.results import Results
from shellmb.scene import Scene


def tell_survey(scene: Scene, steps: int, repeat: int, json: bool) -> None:
    """Print which effects a scene has, and what they cost.

    Args:
        scene: The scene.
        steps: Steps of a round; none for effects and reasons only.
        repeat: Rounds.
        json: JSON in place of a table.
    """
    found = survey(scene, steps, repeat, _progress)
    if first_rank() and json:
        print(survey_json(scene.name, found))
    elif first_rank():
        print_survey(scene.name, found)


def tell_comparison(
    scene: Scene,
    effects: dict[str, list[str]],
    results: Results | None,
    repeat: int,
    json: bool,
) -> None:
    """Print what a scene has otherwise with other effects.

    Args:
        scene: The scene as it is.
        effects: Names of effects "without" and "with" which it is run again.
        results: Function of the scene's module that evaluates a run.
        repeat: Runs of both.
        json: JSON in place of a table.
    """
    other = changed(scene, effects["without"], effects["with"])
    compared = compare(scene, other, results, repeat, _progress)
    if first_rank() and json:
        print(comparison_json(scene.name, effects, compared))
    elif first_rank():
        print_comparison(scene.name, effects, compared)


def _progress(text: str) -> None:
    tell(f"effects: {text}")
