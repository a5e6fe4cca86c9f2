"""Example 6.2: what is read off its histories, its scenes, and that its figures can be drawn."""

import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure as Canvas

from demos.paper.example import FinishedRun, Results
from demos.paper.examples.snap_through import EXAMPLE
from shellmb.demos import snap_through as demo

# figures and statements that need the frames of a run too
WITH_STATES = {"10", "10b", "At first a double-S: reversed in the middle only"}


def history(amplitude=0.0, way=(0.0, 1.0), tremble=0.0, dt=2.5e-3):
    """A made-up run: E on the curve of a lever with a half sine wave across, B following late."""
    t = np.arange(0.0, 2.0 + dt / 2, dt)
    angle = demo.crank(t)
    bent = amplitude * np.sin(20 * t)
    # arc length of a half sine wave by quadrature, so that the chord is exact
    x = (np.arange(400) + 0.5) / 400
    slope = np.pi * bent[:, None] / demo.LEVER * np.cos(np.pi * x)
    chord = demo.LEVER / np.sqrt(1 + slope**2).mean(axis=1)
    pin = np.stack(
        [
            demo.CRANK * np.cos(angle) * way[0],
            demo.HEIGHT + demo.CRANK * np.cos(angle) * way[1],
            -demo.DEPTH - demo.CRANK * np.sin(angle),
        ],
        axis=1,
    )
    aside = demo.CRANK * np.cos(angle)
    e = np.sqrt(chord**2 - aside**2) + pin[:, 2]
    end = np.stack([0 * t, 0 * t + demo.HEIGHT, e], axis=1)
    along = end - pin
    across = np.cross(np.cross([0.0, 0.0, 1.0], [*way, 0.0]), along)
    across /= np.linalg.norm(across, axis=1)[:, None]
    noise = tremble * np.sin(2 * np.pi * 120 * t)
    found = {"t": t, "dt": np.r_[0.0, np.diff(t)], "rejected": np.where(t > 1.5, 2, 0)}
    found["iterations"] = np.full(len(t), 5)
    found |= {"B": demo.kinematic(t - 0.1), "M": demo.kinematic(t - 0.05), "E": e}
    found |= {"E_x": 0 * t, "E_y": 0 * t, "total_energy": 1 - t / 10, "wall_s": t}
    for k in (1, 2, 3):
        wave = (bent * math.sin(k * math.pi / 4))[:, None]
        spot = pin + k / 4 * along + wave * across
        found |= {f"lever{k}_{c}": spot[:, n] for n, c in enumerate("xyz")}
    for name in ("M11", "M22", "lever_force", "lever_moment", "arch_moment", "motor.torque"):
        found[name] = 1e-3 * (np.sin(2 * np.pi * demo.LOWEST * t) + noise)
    return pd.DataFrame(found)


@pytest.mark.parametrize("t, u", [(0.0, 0.0), (0.7, -1.265), (0.75, -1.2798), (1.25, -0.304)])
def test_kinematic_curve(t, u):
    """Values of docs/reference/literature.md, examples, to their last digit."""
    assert demo.kinematic(t) == pytest.approx(u, abs=6e-4)


def test_crank_stops_pointing_the_other_way():
    assert demo.crank(1.5) == pytest.approx(math.pi)
    assert demo.crank(2.0) == pytest.approx(math.pi)
    assert demo.kinematic(2.0) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("way", [(0.0, 1.0), (0.0, -1.0), (1.0, 0.0)])
def test_bow_explains_where_e_is(way):
    """Second order in the slope, pi 0.3 / 5.2: the rest is of its fourth power, about 1 mm."""
    h = history(0.3, way)
    bent, shortened = demo.bow(h)
    assert bent.max() == pytest.approx(0.3, rel=1e-3)
    assert shortened.max() == pytest.approx((math.pi * 0.3) ** 2 / (4 * demo.LEVER), rel=1e-2)
    assert np.abs(h["E"] - demo.kinematic(h["t"])).max() > 0.02
    assert np.abs(h["E"] - demo.follows(h)).max() < 2e-3


def test_force_of_the_lever_lengthens_it():
    h = history()
    h["lever_force"] = 1e4
    lengthened = 1e4 * demo.LEVER / (demo.E_STEEL * demo.BAR**2)
    assert demo.bow(h)[1].max() == pytest.approx(-lengthened, rel=1e-9)


def test_snap_is_where_the_crown_passes_the_straight_edges():
    h = history()
    t = demo.snap(h, 0.0, 0.85, -1)
    # found on a grid of 1 ms
    assert np.interp(t, h["t"], h["B"]) == pytest.approx(-demo.RISE, abs=5e-3)
    assert np.interp(t + 0.02, h["t"], h["B"]) < -demo.RISE
    back = demo.snap(h, 0.85, 1.6, 1)
    assert np.interp(back + 0.02, h["t"], h["B"]) > -demo.RISE
    assert math.isnan(demo.snap(h, 0.0, 0.3, -1))


def test_noise_is_what_is_fast():
    """A wave of 120 Hz keeps most of its size, one of 3.5 Hz loses all but 1 %."""
    slow, fast = (demo.noise(history(tremble=size), "M11") for size in (0.0, 1.0))
    assert slow < 1e-2 * fast
    # rms of the sine; the mean over 10 ms adds a little, straight lines between steps take more
    assert fast == pytest.approx(1e-3 / math.sqrt(2), rel=0.35)


@pytest.mark.parametrize(
    "choice",
    [
        {},
        {"model": "beam", "arches": 3},
        {"plane": "across"},
        {"begin": "inward"},
        {"edges": "sliding", "glue": "director", "offset": 0.014},
        {"imperfection": 1e-3},
    ],
)
def test_scenes(choice):
    scene = demo.scene(**choice)
    (pin,) = (j for j in scene.joints if j.name == "pin")
    assert np.linalg.norm(np.subtract(pin.at, demo.END)) == pytest.approx(demo.LEVER)
    # horizontal crank, 5 m below E
    assert pin.at[2] == pytest.approx(-demo.DEPTH)


def test_strips_have_the_width_of_the_shell():
    scene = demo.scene(model="beam")
    widths = [b.section.width for b in scene.beams if b.name.startswith("arch")]
    assert sum(widths) == pytest.approx(demo.HEIGHT)


@pytest.fixture
def results(tmp_path):
    """Made-up runs, EP with noise."""
    made = {}
    for run in EXAMPLE.runs:
        settings = dict(run.settings)
        noisy = run.name in ("shell-ep", "shell-ed0", "shell-ep4")
        summary = {"steps": 800, "rejected_steps": 2, "energy_balance_error": 1e-14}
        table = history(tremble=10.0 if noisy else 0.1)
        made[run.name] = FinishedRun(run.name, demo.scene(**settings), table, summary, tmp_path)
    return Results(made)


def test_runs_that_are_asked_for_exist():
    names = {run.name for run in EXAMPLE.runs}
    for item in (*EXAMPLE.figures, *EXAMPLE.statements):
        assert set(item.runs) <= names
    assert EXAMPLE.animation in names
    assert {"10", "11", "12", "13", "14"} <= {f.number for f in EXAMPLE.figures}


@pytest.mark.parametrize("figure", EXAMPLE.figures, ids=lambda f: f.number)
def test_figures_can_be_drawn(figure, results):
    if figure.number in WITH_STATES:
        pytest.skip("needs the frames of a run")
    canvas = Canvas()
    figure.draw(canvas, results)
    assert all(axes.lines for axes in canvas.axes)


@pytest.mark.parametrize("statement", EXAMPLE.statements, ids=lambda s: s.text[:24])
def test_statements_can_be_judged(statement, results):
    if statement.text in WITH_STATES:
        pytest.skip("needs the frames of a run")
    verdict = statement.judge(results)
    assert verdict.ours
    noisy = "Oscillations" in statement.text
    # the made-up EP has a hundred times the noise, and all have rejected steps
    assert verdict.passed or not noisy
    assert not (verdict.passed and "constant step" in statement.paper)


def test_schemes_quadratic_in_time_are_judged_by_their_noise_and_steps(results):
    """EP4 as noisy as EP with rejected steps, ED3 as quiet as ED without any; and not otherwise."""
    about = [s for s in EXAMPLE.statements if "shell-ep4" in s.runs]
    quiet = results["shell-ed3"]
    quiet.summary["rejected_steps"] = 0
    assert len(about) == 2 and all(s.judge(results).passed for s in about)
    results["shell-ed3"] = replace(quiet, history=results["shell-ep4"].history)
    quiet.summary["rejected_steps"] = 1
    assert not any(s.judge(results).passed for s in about)
