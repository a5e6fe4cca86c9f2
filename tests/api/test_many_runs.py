"""Many results in one program: MPI has communicators for those of some simulations only."""

from dataclasses import replace
from pathlib import Path

import pytest

import shellmb as sm
from shellmb.meshes import lifetime

SMALL = str(Path(__file__).parents[1] / "run" / "scene_small.py")


def test_old_runs_let_go_of_their_simulations(monkeypatch: pytest.MonkeyPatch) -> None:
    """A list of runs is what users keep: MPI ended the program at the 26th one of a mechanism."""
    lifetime.free()
    monkeypatch.setattr(lifetime, "MOST", 2 + len(lifetime._MESHES))
    monkeypatch.setattr(lifetime, "MORE", 0)
    monkeypatch.setattr(lifetime._MESHES, "most", 0)
    scene = replace(sm.load_scene(SMALL), t_end=0.01)
    runs = [sm.run(scene, pictures=False) for _ in range(4)]
    assert runs[0].computed is None
    assert runs[-1].computed is not None
    # all else stays
    assert runs[0].scene.name == runs[-1].scene.name
    assert runs[0].results == runs[-1].results
    assert runs[0].history["tip_z"].equals(runs[-1].history["tip_z"])
    # no directory tells of a scene that was made here
    assert sm.modes(runs[0], count=1, pictures=False).summary["t"] == pytest.approx(0.01)
