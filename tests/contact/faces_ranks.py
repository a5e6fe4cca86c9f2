"""Runs scenes with contact of shells and writes what came of them: names of scenes, then a file.

All have friction or damping, slide until other pairs touch, or touch themselves.
"""

import json
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from mpi4py import MPI

ROOT = str(Path(__file__).parents[2])
if ROOT not in sys.path:
    sys.path.append(ROOT)

from shellmb.running.execute import execute  # noqa: E402
from shellmb.scene import Clamped, InitialVelocity, Scene, Solver  # noqa: E402
from tests.contact.test_faces import SPEED, bent, plates  # noqa: E402


def sliding(scheme: str, **more: Any) -> Scene:
    """Plates with friction and damping, the lower one held, that slide by several elements."""
    start = InitialVelocity((30.0, 10.0, -SPEED), body="up")
    scene = plates(scheme=scheme, initial=start, t_end=8e-4, **more)
    touch = replace(scene.contacts[0], friction=0.3, slip_speed=0.1, relative_damping=0.2)
    return replace(
        scene,
        contacts=touch,
        supports=Clamped("left", body="low"),
        solver=Solver(tolerance=1e-11),
    )


SCENES: dict[str, Callable[[], Scene]] = {
    "ep": lambda: sliding("ep"),
    "ed3": lambda: sliding("ed3", alpha=0.5),
    "fine": lambda: sliding("ep4", meshes=(3, 4)),
    "full": lambda: replace(sliding("ep"), solver=Solver(tolerance=1e-11, solve="full")),
    "itself": lambda: bent(t_end=0.015),
}


def found(names: list[str]) -> dict[str, Any]:
    """Histories of scenes, and which warned."""
    runs = {name: execute(SCENES[name]()) for name in names}
    return {
        name: {
            "history": {key: run.history[key].tolist() for key in run.history},
            "warnings": [w.says for w in run.warnings],
        }
        for name, run in runs.items()
    }


if __name__ == "__main__":
    *names, file = sys.argv[1:]
    made = found(names)
    if MPI.COMM_WORLD.rank == 0:
        Path(file).write_text(json.dumps(made))
