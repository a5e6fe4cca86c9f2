"""Run what is frozen, compare it with what was, and freeze it anew.

    python -m tests.golden.runs                 largest difference of each run
    python -m tests.golden.runs NAME ...        of "shell ed", or all that begin so: shell, modal
    python -m tests.golden.runs --columns NAME  of each column of them
    python -m tests.golden.runs --new           freeze what is not in `runs.json` yet
    python -m tests.golden.runs --freeze        write `runs.json` anew, all of it or what is named:
                                                only where a change of results is meant, and the
                                                reason is in the commit

Histories of `scenes` were frozen from the code before "one writing" (commit 25de474), all else
from the code with generated kernels (commit 11406319).
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
from tests.golden import features, scenes
from tests.golden.products import PRODUCTS, RESUMED, Table, columns

FROZEN = Path(__file__).with_name("runs.json")
SCENES = scenes.SCENES | features.SCENES
# what is frozen, and what is compared with what is frozen of a scene
STORED = (*SCENES, *(name for name in PRODUCTS if not name.startswith("resumed ")))
NAMES = (*STORED, *(f"resumed {name}" for name in RESUMED))
# of round-off: the worst that was seen with kernels of level v2 and BLAS of Nehalem (all scenes),
# with one lane and BLAS of Haswell (four), and on two ranks (four) is 1.5e-12, a force of a joint
BOUND = 1e-10
# Eigenvalues are found by a Krylov method that ends at 1e-8. Derivatives forwards are said to have
# seven digits: 5e-7 was seen with BLAS of Nehalem. Those backwards (8e-12 was seen), and slopes of
# paths near limits (6e-10), lose some of what is round-off.
BOUNDS = {"modes": 1e-7, "turning": 1e-7, "buckling": 1e-7, "frequencies": 1e-6}
BOUNDS |= {"gradient": 5e-6, "adjoint": 1e-9, "path": 1e-8}


def bound(name: str) -> float:
    """Bound of a difference."""
    return BOUNDS.get(name.split()[0], BOUND)


def history(name: str) -> Table:
    """Columns of what is frozen, each shape (rows,).

    Args:
        name: Name of a scene or product.
    """
    return PRODUCTS[name]() if name in PRODUCTS else columns(execute(SCENES[name]()))


def frozen() -> dict[str, Table]:
    """Columns as they were frozen, by the names of scenes and products."""
    stored = json.loads(FROZEN.read_text())
    found = {n: {c: np.array(v) for c, v in table.items()} for n, table in stored.items()}
    return found | {f"resumed {name}": found[name] for name in RESUMED if name in found}


def differences(found: Table, kept: Table) -> dict[str, float]:
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
        arguments: Beginnings of names, and what to do, as above.
    """
    options = {a for a in arguments if a.startswith("--")}
    begins = [a for a in arguments if a not in options]
    if unknown := [a for a in begins if not any(name.startswith(a) for name in NAMES)]:
        sys.exit(f"nothing is called '{unknown[0]}'; names are {', '.join(NAMES)}")
    if unknown := options - {"--columns", "--new", "--freeze"}:
        sys.exit(f"there is no {unknown.pop()}; options are --columns, --new, --freeze")
    # a whole name is no beginning of others: "shell ed" is not "shell ed3"
    parts = tuple(a for a in begins if a not in NAMES)
    names = [n for n in NAMES if not begins or n in begins or (parts and n.startswith(parts))]
    kept, first = frozen() if FROZEN.exists() else {}, MPI.COMM_WORLD.rank == 0
    if options & {"--new", "--freeze"}:
        again = [n for n in names if n in STORED and ("--freeze" in options or n not in kept)]
        kept |= {name: history(name) for name in again}
        if first:
            write({name: kept[name] for name in STORED if name in kept})
            print(*again, sep="\n")
        return
    for name in names:
        try:
            found = differences(history(name), kept[name])
        except ValueError as error:
            if first:
                print(f"{name}: {error}", flush=True)
            continue
        worst = max(found, key=found.__getitem__)
        if first:
            print(f"{name}: {found[worst]:.1e} ({worst})", flush=True)
            for column in found if "--columns" in options else ():
                print(f"    {found[column]:.1e}  {column}")


def write(tables: dict[str, Table]) -> None:
    """Write what is frozen, a line for each column."""
    lines = ",\n".join(
        f"{json.dumps(name)}: {{\n"
        + ",\n".join(f"{json.dumps(c)}: {json.dumps(v.tolist())}" for c, v in table.items())
        + "\n}"
        for name, table in tables.items()
    )
    FROZEN.write_text(f"{{\n{lines}\n}}\n")


if __name__ == "__main__":
    main(sys.argv[1:])
