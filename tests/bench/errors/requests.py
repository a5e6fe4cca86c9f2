"""Requests of an accuracy: met, or refused with the reason, and what they cost.

python -m tests.bench.errors.requests          # prints the table
python -m tests.bench.errors.requests --docs   # writes it into docs/evidence/stated_errors.md, too
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterator, Mapping
from typing import Any

import shellmb as sm
from shellmb.demos.verification.measuring import replaced
from shellmb.meshes.lifetime import free
from shellmb.scene import Scene
from tests.bench.errors.bodies import plate, rod, strip
from tests.bench.errors.mechanisms import chain
from tests.bench.errors.report import PAGE

# scenes with the probe that is judged
ASKED: Mapping[str, tuple[Scene, str]] = {
    "bent strip, 4x1": (strip((4, 1)), "tip_w"),
    "bent rod": (rod(2), "tip"),
    "two rigid links, EP4": (chain("ep4", dt=0.02), "tip_x"),
    "plate, ramp, EP4": (plate("ep4", "ramp", dt=1e-2), "tip"),
}
ACCURACIES = (1e-2, 1e-3, 1e-4)
BEGIN, END = "<!-- requests: begin -->", "<!-- requests: end -->"
# no level begins that is predicted to end later [s]
BUDGET = 40.0


def ask(scene: Scene, of: str, accuracy: float) -> tuple[dict[str, Any], float]:
    """Result of a request, as its `accuracy.json`, and the processor time of its last run alone.

    Args:
        scene: The scene.
        of: The probe that is judged.
        accuracy: The relative error asked for.
    """
    free()
    run = sm.run(scene, accuracy=accuracy, of=of, budget=BUDGET)
    found: dict[str, Any] = json.loads((run.directory / "accuracy.json").read_text())
    last = run.scene
    del run
    # the models of levels know forms from those before, as a run alone does not
    free()
    clock = time.process_time()
    sm.run(last)
    return found, time.process_time() - clock


def rows() -> Iterator[str]:
    """Rows of the table in Markdown, one for each request, as it ends."""
    yield "| scene | asked | last level | levels | times the last run | end |"
    yield "| --- | --- | --- | --- | --- | --- |"
    for name, (scene, of) in ASKED.items():
        for accuracy in ACCURACIES:
            found, alone = ask(scene, of, accuracy)
            last, count = found["levels"][-1], len(found["levels"])
            cost = last["total"] / alone
            end = "met" if found["met"] else found["says"]
            yield f"| {name} | {accuracy:g} | {last['label']} | {count} | {cost:.1f} | {end} |"


if __name__ == "__main__":
    table = []
    for row in rows():
        print(row, flush=True)
        table.append(row)
    if "--docs" in sys.argv[1:]:
        PAGE.write_text(replaced(PAGE.read_text(), BEGIN, END, "\n".join(table)))
