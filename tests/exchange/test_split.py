"""One plate split in two that are coupled: the whole, to round-off; or the energy that it makes.

The kind: any two motions that share nodes, forces and moments being inputs and places outputs.
"""

from typing import Any

import numpy as np
import pytest

import shellmb as sm

SECTION = sm.Isotropic(E=1e7, nu=0.3, thickness=0.02, density=1000.0)
LENGTH, WIDTH = 0.4, 0.2
# nodes of the interface
NODES = [(LENGTH, y, 0.0) for y in (0.0, WIDTH / 2, WIDTH)]
AXES = np.eye(3)
STEPS, DT = 5, 5e-3


def plate(scheme: str, begin: float, elements: int, coupled: bool, **more: Any) -> sm.Scene:
    """A part of the plate with forces and moments at its interface."""
    loads: list[Any] = [sm.Gravity((0.0, 1.0, -9.81))]
    for k, node in enumerate(NODES if coupled else ()):
        loads += [
            sm.PointForce(node, axis, time=sm.Input(f"F{k}{'xyz'[c]}"))
            for c, axis in enumerate(AXES)
        ]
        loads += [
            sm.PointMoment(node, axis, time=sm.Input(f"M{k}{'xy'[c]}"))
            for c, axis in enumerate(AXES[:2])
        ]
    surface = sm.Rectangle(LENGTH * elements, WIDTH, origin=(begin, 0.0, 0.0))
    return sm.Scene(
        "part",
        sm.Shell("part", surface, SECTION, mesh=(elements, 1)),
        supports=sm.Clamped("left") if begin == 0.0 else (),
        loads=loads,
        scheme=scheme,
        dt=DT,
        t_end=1.0,
        solver=sm.Solver(tolerance=1e-9, newton="full"),
        **more,
    )


class Side:
    """One side of the interface: takes forces, gives places."""

    def __init__(self, scheme: str, begin: float, sign: float) -> None:
        self.motion, self.sign = sm.SceneMotion(plate(scheme, begin, 1, True)), sign
        found = self.motion.nodes("part").reference
        self.rows = [int(np.argmin(np.linalg.norm(found - node, axis=1))) for node in NODES]

    def places(self) -> np.ndarray:
        """Displacements, and tangential components of directors."""
        now = self.motion.nodes("part")
        d = now.director[self.rows, :2]
        return np.concatenate([now.displacement[self.rows].ravel(), d.ravel()])

    def tried(self, forces: np.ndarray) -> np.ndarray:
        """Places at the end of a step under given forces and moments."""
        values = iter(self.sign * forces)
        for what, axes in (("F", "xyz"), ("M", "xy")):
            for k in range(len(NODES)):
                for axis in axes:
                    self.motion.inputs[f"{what}{k}{axis}"] = next(values)
        self.motion.trial(DT)
        return self.places()


@pytest.mark.parametrize("scheme", ["ep", pytest.param("ed", marks=pytest.mark.ci)])
def test_implicitly_coupled_halves_are_the_whole(scheme: str) -> None:
    """Interface quasi-Newton: a Jacobian by trials once, Broyden's updates from then on."""
    a, b = Side(scheme, 0.0, 1.0), Side(scheme, LENGTH, -1.0)
    whole = sm.SceneMotion(plate(scheme, 0.0, 2, False))
    forces = np.zeros(5 * len(NODES))

    def gap(at: np.ndarray) -> np.ndarray:
        return a.tried(at) - b.tried(at)

    here = gap(forces)
    columns = [(gap(forces + 1e-3 * e) - here) / 1e-3 for e in np.eye(len(forces))]
    jacobian = np.array(columns).T
    most = 0
    for step in range(STEPS):
        here = gap(forces)
        for count in range(30):
            # round-off of places of 1 m
            if np.abs(here).max() < 2e-15 * 10:
                break
            change = np.linalg.solve(jacobian, -here)
            forces = forces + change
            new = gap(forces)
            jacobian += np.outer(new - here - jacobian @ change, change) / (change @ change)
            here = new
            most = max(most, count)
        a.motion.accept()
        b.motion.accept()
        whole.trial(DT)
        whole.accept()
        now = whole.nodes("part")
        for side in (a, b):
            part = side.motion.nodes("part")
            for node, u, d in zip(part.reference, part.displacement, part.director, strict=True):
                k = int(np.argmin(np.linalg.norm(now.reference - node, axis=1)))
                np.testing.assert_allclose(u, now.displacement[k], rtol=0, atol=1e-12)
                np.testing.assert_allclose(d, now.director[k], rtol=0, atol=1e-12)
        assert np.abs(now.displacement).max() > 1e-5 * step
    one, two = a.motion.outputs, b.motion.outputs
    for name in ("total_energy", "dissipation"):
        assert one[name] + two[name] == pytest.approx(whole.outputs[name], rel=1e-10, abs=1e-14)
    # what one puts in the other gets: coupling makes no energy
    assert abs(one["work_inputs"]) > 1e-3 * one["total_energy"]
    assert one["work_inputs"] + two["work_inputs"] == pytest.approx(0.0, abs=1e-12)
    print(most)
