"""What differs from machine to machine: scenes with vectors and BLAS kernels of other processors.

    python .ci/machines.py sudden_load slider_crank ...

Each scene runs once for each kind of processor that this one can be. A line says by how much
columns of its history differ from those of the first kind, as a part of the largest value of the
column and of those beside it (components of a vector, forces and moments of a joint, energies):
the largest of all columns, and which it is; then the account of energies of each run.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import pandas as pd

from shellmb.native.compiling.flags import FORCED_LANES, FORCED_LEVEL, features_here, runnable

# BLAS kernels, level of x86-64, cells at once, seed of hashes
KINDS = (
    ("Nehalem", "v2", "2", "1"),
    ("Sandybridge", "v2", "1", "2"),
    ("Haswell", "v3", "4", "3"),
    ("Zen", "v3", "8", "4"),
    ("SkylakeX", "v4", "8", "5"),
)
# what a column is of: no part of what was computed, or round-off as it is
LEFT_OUT = ("error", "iterations", "rejected", "wall", "balance")


def run(scene: str, kind: tuple[str, ...], out: Path) -> tuple[pd.DataFrame, dict[str, object]]:
    """History and summary of a scene."""
    names = ("OPENBLAS_CORETYPE", FORCED_LEVEL, FORCED_LANES, "PYTHONHASHSEED")
    environment = os.environ | dict(zip(names, kind, strict=True))
    command = [sys.executable, "-m", "shellmb.cli", "run", *scene.split(), "--no-pictures"]
    subprocess.run([*command, "--out", str(out)], env=environment, check=True, capture_output=True)
    return pd.read_csv(out / "history.csv"), json.loads((out / "summary.json").read_text())


def main() -> None:
    """Print a line for each scene and kind."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="+", help="scenes, with their options within quotes")
    kinds = [kind for kind in KINDS if kind[1] in runnable(features_here())]
    for scene in parser.parse_args().scenes:
        first: pd.DataFrame | None = None
        for kind in kinds:
            with tempfile.TemporaryDirectory() as folder:
                history, summary = run(scene, kind, Path(folder) / "run")
            first = history if first is None else first
            said = f"{summary['steps']} steps"
            if len(first) == len(history):
                kept = [c for c in first if not any(part in str(c) for part in LEFT_OUT)]
                largest = first[kept].abs().max()
                # forces and moments of a joint; components of a vector; parts of the energy law
                beside = [re.sub(r"\..*|_[xyz]$", "", str(column)) for column in kept]
                beside = [re.sub("work.*|.*energy|dissipation", "energies", x) for x in beside]
                size = largest.groupby(beside).transform("max")
                apart = ((history[kept] - first[kept]).abs().max() / size)[size > 0]
                said += f", history differs by {apart.max():.1e} ({apart.idxmax()})"
            said += f", account {summary['energy_balance_error']:.1e}"
            print(f"{scene}: {' '.join(kind[:3])}: {said}", flush=True)


if __name__ == "__main__":
    main()
