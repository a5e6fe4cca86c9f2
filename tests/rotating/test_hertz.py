"""Frequencies are in periods per second and damped, wherever they are said.

The kind: a number in rad/s under the name of hertz, the size of an eigenvalue for its imaginary
part, or a growth with the wrong sign. A mass on a spring and a damper: `m s^2 + c s + k = 0`.
"""

import csv
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import shellmb as sm
from shellmb.cli.main import app
from shellmb.scene import JointDamper, JointSpring, Prismatic, RigidBody, Scene

M, C, K = 2.0, 24.0, 800.0
(ROOT,) = [s for s in np.roots([M, C, K]) if s.imag > 0]
# 3.03 Hz; undamped it would be 3.18 Hz
HERTZ = math.sqrt(K / M - (C / (2 * M)) ** 2) / (2 * math.pi)
RATIO = C / (2 * math.sqrt(K * M))


def slide(**more: Any) -> Scene:
    return Scene(
        "slide",
        rigid_bodies=RigidBody("slide", M, (1.0, 1.0, 1.0)),
        joints=Prismatic("rail", "ground", "slide", at=(0, 0, 0), axis=(1, 0, 0)),
        force_elements=[JointSpring("spring", "rail", K), JointDamper("damper", "rail", C)],
        **{"scheme": "ep", "dt": 0.01, "t_end": 0.02} | more,
    )


def row(folder: Path, name: str) -> dict[str, str]:
    """The only mode of a table."""
    with (folder / name).open() as file:
        (found,) = csv.DictReader(file)
    return found


def check(table: dict[str, str], summary: dict[str, Any]) -> None:
    assert float(table["frequency_hz"]) == pytest.approx(HERTZ, rel=1e-9)
    assert float(table["omega_rad_per_s"]) == pytest.approx(ROOT.imag, rel=1e-9)
    assert float(table["growth_per_s"]) == pytest.approx(ROOT.real, rel=1e-9)
    assert float(table["damping_ratio"]) == pytest.approx(RATIO, rel=1e-9)
    assert table["stable"] == "1"
    assert summary["frequencies_hz"] == pytest.approx([HERTZ], rel=1e-9)
    assert summary["omega_rad_per_s"] == pytest.approx([ROOT.imag], rel=1e-9)
    assert summary["growth_per_s"] == pytest.approx([ROOT.real], rel=1e-9)
    assert summary["damping_ratios"] == pytest.approx([RATIO], rel=1e-9)


def test_modes_at_rates(tmp_path: Path) -> None:
    """At rest: what is held by ground cannot turn."""
    made = sm.modes(slide(), tmp_path / "out", count=1, rates=[0.0], pictures=False)
    assert made.frequencies[0] == pytest.approx([HERTZ], rel=1e-9)
    assert made.computed is not None
    assert made.computed.frequencies[0] == pytest.approx([HERTZ], rel=1e-9)
    shapes = made.at(0.0)
    assert shapes.frequencies == pytest.approx([HERTZ], rel=1e-9)
    table = row(tmp_path / "out", "campbell.csv")
    check(table, shapes.summary)
    assert float(table["rate_rad_per_s"]) == 0.0


def test_modes_about_a_state_of_a_run(tmp_path: Path) -> None:
    run = sm.run(slide(), tmp_path / "run", pictures=False)
    made = sm.modes(run, count=1)
    assert made.frequencies == pytest.approx([HERTZ], rel=1e-9)
    assert made.damping == pytest.approx([RATIO], rel=1e-9)
    check(row(made.directory, "modes.csv"), made.summary)


def test_natural_modes_know_no_damping(tmp_path: Path) -> None:
    made = sm.modes(slide(), tmp_path / "out", count=1, pictures=False)
    assert made.frequencies == pytest.approx([math.sqrt(K / M) / (2 * math.pi)], rel=1e-9)
    table = row(tmp_path / "out", "modes.csv")
    assert float(table["frequency_hz"]) == pytest.approx(made.frequencies[0], rel=1e-12)


SCRIPT = f"""
from shellmb.scene import *

def scene():
    return Scene(
        "slide",
        rigid_bodies=RigidBody("slide", {M}, (1.0, 1.0, 1.0)),
        joints=Prismatic("rail", "ground", "slide", at=(0, 0, 0), axis=(1, 0, 0)),
        force_elements=[JointSpring("spring", "rail", {K}), JointDamper("damper", "rail", {C})],
        scheme="ep", dt=0.01, t_end=0.02,
    )
"""


def test_what_is_printed(tmp_path: Path) -> None:
    file = tmp_path / "slide.py"
    file.write_text(SCRIPT)
    command = ["modes", str(file), "--count", "1", "--no-pictures", "--out", str(tmp_path / "out")]
    done = CliRunner().invoke(app, [*command, "--rate", "0"])
    assert done.exit_code == 0, done.output
    heads, values = (line.split("  ") for line in done.output.splitlines()[:2])
    assert "1 [Hz]" in [h.strip() for h in heads]
    assert f"{HERTZ:.6g}" in [v.strip() for v in values]
