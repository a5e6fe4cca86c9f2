"""Run the frozen scenes, compare them with what was frozen, and freeze them anew.

    python -m tests.golden.runs                 largest difference of each scene
    python -m tests.golden.runs NAME ...        of these scenes
    python -m tests.golden.runs --freeze        write `runs.json` anew: only where a change of
                                                results is meant, and the reason is in the commit

The numbers were frozen from the code before "one writing" (commit 25de474).
"""

from __future__ import annotations

import json
import math
import re
import sys
from pathlib import Path

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats
from shellmb.running.execute import execute
from tests.golden.scenes import SCENES

FROZEN = Path(__file__).with_name("runs.json")
# columns that are round-off or counts
LEFT_OUT = ("error", "iterations", "rejected", "wall", "balance", "step")
History = dict[str, Floats]


def history(name: str) -> History:
    """Columns of the history of a scene, each shape (rows,).

    Args:
        name: Name of the scene.
    """
    rows = execute(SCENES[name]()).rows
    names = [c for c in rows[-1] if not any(part in c for part in LEFT_OUT)]
    return {c: np.array([row.get(c, math.nan) for row in rows], dtype=float) for c in names}


def frozen() -> dict[str, History]:
    """Histories as they were frozen, by the names of their scenes."""
    stored = json.loads(FROZEN.read_text())
    return {n: {c: np.array(v) for c, v in columns.items()} for n, columns in stored.items()}


def differences(found: History, kept: History) -> dict[str, float]:
    """Largest difference of each column, relative to the scale of the column.

    The scale is the largest value of the column and of those beside it: components of a vector,
    forces and moments of a joint, energies.

    Args:
        found: History of a run.
        kept: The history to compare it with.

    Raises:
        ValueError: If they have other columns or another number of rows.
    """
    if (names := set(found) ^ set(kept)) or any(len(found[c]) != len(kept[c]) for c in kept):
        raise ValueError(f"not the columns and rows that were frozen: {sorted(names)}")
    beside = {c: re.sub(r"\..*|_[xyz0-9]$", "", c) for c in kept}
    beside = {c: re.sub("work.*|.*energy|dissipation", "energies", b) for c, b in beside.items()}
    scale: dict[str, float] = {}
    for column, values in kept.items():
        scale[beside[column]] = max(
            scale.get(beside[column], 0.0), np.abs(values[np.isfinite(values)]).max(initial=0.0)
        )
    return {c: apart(found[c], kept[c]) / (scale[beside[c]] or 1.0) for c in kept}


def apart(one: Floats, other: Floats) -> float:
    """Largest difference of two columns; infinite where only one of them has a value."""
    both = np.isnan(one) & np.isnan(other)
    return float(np.nan_to_num(np.abs(one - other)[~both], nan=math.inf).max(initial=0.0))


def main(arguments: list[str]) -> None:
    """Compare or freeze.

    Args:
        arguments: Names of scenes, or `--freeze`.
    """
    if "--freeze" in arguments:
        found = {name: history(name) for name in SCENES}
        if MPI.COMM_WORLD.rank == 0:
            lines = ",\n".join(
                f"{json.dumps(name)}: {{\n"
                + ",\n".join(f"{json.dumps(c)}: {json.dumps(v.tolist())}" for c, v in h.items())
                + "\n}"
                for name, h in found.items()
            )
            FROZEN.write_text(f"{{\n{lines}\n}}\n")
        return
    if unknown := [name for name in arguments if name not in SCENES]:
        sys.exit(f"there is no scene '{unknown[0]}'; give some of {', '.join(SCENES)}")
    kept = frozen()
    for name in arguments or SCENES:
        found = differences(history(name), kept[name])
        worst = max(found, key=found.__getitem__)
        if MPI.COMM_WORLD.rank == 0:
            print(f"{name}: {found[worst]:.1e} ({worst})", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
