"""Starts from a run whose sections were others: forces are those of the sections now, by hand.

The kind: sections that do not differ by a factor. What is stored is in units of a stiffness, so
that factors on it, on Young's modulus or a thickness, come out right whatever is done.
"""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from dolfinx import fem

import shellmb as sm
from shellmb.running.execute import execute
from shellmb.simulate.simulation import Simulation

E, H, L, WIDTH = 70e9, 2e-3, 1.0, 0.25
SECTION = sm.Isotropic(E=E, nu=0.0, thickness=H, density=2700.0)
# of a section, by hand: forces 11, 22, 12 per length of a stretch along x, over that stretch [N/m]
E1, E2, NU12, G12, PLY = 140e9, 10e9, 0.3, 5e9, {"G13": 5e9, "G23": 4e9, "density": 1600.0}
Q = np.array([E1, E2, NU12 * E2]) / (1 - NU12**2 * E2 / E1)
COS, SIN = math.cos(math.radians(30)), math.sin(math.radians(30))
TURNED = (
    Q[0] * COS**4 + 2 * (Q[2] + 2 * G12) * (SIN * COS) ** 2 + Q[1] * SIN**4,
    (Q[0] + Q[1] - 4 * G12) * (SIN * COS) ** 2 + Q[2] * (SIN**4 + COS**4),
    (Q[0] - Q[2] - 2 * G12) * SIN * COS**3 + (Q[2] - Q[1] + 2 * G12) * SIN**3 * COS,
)
FIBRES = sm.PlyMaterial(E1, E2, nu12=NU12, G12=G12, **PLY)
OTHERS: dict[str, tuple[sm.Section, Any]] = {
    "another contraction": (
        replace(SECTION, nu=0.3),
        E * H / (1 - 0.3**2) * np.array([1.0, 0.3, 0.0]),
    ),
    "fibres at 30 degrees": (
        sm.Orthotropic(E1, E2, nu12=NU12, G12=G12, thickness=H, angle=30.0, **PLY),
        H * np.array(TURNED),
    ),
    "plies along and across": (
        sm.Laminate([sm.Ply(FIBRES, 0.25 * H), sm.Ply(FIBRES, 0.75 * H, angle=90.0)]),
        H * np.array([0.25 * Q[0] + 0.75 * Q[1], Q[2], 0.0]),
    ),
}
STRETCH = 1e-4


def stretched(section: sm.Section, stiffness: np.ndarray, end: Any, **more: Any) -> sm.Scene:
    """Two strips and a rod along x, each stretched; of the strips the second has the section."""
    general = sm.GeneralSection(stiffness, 1.0, second_moments=(1e-4, 0.0, 1e-4))
    names = ("first", "second", "rod")
    return sm.Scene(
        "stretched",
        [
            sm.Shell(name, sm.Rectangle(L, WIDTH, origin=(0, y, 0)), s, mesh=(2, 1))
            for name, y, s in (("first", 0.0, SECTION), ("second", 1.0, section))
        ],
        beams=sm.Beam("rod", sm.Line((0, 2, 0), (L, 2, 0)), general, elements=2),
        supports=[
            *(sm.Clamped("start" if n == "rod" else "left", body=n) for n in names),
            *(
                sm.Fixed("end" if n == "rod" else "right", displacement=(end, 0, 0), body=n)
                for n in names
            ),
        ],
        **more,
    )


# of a rod forces along its directors; in the second one a stretch shears, too
PLAIN = np.diag([1e6, 4e5, 4e5, 30.0, 100.0, 100.0])
SHEARED = PLAIN.copy()
SHEARED[0, 1] = SHEARED[1, 0] = 2e5


@pytest.fixture(scope="module")
def pulled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run to that stretch without contraction: all forces but those along x are zero."""
    folder = tmp_path_factory.mktemp("pulled") / "run"
    scene = stretched(SECTION, PLAIN, lambda t: STRETCH * t, scheme="static", dt=1.0, t_end=1.0)
    execute(scene, folder, pictures=False)
    return folder


def forces(simulation: Simulation, name: str) -> np.ndarray:
    """Forces of a strip (11, 22, 12) or rod everywhere, over the stretch."""
    body, q = simulation.model.meshed[name], simulation.problem.state(name)
    dim = 1 if name == "rod" else 2
    read = fem.Expression(body.forces(q), np.array([[0.3, 0.6], [0.8, 0.2]])[:, :dim])
    domain = q.function_space.mesh
    cells = np.arange(domain.topology.index_map(dim).size_local, dtype=np.int32)
    return read.eval(domain, cells).reshape(-1, 5 if dim == 2 else 3)[:, :3] / STRETCH


@pytest.mark.parametrize("case", ["the same", "another rod", *OTHERS])
def test_forces_are_those_of_the_sections_now(case: str, pulled: Path) -> None:
    """N = A eps, wherever one of several sections is another; else they are the run's."""
    section, expected = OTHERS.get(case, (SECTION, E * H * np.array([1.0, 0.0, 0.0])))
    rod = SHEARED if case == "another rod" else PLAIN
    scene = stretched(
        section, rod, STRETCH, scheme="ep", dt=1e-6, t_end=1e-6, start=sm.FromRun(pulled)
    )
    simulation = Simulation(scene)
    by_hand = {"first": E * H * np.array([1.0, 0.0, 0.0]), "second": expected, "rod": rod[:3, 0]}
    for name, right in by_hand.items():
        # squares of the stretch are left out
        off = np.abs(forces(simulation, name) - right) / np.max(np.abs(right))
        assert np.max(off) < STRETCH, name
    if case == "the same":
        with np.load(next((pulled / "state").glob("step-*-rank0.npz"))) as stored:
            for name in by_hand:
                kept = simulation.problem.state(name).x.array
                np.testing.assert_array_equal(kept, stored[f"{name}/q"])
