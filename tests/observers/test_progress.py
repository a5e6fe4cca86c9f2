"""Progress of runs from Python: a bar where somebody sees it, nothing elsewhere."""

import io
import sys
import types

import pytest
from rich.console import Console

import shellmb as sm
from shellmb.observers.progress import ProgressReport, in_notebook, is_watched
from shellmb.show.space.display import why_not


def strip(**more) -> sm.Scene:
    steel = sm.Isotropic(E=210e9, nu=0.25, thickness=2e-3, density=7870.0)
    shell = sm.Shell("plate", sm.Rectangle(1.0, 0.08), steel, mesh=(2, 1))
    held = {"supports": sm.Clamped("left"), "loads": sm.EdgeForce("right", (0, 0, 1.0))}
    return sm.Scene("strip", shell, **held, **{"scheme": "ep", "dt": 0.01, "t_end": 0.05} | more)


@pytest.fixture
def notebook(monkeypatch: pytest.MonkeyPatch) -> None:
    """The kernel of a notebook, as far as it is asked."""
    shell = type("ZMQInteractiveShell", (), {})()
    made = types.SimpleNamespace(get_ipython=lambda: shell, version_info=(9,))
    monkeypatch.setitem(sys.modules, "IPython", made)


def test_nobody_sees_a_pipe(capfd: pytest.CaptureFixture[str]) -> None:
    assert not is_watched()
    sm.run(strip())
    assert capfd.readouterr().err == ""
    sm.run(strip(), progress=True)
    assert "step 5, t = 0.05" in capfd.readouterr().err


def test_a_bar_stands_from_the_first_second_to_the_end() -> None:
    """An error takes the bar away, too."""
    shown = io.StringIO()
    report = ProgressReport(Console(file=shown, force_terminal=True, width=100))
    with pytest.raises(ZeroDivisionError), report.building("strip", 0):
        assert report._bar.live.is_started
        report._bar.refresh()
        raise ZeroDivisionError
    assert not report._bar.live.is_started
    assert "strip: building" in shown.getvalue()
    with report.building("strip", 1):
        assert not report._bar.live.is_started


def test_a_notebook_has_a_bar_and_views(notebook: None, capfd: pytest.CaptureFixture[str]) -> None:
    assert in_notebook() and is_watched()
    run = sm.run(strip())
    said = capfd.readouterr().err
    assert "strip: building" in said and "100 %" in said
    sm.run(strip(), progress=False)
    assert capfd.readouterr().err == ""
    if why_not() is None:
        text = run.view()._repr_html_()
        assert "<iframe" in text and "Turn it with the mouse" in text


def test_a_scene_is_one_line() -> None:
    assert repr(strip()) == "<Scene 'strip': 1 shell, ep>"
    bodies = [sm.RigidBody(name, 1.0, (1, 1, 1)) for name in "ab"]
    free = sm.Scene("free", rigid_bodies=bodies, scheme="ed3", dt=0.1, t_end=1.0)
    assert repr(free) == "<Scene 'free': 2 rigid bodies, ed3>"
