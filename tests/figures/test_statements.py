"""Statements can fail: runs as the paper tells of them pass, those of a wrong model do not."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from demos.paper.example import FinishedRun, Results, Statement
from demos.paper.examples import antenna_statements, snap_statements
from shellmb.demos import antenna, snap_through

WIDTH = 2.0
# what fails where panels do not act as plates
FLAT = {"Rocking of", "Twisting moments", "Transverse bending", "Transverse shear", "M11 at"}


def unfolding(tilt: float, twist: float, hit: float = 60.0, other: float = 0.0) -> pd.DataFrame:
    """Hinges that open; edges that rock by `tilt` degrees; moments with faster waves by `twist`."""
    t = np.arange(0.0, 120.1, 0.2)
    opened, late = 1 - np.exp(-t / (hit / np.log(10))), t > hit
    found = {"t": t, "C1A2_F2": 1 + 5 * tilt * late, "D1B2_F2": 1 - 5 * tilt * late}
    for hinge in antenna.HINGES:
        line = ("A" if hinge[0] in "AB" else "C") + hinge[1]
        found[f"{hinge}.rotation"] = opened * antenna.LAWS[line][1]
    angle = np.radians(tilt) * late
    for i in range(1, antenna.PANELS + 1):
        for a, b in ("AB", "CD"):
            found |= {f"{a}{i}_{c}": 0 * t for c in "yz"}
            found |= {f"{b}{i}_y": WIDTH * np.cos(angle), f"{b}{i}_z": WIDTH * np.sin(angle)}
        slow, fast = np.sin(t / 3 + other), np.sin(4 * t)
        found[f"panel{i}_M11"] = slow + twist * fast * late
        found[f"panel{i}_M22"] = (0.05 + twist) * slow
        found[f"panel{i}_M12"] = twist * fast
    return pd.DataFrame(found)


def antennas(shell: pd.DataFrame, folder: Path, other: pd.DataFrame | None = None) -> Results:
    """Runs of the three models; the beam model's moments are those of the whole width.

    Other schemes have the same history, or EP4 another one.
    """
    beam = unfolding(0.0, 0.0)
    for i in range(1, antenna.PANELS + 1):
        beam[f"panel{i}_M11"] *= WIDTH
    models = {
        "shell-ed": (antenna.scene(), shell),
        "beam-ed": (antenna.scene("beam"), beam),
        "shell-off": (antenna.scene(coupling=False), unfolding(0.0, 0.0)),
    }
    models |= {f"shell-{scheme}": (antenna.scene(), shell) for scheme in ("ep", "ed3", "ep4")}
    if other is not None:
        models["shell-ep4"] = (antenna.scene(), other)
    law = {"energy_balance_error": 1e-13}
    return Results({n: FinishedRun(n, s, h, law, folder) for n, (s, h) in models.items()})


def failed(statements: tuple[Statement, ...], results: Results) -> set[str]:
    """First two words of those that fail."""
    return {" ".join(s.text.split(" ")[:2]) for s in statements if not s.judge(results).passed}


def test_a_deployment_as_the_paper_tells_of_it(tmp_path: Path) -> None:
    shell = unfolding(tilt=7.0, twist=0.5, other=0.8)
    assert failed(antenna_statements.STATEMENTS, antennas(shell, tmp_path)) == set()


@pytest.mark.parametrize(
    ("shell", "words"),
    [
        # the shell model is no more than the beam model
        (unfolding(0.0, 0.0), {*FLAT, "Frequencies of"}),
        # it twists a little, far less than it bends
        (unfolding(0.1, 0.02), FLAT),
        # its hinges open faster than they would without inertia
        (unfolding(7.0, 0.5, hit=20.0, other=0.8), {"All hinges", "Rotations at"}),
    ],
)
def test_a_wrong_antenna_is_found(shell: pd.DataFrame, words: set[str], tmp_path: Path) -> None:
    assert words <= failed(antenna_statements.STATEMENTS, antennas(shell, tmp_path))


@pytest.mark.parametrize("other", [unfolding(7.0, 0.5, 62.0, 0.8), unfolding(5.0, 0.5, other=0.8)])
def test_a_scheme_that_opens_it_otherwise_is_found(other: pd.DataFrame, tmp_path: Path) -> None:
    runs = antennas(unfolding(7.0, 0.5, other=0.8), tmp_path, other)
    assert failed(antenna_statements.STATEMENTS, runs) == {"Last hinge"}


def snapping(down: float, up: float) -> pd.DataFrame:
    """B goes down and up, past the straight edges at these times."""
    t = np.arange(0.0, 2.0, 2.5e-3)
    way = -2 * snap_through.RISE * ((t > down) & (t < up))
    return pd.DataFrame({"t": t, "B": way})


@pytest.mark.parametrize(
    ("times", "wrong"),
    [
        ({}, 0),
        # any of the runs that a statement is about
        ({"shell-ep": (0.7, 1.32)}, 1),
        ({"fine-time": (0.7, 1.32)}, 1),
        ({"shell-ed": (0.62, 1.25)}, 1),
        ({"wavy-ed": (0.76, 1.19)}, 2),
        ({"fine-mesh": (np.inf, np.inf)}, 2),
    ],
)
def test_both_snaps_of_every_run_are_judged(times: Any, wrong: int, tmp_path: Path) -> None:
    names = ("shell-ed", "shell-ep", "fine-time", "fine-mesh", "wavy-ed")
    runs = {
        n: FinishedRun(n, snap_through.scene(), snapping(*times.get(n, (0.7, 1.25))), {}, tmp_path)
        for n in names
    }
    statements = [s for s in snap_statements.STATEMENTS if "t = " in s.paper]
    assert len(statements) == 6
    assert sum(not s.judge(Results(runs)).passed for s in statements) == wrong
