"""A shell as a participant of preCICE, by a module that stands in for pyprecice.

The real library was not there to be tried. The kind: windows that are repeated (implicit coupling)
or not, longer than the scene's steps or not.
"""

import sys
import types
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
import pytest

import shellmb as sm

STIFFNESS = 3.0


class Participant:
    """A partner that holds each node by a spring, by fixed-point iterations in each window."""

    made: ClassVar[list["Participant"]] = []
    repeats, window, end = 4, 0.02, 0.08

    def __init__(self, name: str, configuration: str, rank: int, size: int) -> None:
        assert (name, configuration, rank, size) == ("Solid", "precice-config.xml", 0, 1)
        self.time, self.count, self.finished = 0.0, 0, False
        self.calls: list[str] = []
        Participant.made.append(self)

    def set_mesh_vertices(self, mesh: str, points: np.ndarray) -> np.ndarray:
        self.points, self.forces = points, np.zeros_like(points)
        return np.arange(len(points))

    def requires_initial_data(self) -> bool:
        return True

    def initialize(self) -> None:
        self.calls.append("initialize")

    def is_coupling_ongoing(self) -> bool:
        return self.time < self.end - 1e-12

    def requires_writing_checkpoint(self) -> bool:
        return self.count == 0

    def get_max_time_step_size(self) -> float:
        return self.window

    def read_data(self, mesh: str, name: str, ids: np.ndarray, dt: float) -> np.ndarray:
        assert (mesh, name, dt) == ("Solid-Mesh", "Force", self.window)
        return self.forces

    def write_data(self, mesh: str, name: str, ids: np.ndarray, values: np.ndarray) -> None:
        assert (mesh, name) == ("Solid-Mesh", "Displacement")
        assert values.shape == self.points.shape
        self.forces = -STIFFNESS * values

    def advance(self, dt: float) -> None:
        self.count = (self.count + 1) % self.repeats
        if self.count == 0:
            self.time += dt

    def requires_reading_checkpoint(self) -> bool:
        return self.count > 0

    def finalize(self) -> None:
        self.finished = True


def scene(**more: Any) -> sm.Scene:
    section = sm.Isotropic(E=1e7, nu=0.3, thickness=0.01, density=1000.0)
    return sm.Scene(
        "strip",
        sm.Shell("strip", sm.Rectangle(1.0, 0.2), section, mesh=(2, 1)),
        supports=sm.Clamped("left"),
        loads=sm.Gravity(),
        probes=sm.Probe("tip", (1.0, 0.0, 0.0)),
        scheme="ep",
        **{"dt": 0.01, "t_end": 0.08, **more},
    )


@pytest.mark.parametrize("repeats", [1, 4])
def test_the_shell_is_stepped_as_the_partner_says(monkeypatch: Any, repeats: int) -> None:
    module = types.ModuleType("precice")
    module.Participant = Participant  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "precice", module)
    monkeypatch.setattr(Participant, "repeats", repeats)
    motion = sm.couple_precice(scene(), "precice-config.xml", "strip")
    partner = Participant.made[-1]
    assert partner.finished
    assert motion.time == pytest.approx(0.08)
    # of 15 nodes three are clamped
    assert len(partner.points) == 12
    # the same by hand
    loads = [*scene().loads]
    for k, x in enumerate(map(tuple, partner.points.tolist())):
        loads += [
            sm.PointForce(x, e, time=sm.Input(f"{k}.{c}", linear=True))
            for c, e in enumerate(map(tuple, np.eye(3).tolist()))
        ]
    other = sm.SceneMotion(replace(scene(), loads=tuple(loads)))
    known = other.nodes("strip").reference
    rows = [int(np.argmin(np.linalg.norm(known - x, axis=1))) for x in partner.points]
    forces = np.zeros((12, 3))
    for _ in range(4):
        for _ in range(repeats):
            for k, force in enumerate(forces.tolist()):
                other.inputs.update({f"{k}.{c}": value for c, value in enumerate(force)})
            other.trial(0.02)
            forces = -STIFFNESS * other.nodes("strip").displacement[rows]
        other.accept()
    for name in ("tip", "total_energy", "work_inputs"):
        assert motion.outputs[name] == pytest.approx(other.outputs[name], rel=1e-11)
    assert motion.outputs["work_inputs"] < -1e-5
    assert abs(motion.outputs["energy_balance"]) < 1e-12


def test_without_the_library(monkeypatch: Any) -> None:
    monkeypatch.setitem(sys.modules, "precice", None)
    with pytest.raises(sm.SceneError, match=r"pyprecice cannot be imported .*pip install"):
        sm.couple_precice(scene(), "precice-config.xml", "strip")
