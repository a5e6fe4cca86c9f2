"""Derivatives are written beside the run and read back; the command prints them."""

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import shellmb as sm
from shellmb.cli.main import app


def test_the_command_writes_what_load_reads(tmp_path: Path) -> None:
    out = tmp_path / "found"
    said = CliRunner().invoke(
        app,
        [*"sensitivities sudden_load --by force --t-end 2e-3 --out".split(), str(out)],
    )
    assert said.exit_code == 0, said.output
    assert "by force" in said.output
    assert f"written to {out}" in said.output
    found = sm.load(out)
    assert isinstance(found, sm.Sensitivities)
    (force,) = found.parameters
    # the motion is nearly linear so early
    tip, by_force = found.run.history["tip_z"], found.history["force"]["tip_z"]
    np.testing.assert_allclose(by_force * force.value, tip, rtol=1e-4, atol=1e-12)
    np.testing.assert_allclose(found.logarithmic["force"]["tip_z"][1:], 1.0, rtol=1e-4)
    assert found.results["force"]["peak_tip_deflection"] == pytest.approx(by_force.iloc[-1])
    plate = found.fields["force"]["plate"].displacement
    run = found.run.fields["plate"].displacement
    np.testing.assert_allclose(2 * plate[-1, :, 2], run[-1, :, 2], rtol=1e-3, atol=1e-9)
    assert (out / "history_force.csv").read_text().startswith("t,kinetic_energy")


def test_a_bad_scale_is_named(tmp_path: Path) -> None:
    said = CliRunner().invoke(
        app, ["sensitivities", "sudden_load", "--by", "force", "--scale", "force=big"]
    )
    assert said.exit_code == 2
    assert "--scale gives force the size 'big'" in said.output
