"""The table of hard cases for the documentation, from what the tests noted.

    SHELLMB_HARD_TABLE=hard.csv uv run pytest -n0 -m '' tests/hard
    uv run python tests/hard/table.py hard.csv

The tests append to the file: begin with none. Of each case and quantity the worst value of all its
variants (schemes, thicknesses, meshes, ...) is shown, and in brackets what is asked.
"""

import csv
import re
import sys
from pathlib import Path

# what is asked of (nearly) every case has a column of its own
COMMON = ("energy law", "energy from nowhere", "constraints")
Values = dict[str, list[tuple[float, float]]]


def title(test: str) -> str:
    """Name of a case, from that of its test, with a number of steps if it has one."""
    name = re.sub(r"\[.*", "", test).removeprefix("test_").replace("_", " ")
    steps = re.search(r"-(\d{4,})\]", test)
    return f"{name}: {int(steps.group(1)):,}" if steps else name


def said(values: list[tuple[float, float]]) -> str:
    """The worst of some values, and the bound that it comes nearest to."""
    value, bound = max(values, key=lambda pair: pair[0] / pair[1])
    # whole numbers that have to be zero, and what has to be the same bit for bit
    asked = "0" if bound == 1.0 or bound < 1e-200 else f"< {bound:.0e}".replace("e-0", "e-")
    return f"{value:.1e}".replace("e-0", "e-").replace("0.0e+00", "0") + f" ({asked})"


def read(path: Path) -> dict[str, Values]:
    """Values and bounds of each case and quantity."""
    found: dict[str, Values] = {}
    with path.open(newline="") as file:
        for test, what, value, bound in csv.reader(file):
            pair = float(value), float(bound)
            found.setdefault(title(test), {}).setdefault(what, []).append(pair)
    return found


def main(path: str) -> None:
    """Print the table in Markdown."""
    print(f"| case | variants | {' | '.join(COMMON)} | what the case is about |")
    print("| --- " * (len(COMMON) + 3) + "|")
    for case, values in read(Path(path)).items():
        common = [said(values[what]) if what in values else "" for what in COMMON]
        rest = [f"{what} {said(v)}" for what, v in values.items() if what not in COMMON]
        count = max(map(len, values.values()))
        print(f"| {case} | {count} | {' | '.join(common)} | {'; '.join(rest)} |")


if __name__ == "__main__":
    main(*sys.argv[1:])
