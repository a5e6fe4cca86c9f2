"""Example 6.3: the law of its hinges, its lay-up, what is measured, figures and statements."""

from typing import Any

import numpy as np
import pandas as pd
import pytest

from demos.paper.examples.antenna import EXAMPLE
from demos.paper.make import find_examples
from demos.paper.runs import request_of
from shellmb.demos.antenna import (
    HINGES,
    LAWS,
    laminate,
    moments,
    opening,
    panel_beam,
    potential,
    rocking,
    scene,
)
from shellmb.running.execute import execute
from shellmb.scene import JointDamper, JointSpring, Revolute, RigidBody, Scene

# table 1 integrated for a hinge alone without inertia, mu theta' = M_0 [1 - (theta/theta_0)^n]:
# times [s] of 50, 90, 95, 99 % (docs/reference/literature.md, examples)
TIMES = {
    "A1": (15.74, 31.42, 35.76, 44.73),
    "C1": (17.67, 32.63, 35.61, 41.04),
    "C2": (15.71, 29.00, 31.66, 36.48),
    "C3": (15.71, 29.00, 31.66, 36.48),
}
PARTS = (0.5, 0.9, 0.95, 0.99)
SHEAR = {"density": 1600.0, "G13": 7.1e9, "G23": 3.2e9}


@pytest.fixture(scope="module")
def hinges() -> pd.DataFrame:
    """Each hinge alone between the ground and a body that is light in terms of its damper."""
    elements: list[Any] = []
    for line, (M_0, theta_0, n, mu) in LAWS.items():
        law = potential(M_0, theta_0, n)
        elements.append(JointSpring(f"spring-{line}", line, potential=law))
        elements.append(JointDamper(f"damper-{line}", line, damping=mu))
    alone = Scene(
        "hinges",
        rigid_bodies=[RigidBody(f"body-{line}", 1.0, (1e-3, 1e-3, 1e-3)) for line in LAWS],
        joints=[
            Revolute(line, "ground", f"body-{line}", at=(0, 0, 0), axis=(0, 1, 0)) for line in LAWS
        ],
        force_elements=elements,
        scheme="ep",
        dt=0.4,
        t_end=50.0,
    )
    return execute(alone).history


@pytest.mark.parametrize("line", LAWS)
def test_each_hinge_alone_opens_as_table_1_tells(hinges: pd.DataFrame, line: str) -> None:
    found = np.interp(PARTS, opening(hinges, line), hinges["t"])
    # half a unit of the last digit of the table, and 1e-3 for steps of 0.4 s
    np.testing.assert_allclose(found, TIMES[line], rtol=1e-3, atol=5e-3)


def test_the_layup_is_that_of_the_references() -> None:
    # docs/reference/literature.md, laminates [N m]
    D = laminate(True, **SHEAR).D
    wanted = [[20.95, 3.136, 1.014], [3.136, 15.88, 1.014], [1.014, 1.014, 4.372]]
    np.testing.assert_allclose(D, wanted, rtol=5e-4)
    assert D[0, 2] / np.sqrt(D[0, 0] * D[2, 2]) == pytest.approx(0.106, rel=5e-3)


def test_without_coupling_all_other_stiffnesses_stay() -> None:
    on, off = laminate(True, **SHEAR), laminate(False, **SHEAR)
    coupled = np.array([[0, 0, 1], [0, 0, 1], [1, 1, 0]], dtype=bool)
    assert not off.D[coupled].any()
    assert (on.D[coupled] > 1).all()
    np.testing.assert_allclose(off.D[~coupled], on.D[~coupled], rtol=1e-12)
    np.testing.assert_allclose(off.A[:2, :2], on.A[:2, :2], rtol=1e-12)
    np.testing.assert_allclose(off.A[2, 2], on.A[2, 2], rtol=1e-12)
    assert not on.B.any()
    assert not off.B.any()
    assert on.mass == off.mass


def test_a_panel_as_a_beam_bends_as_the_plate_does() -> None:
    skin, width = laminate(False, **SHEAR), 2.0
    flexibility = np.linalg.inv(skin.D)
    section = panel_beam(skin, width)
    # free curvature across; the twist of a strip, 4 D66 b
    assert section.stiffness[4, 4] == pytest.approx(width / flexibility[0, 0], rel=1e-12)
    assert section.stiffness[3, 3] == pytest.approx(4 * width * 4.372, rel=5e-4)
    assert section.mass[0] == pytest.approx(1600 * 1.5e-3 * width)


@pytest.mark.parametrize("direction", ["across", "panel"])
@pytest.mark.parametrize("model", ["shell", "beam"])
def test_hinges_at_their_final_angles_make_a_straight_antenna(model: Any, direction: Any) -> None:
    stowed = scene(model, connector_direction=direction)
    angle = 0.0
    for i, line in enumerate(LAWS, 1):
        hinge, twin = stowed.joint(line), stowed.joint({"A": "B", "C": "D"}[line[0]] + line[1])
        assert isinstance(hinge, Revolute) and isinstance(twin, Revolute)
        assert hinge.mass == twin.mass == 8.0
        assert hinge.axis == twin.axis
        angle += hinge.axis[1] * LAWS[line][1]
        # panels are stowed upwards and downwards in turn, turned about y
        up = 1.0 if i % 2 else -1.0
        turned = up * np.array([np.sin(angle), 0.0, np.cos(angle)])
        np.testing.assert_allclose(turned, (1, 0, 0), atol=1e-12)
    assert sum(isinstance(joint, Revolute) for joint in stowed.joints) == len(HINGES) == 8


def test_measured_from_a_history() -> None:
    tilt, turn = np.radians(3.0), np.radians(80.0)
    ends = {"A1_y": [0, 0], "B1_y": [2, 2 * np.cos(tilt)], "A1_z": [1, 1]}
    ends |= {"B1_z": [1, 1 + 2 * np.sin(tilt)], "D2.rotation": [0, turn], "B1.rotation": [0, turn]}
    history = pd.DataFrame(ends)
    np.testing.assert_allclose(rocking(history, "AB1"), [0, 3], atol=1e-12)
    np.testing.assert_allclose(opening(history, "D2"), [0, 80 / 180])
    np.testing.assert_allclose(opening(history, "B1"), [0, 80 / 90])


class Finished:
    """What `moments` needs of a run."""

    def __init__(self, model: Any) -> None:
        self.scene = scene(model, width=2.5)
        names = ("M11", "M22", "M12") if model == "shell" else ("M11",)
        self.history = pd.DataFrame({f"panel3_{name}": [k + 1.0] for k, name in enumerate(names)})


def test_moments_are_per_length() -> None:
    found = moments(Finished("shell"), 3)
    assert {ab: float(m[0]) for ab, m in found.items()} == {"11": 1.0, "22": 2.0, "12": 3.0}
    # the beam's is that of the whole width
    (beam,) = moments(Finished("beam"), 3).values()
    assert float(beam[0]) == pytest.approx(1 / 2.5)


def test_figures_and_statements_have_their_runs() -> None:
    names = [run.name for run in EXAMPLE.runs]
    assert len(set(names)) == len(names)
    for item in (*EXAMPLE.figures, *EXAMPLE.statements):
        assert set(item.runs) <= set(names)
    assert EXAMPLE.animation in names
    assert {str(k) for k in range(16, 22)} <= {figure.number for figure in EXAMPLE.figures}
    assert find_examples("6.3") == [EXAMPLE]


@pytest.mark.parametrize("name", [run.name for run in EXAMPLE.runs])
def test_runs_are_possible(name: str) -> None:
    built, _ = request_of(EXAMPLE.run(name)).build()
    assert isinstance(built, Scene)
