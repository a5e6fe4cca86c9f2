"""What was once without effect, or acted on the wrong thing, and now has its effect."""

from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from shellmb.cli.main import app
from shellmb.errors import ShellmbWarning
from shellmb.running.execute import execute
from shellmb.scene import (
    Beam,
    Clamped,
    Gravity,
    Isotropic,
    Line,
    Parametric,
    PointForce,
    Probe,
    Rectangle,
    RectangularSection,
    Scene,
    Shell,
)

STEEL = Isotropic(E=2e11, nu=0.3, thickness=0.01, density=7800)


def slit(xi, eta):
    """An annular plate, cut open along the x axis."""
    r, a = 6 + 4 * eta, 2 * np.pi * xi
    return np.stack([r * np.cos(a), r * np.sin(a), 0 * r])


def lips(held, point):
    """Deflections of the four corners of the ring for a unit force at one of them."""
    names = [f"{side}-{end}" for side in ("left", "right") for end in ("bottom", "top")]
    scene = Scene(
        "ring",
        Shell("ring", Parametric(slit, slit=True), STEEL, mesh=(4, 1)),
        supports=Clamped(held),
        loads=PointForce(point, (0, 0, 1)),
        probes=[Probe(name, name) for name in names],
        scheme="linear-statics",
    )
    last = execute(scene).history.iloc[-1]
    return {name: float(last[name]) for name in names}


def test_named_points_at_a_slit_are_nodes_of_their_lip():
    """The held lip stays, the free one moves, by Maxwell's theorem and the mirrored ring alike."""
    inner, outer = lips("left", "right-bottom"), lips("left", "right-top")
    for found in (inner, outer):
        assert found["left-bottom"] == found["left-top"] == 0.0
    assert inner["right-top"] == pytest.approx(outer["right-bottom"], rel=1e-8)
    assert inner["right-bottom"] > 0.5 * inner["right-top"] > 0
    mirrored = lips("right", "left-bottom")
    assert mirrored["left-top"] == pytest.approx(inner["right-top"], rel=1e-8)
    assert mirrored["right-top"] == 0.0


def weight(point):
    """Gravity as a user's own term: 7800 kg/m^3 x 0.01 m x 9.81 m/s^2."""
    return -7800 * 0.01 * 9.81 * point.du[2]


def test_equilibrium_of_a_shell_that_nothing_ties():
    """Clamped under its weight it begins where statics puts it, and stays there."""
    plate = Shell("plate", Rectangle(1, 0.5), STEEL, mesh=(2, 1))
    hanging = Scene(
        "hanging",
        plate,
        supports=Clamped("left"),
        loads=Gravity(),
        probes=[Probe("tip", "right-top"), Probe("rate", "right-top", "velocity", "norm")],
        start="equilibrium",
        scheme="ep",
        dt=0.01,
        t_end=0.03,
    )
    static = execute(hanging.with_options(scheme="static", dt=0.03)).history["tip"].iloc[-1]
    assert static < -1e-3
    # a term acts as the load does that it stands for
    for scene in (hanging, replace(hanging, loads=(), shells=replace(plate, terms=(weight,)))):
        history = execute(scene).history
        # the relaxation ends where a step moves by 1e-10 of the length
        assert history["tip"].to_numpy() == pytest.approx(static, abs=1e-9)
        assert history["rate"].max() < 1e-7


def test_bodies_thicker_than_long_are_doubted(bind):
    thick = Isotropic(E=2e11, nu=0.3, thickness=10.0)
    held = Clamped("left")
    with pytest.warns(ShellmbWarning, match="shell 'plate': the thickness is 10 m and it is 1.41"):
        bind(Scene("s", Shell("plate", Rectangle(1, 1), thick, mesh=(2, 2)), supports=held))
    wide = RectangularSection(E=2e11, nu=0.3, width=20.0, height=20.0)
    rod = Beam("rod", Line((0, 0, 0), (1, 0, 0)), wide, elements=2)
    with pytest.warns(ShellmbWarning, match="beam 'rod': the size of its section is 20 m and it"):
        bind(Scene("s", beams=rod, supports=Clamped("start")))


SCENE = """
from shellmb.scene import *
def scene(t_end: float = 1.0):
    steel = PlyMaterial(2e11, 2e11, nu12=0.3, G12=7e10, G13=7e10, G23=7e10, density=7800)
    foam = PlyMaterial(1e7, 1e7, nu12=0.3, G12=4e6, G13=4e6, G23=4e6, density=50)
    plies = (Ply(steel, 1e-3), Ply(foam, 2e-2), Ply(steel, 1e-3))
    plate = Shell("plate", Rectangle(2, 1), Laminate(plies), mesh=(2, 1))
    Laminate(plies)
    return Scene("soft", plate, supports=Clamped("left"), scheme="ep", dt=0.1, t_end=t_end)
def results(run):
    return {}
"""
NOTHING = "there is nothing to check, because it defines no"


@pytest.mark.parametrize(
    ("arguments", "change", "message"),
    [
        (
            ("run", "--t-end", "0.05"),
            "",
            "scene 'soft': dt is 0.1; it must be at most t_end, which is 0.05",
        ),
        (
            ("run", "--dt", "3"),
            "",
            "scene 'soft': dt is 3.0; it must be at most t_end, which is 1.0",
        ),
        (
            ("run", "--check"),
            "",
            f"scene 'mine': {NOTHING} check(results); --check must be left out",
        ),
        (
            ("run", "--check"),
            "def check(results): pass\ndel results",
            f"scene 'mine': {NOTHING} results(run); --check must be left out",
        ),
        (
            ("modes", "--check"),
            "def check(results): pass",
            f"scene 'mine': {NOTHING} mode_results(modes); --check must be left out",
        ),
    ],
)
def test_options_without_effect(arguments, change, message, tmp_path):
    """One sentence each; and the warning of the soft core before it, once for both laminates."""
    file = tmp_path / "mine.py"
    file.write_text(SCENE + change)
    command, *options = arguments
    found = CliRunner().invoke(app, [command, str(file), *options, "--out", str(tmp_path / "out")])
    assert found.exit_code == 2
    warning, error = found.stderr.splitlines()
    assert warning.startswith("warning: laminate: shear_correction is 0.8333, with which it is")
    assert error == f"error: {message}"
    assert not (tmp_path / "out").exists()
