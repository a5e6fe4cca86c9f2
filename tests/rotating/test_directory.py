"""Campbell diagrams in a directory: written, read back, drawn, from Python and the shell."""

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import shellmb as sm
from shellmb.cli.main import app
from shellmb.errors import SceneError

SCENE = """
from shellmb.scene import *

def scene():
    body = RigidBody("body", 2.0, (0.1, 0.1, 0.18), points={"rim": (0.5, 0, 0)})
    spin = InitialVelocity(spin=(0, 0, 3.0))
    return Scene("free", rigid_bodies=body, initial=spin, scheme="ep", dt=0.01, t_end=1.0)
"""


@pytest.fixture(scope="module")
def script(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("moving") / "free.py"
    file.write_text(SCENE)
    return file


def test_python(script: Path, tmp_path: Path) -> None:
    """The axis is that of the initial spin; what is read back is what was found."""
    made = sm.modes(str(script), tmp_path / "out", count=4, rates=[1.0, 2.0])
    read = sm.load(tmp_path / "out")
    assert isinstance(read, sm.RotatingModes)
    assert read.rates == [1.0, 2.0]
    assert read.stable
    assert "no mode grows" in repr(read)
    np.testing.assert_array_equal(read.frequencies, made.frequencies)
    assert made.computed is not None
    np.testing.assert_allclose(read.frequencies, made.computed.frequencies, rtol=1e-12)
    assert (tmp_path / "out" / "campbell.png").stat().st_size > 0
    # in a notebook
    assert 'alt="Campbell diagram"' in read._repr_html_()
    # the wobble turns the rim about an axis across: its two parts are a quarter of a turn apart
    wobble = 1 + int(np.argmin(np.abs(made.computed.modes[1].omega - 0.8 * 2.0)))
    shapes = read.at(2.0)
    assert shapes.rigid == 2
    rim = shapes.fields["rigid bodies"].sel(mode=wobble)
    real, imaginary = (rim[name].values for name in ("displacement", "displacement_imaginary"))
    assert np.abs(real).max() > 0.01 or np.abs(imaginary).max() > 0.01
    with pytest.raises(SceneError, match="rate is 3; it must be one of 1, 2"):
        read.at(3.0)
    with pytest.raises(SceneError, match="axis and about are given without rates"):
        sm.modes(str(script), axis=(0, 0, 1))  # type: ignore[call-overload]


@pytest.mark.slow
def test_animation(script: Path, tmp_path: Path) -> None:
    """One period of a complex mode, which is not in phase everywhere."""
    made = sm.modes(str(script), tmp_path / "out", count=4, rates=[2.0], pictures=False)
    assert made.at(2.0).animate(3).stat().st_size > 0


def test_command(script: Path, tmp_path: Path) -> None:
    """`shellmb modes` and `shellmb plot`."""
    out = tmp_path / "out"
    command = ["modes", str(script), "--count", "3", "--out", str(out)]
    done = CliRunner().invoke(app, [*command, "--rate", "0,2", "--no-pictures"])
    assert done.exit_code == 0, done.output
    assert "rate [rad/s]" in done.output
    assert "no mode grows at any rate" in done.output
    assert not (out / "campbell.png").exists()
    done = CliRunner().invoke(app, ["plot", str(out)])
    assert done.exit_code == 0, done.output
    assert (out / "campbell.png").exists()
    for wrong, said in (
        (["--rate", "x"], "--rate is 'x'; it must be numbers"),
        (["--axis", "0,0,1"], "given without rates"),
    ):
        done = CliRunner().invoke(app, [*command, *wrong])
        assert done.exit_code == 2
        assert said in " ".join(done.output.split())
