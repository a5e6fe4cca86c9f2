"""Example 6.1: what is measured, and that its figures and statements fit together."""

import numpy as np
import pandas as pd
import pytest

from demos.paper.ends import at_the_ends
from demos.paper.examples.lateral_buckling import EXAMPLE
from demos.paper.make import find_examples
from demos.paper.runs import request_of
from shellmb.demos.lateral_buckling import (
    STIFFNESS,
    fast,
    lateral,
    measured,
    roughness,
    scene,
    shear_force,
)
from shellmb.scene import Scene


def test_stiffness_is_that_of_the_reference() -> None:
    # docs/reference/literature.md, examples: 53503 N/m
    assert pytest.approx(53503, rel=1e-5) == STIFFNESS


def test_roughness_sees_only_what_changes_from_step_to_step() -> None:
    t = np.arange(0, 1, 1e-3)
    alternating = 3.0 * (-1.0) ** np.arange(t.size)
    assert roughness(alternating) == pytest.approx(3.0, rel=1e-12)
    # 10 Hz: (2 pi 10 dt)^2 / 4 / sqrt(2)
    slow = 3.0 * np.sin(2 * np.pi * 10 * t)
    assert roughness(slow) == pytest.approx(3.0 * (0.02 * np.pi) ** 2 / 4 / 2**0.5, rel=0.02)


def test_fast_sees_only_what_is_faster_than_its_window() -> None:
    t = np.arange(0, 1, 1e-3)
    # the mean of 11 values of 10 Hz is 0.98 of the middle one, of 293 Hz nearly nothing
    assert fast(t, 3 * np.sin(2 * np.pi * 10 * t)) == pytest.approx(0.02 * 3 / 2**0.5, rel=0.1)
    assert fast(t, 3 * np.sin(2 * np.pi * 293 * t)) == pytest.approx(3 / 2**0.5, rel=0.1)
    # the window is a time, whatever the step
    fine = np.arange(0, 1, 2.5e-4)
    assert fast(fine, np.sin(2 * np.pi * 293 * fine)) == pytest.approx(2**-0.5, rel=0.1)


def test_values_at_the_ends_of_steps_from_their_means() -> None:
    """A slow force that alternates: its means over steps do not, values at their ends do."""
    t = np.arange(0, 0.1, 1e-3)
    ends = np.sin(10 * t) + np.where(t > 0.05, 3.0 * (-1.0) ** np.arange(t.size), 0.0)
    means = np.concatenate([[np.nan], (ends[1:] + ends[:-1]) / 2])
    assert roughness(means[60:]) < 1e-3 < 1 < roughness(ends[60:])
    np.testing.assert_allclose(at_the_ends(means), ends, atol=1e-13)


def made_up(kind: str) -> pd.DataFrame:
    """A torque of 500 t that falls at 0.11 s, as mid-span goes aside; a slow shear force."""
    t = np.arange(0, 0.4, 1e-3)
    torque = np.where(t < 0.1095, 500 * t, 5.0)
    aside = np.where(t < 0.1095, 1e-6, -0.05)
    force = -1000 * t
    columns = {"t": t, "drive.torque": torque}
    if kind == "shell":
        # a parabola over the section as the shell has it: linear in either half, the same mean
        shares = {"F12_0": 0.0, "F12_1": 2.0, "F12_2": 0.0}
        columns |= {"lateral": aside} | {k: s * force / 0.08 for k, s in shares.items()}
    else:
        # cubic functions about the middle of the element
        s = np.array([-1, -(5**-0.5), 5**-0.5, 1])
        shape = 1 + 0.3 * s - 0.5 * s**2 + 0.2 * s**3
        columns |= {f"lateral_{k}": aside * shape[k] for k in range(4)}
        columns |= {f"F12_{k}": force * shape[k] for k in range(4)}
    return pd.DataFrame(columns)


@pytest.mark.parametrize("kind", ["shell", "beam"])
def test_measured(kind: str) -> None:
    history = made_up(kind)
    np.testing.assert_allclose(lateral(history)[-1], -0.05, rtol=1e-12)
    np.testing.assert_allclose(shear_force(history), -1000 * history["t"], atol=1e-10)
    found = measured(history)
    assert found["buckling_time"] == pytest.approx(0.11)
    assert found["peak_torque"] == pytest.approx(54.5)
    assert found["peak_time"] == pytest.approx(0.109)
    assert found["time_to_half"] == pytest.approx(1e-3)
    assert found["slope"] == pytest.approx(500)
    assert found["bend_of_slope"] < 1e-12
    assert found["torque_after"] == pytest.approx(5.0)
    # round-off of 1000 t
    assert found["shear_roughness"] < 1e-10


def test_not_buckled() -> None:
    history = made_up("shell")
    found = measured(history[history["t"] < 0.1])
    assert found == {"largest_lateral": pytest.approx(1e-6), "buckled": 0.0}


def test_figures_and_statements_have_their_runs() -> None:
    names = [run.name for run in EXAMPLE.runs]
    assert len(set(names)) == len(names)
    for item in (*EXAMPLE.figures, *EXAMPLE.statements):
        assert set(item.runs) <= set(names)
    assert EXAMPLE.animation in names
    # the paper's figures 4 to 8
    assert {"4", "5", "6", "7", "8"} <= {figure.number for figure in EXAMPLE.figures}
    assert find_examples("6.1") == [EXAMPLE]


def test_runs_are_possible() -> None:
    built = {run.name: request_of(run).build()[0] for run in EXAMPLE.runs}
    assert built and all(isinstance(scene, Scene) for scene in built.values())


def test_the_papers_numbers() -> None:
    shell, beam = scene("shell"), scene("beam")
    assert shell.shells[0].mesh == (6, 2)
    assert (beam.body("plate").elements, beam.body("plate").degree) == (3, 3)
    for built in (shell, beam):
        assert built.dt == 1e-3
        assert built.t_end == pytest.approx(2 * np.pi)
        assert built.drivers[0].rotation(2.0) == 2.0
