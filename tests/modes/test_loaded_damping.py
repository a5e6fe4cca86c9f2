"""Modes about loaded equilibria have their damping: dampers, motors, sections, whatever loads do.

The kind: a state that flutters by its dampers (H. Ziegler, 1952) and is said to be stable. Closed
forms: two pendulums, an oscillator, a column under a force that follows it.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import shellmb as sm


def values(modes: Any) -> np.ndarray:
    """Eigenvalues of modes, 1/s."""
    table = modes.table
    return table["growth_per_s"].to_numpy() + 1j * table["omega_rad_per_s"].to_numpy()


def upper(found: Any) -> np.ndarray:
    """Of each complex pair one, by their size."""
    return np.array(sorted(found[found.imag > -1e-9], key=abs))


def ziegler(P: float, c: float, scheme: str, load: Any = sm.FollowerForce) -> sm.Scene:
    """Masses 2 and 1 on two rods of length 1 with springs 1 and dampers."""
    end = {"end": (1, 0, 0)}
    return sm.Scene(
        "ziegler",
        rigid_bodies=[
            sm.RigidBody("A", 2.0, (0.0,) * 3, com=(1, 0, 0)),
            sm.RigidBody("B", 1.0, (0.0,) * 3, position=(1, 0, 0), com=(1, 0, 0), points=end),
        ],
        joints=[
            sm.Revolute("a", sm.GROUND, "A", at=(0, 0, 0), axis=(0, 0, 1)),
            sm.Revolute("b", "A", "B", at=(1, 0, 0), axis=(0, 0, 1)),
        ],
        force_elements=[
            sm.JointSpring("ka", "a", 1.0),
            sm.JointSpring("kb", "b", 1.0),
            sm.JointDamper("ca", "a", c),
            sm.JointDamper("cb", "b", law=lambda v: c * v),
        ],
        loads=load("end", (-P, 0, 0), body="B"),
        scheme=scheme,
        dt=0.25,
        t_end=1.0,
    )


PENDULUMS = [
    (1.0, 0.5, sm.FollowerForce, False),
    (2.0, 0.5, sm.FollowerForce, True),
    (1.7, 0.05, sm.FollowerForce, True),
    (0.5, 0.5, sm.PointForce, True),
]


@pytest.mark.parametrize("scheme", ["ep", "ed3", "static"])
@pytest.mark.parametrize(("P", "c", "load", "grows"), PENDULUMS)
def test_two_pendulums(scheme: str, P: float, c: float, load: Any, grows: bool) -> None:
    """Dampers make flutter at loads that are stable without them (2.09), and slow divergence."""
    K = [[2 - P, P - 1], [-1, 1]] if load is sm.FollowerForce else [[2 - P, -1], [-1, 1 - P]]
    M, C = np.array([[3.0, 1], [1, 1]]), c * np.array([[2.0, -1], [-1, 1]])
    lower = [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]
    exact = upper(np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], lower])))[:2]
    scene = ziegler(P, c, scheme, load)
    made = sm.modes(scene, count=2, loaded=True, pictures=False)
    assert values(made) == pytest.approx(exact, abs=1e-6)  # not round-off
    assert bool(exact.real.max() > 0) is bool(made.warnings) is grows
    assert list(made.table["stable"] == 0) == list(exact.real > 0)
    again = sm.modes(scene, count=2, loaded=True, rates=[0.0], pictures=False)
    assert values(again)[:2] == pytest.approx(values(made), rel=1e-9)


RESISTS = {
    "joint damper": sm.JointDamper("c", "rail", 8.0),
    "law": sm.JointDamper("c", "rail", law=lambda v: 8.0 * v),
    "motor": sm.Motor("c", "rail", lambda x, v, t: -8.0 * v),
    "damper": sm.Damper("c", sm.GROUND, "mass", at=(0, 0, -5), second_at="center", damping=8.0),
    "beyond oscillation": sm.JointDamper("c", "rail", 100.0),
}


@pytest.mark.parametrize("kind", RESISTS)
def test_a_mass_under_its_weight(kind: str) -> None:
    """`2 s^2 + c s + 200 = 0` about where it hangs, with the errors of a run that has none."""
    scene = sm.Scene(
        "mass",
        rigid_bodies=sm.RigidBody("mass", 2.0, (1, 1, 1)),
        joints=sm.Prismatic("rail", sm.GROUND, "mass", at=(0, 0, 0), axis=(0, 0, 1)),
        force_elements=[sm.JointSpring("k", "rail", 200.0), RESISTS[kind]],
        loads=sm.Gravity((0, 0, -9.81)),
        scheme="ep4",
        dt=0.01,
        t_end=1.0,
    )
    exact = upper(np.roots([2.0, 100.0 if kind == "beyond oscillation" else 8.0, 200.0]))[0]
    made = sm.modes(scene, count=1, loaded=True, pictures=False, errors=kind == "damper")
    assert values(made) == pytest.approx([exact], rel=1e-8)
    assert made.table["stable"].tolist() == [1]
    assert not made.warnings
    if kind == "damper":
        assert made.errors["value"].tolist() == pytest.approx([exact.imag / (2 * np.pi)])


TAU = 1e-4
STEEL = sm.RectangularSection(70e9, 0.0, width=0.1, height=0.01, density=2700.0)
EI, LINE = 70e9 * 0.1 * 0.01**3 / 12, 2700.0 * 0.1 * 0.01


def column(P: float, model: Any = "exact", **damping: float) -> sm.Scene:
    section, line = replace(STEEL, **damping), sm.Line((0, 0, 0), (1, 0, 0))
    return sm.Scene(
        "column",
        beams=sm.Beam("beam", line, section, elements=6, model=model),
        supports=sm.Clamped("start"),
        loads=sm.FollowerForce("end", (-P * EI, 0, 0)) if P else sm.Gravity((0, 0, -0.01)),
        scheme="ep",
        dt=0.25,
        t_end=1.0,
    )


def test_a_damped_column_under_a_force_that_follows() -> None:
    """Beck's column with Kelvin and Voigt's damping, which makes it flutter from below 20.05 on.

    `(1 + tau s) d^4 w + P d^2 w + s^2 w = 0`, clamped here, without bending and its slope there.
    """
    unit = np.sqrt(EI / LINE)

    def condition(s: complex, P: float) -> complex:
        r = np.roots([1 + TAU * unit * s, 0, P, 0, s * s])
        rows = [np.ones(4), r, r**2 * np.exp(r), r**3 * np.exp(r)]
        return complex(np.linalg.det(rows) / np.prod(np.diff(r)))

    for P, grows in ((10.0, False), (18.0, True)):
        made = sm.modes(column(P, stiffness_damping=TAU), count=2, loaded=True, pictures=False)
        assert bool(made.warnings) is grows
        for s in values(made)[:2] / unit:
            root = complex(s)
            for _ in range(30):
                h = 1e-5 * abs(root)
                slope = (condition(root + h, P) - condition(root - h, P)) / (2 * h)
                root -= condition(root, P) / slope
            # shear and rotary inertia of a beam of this height
            assert abs(s - root) < 2e-3 * abs(root)
            assert s.real == pytest.approx(root.real, rel=0.02, abs=1e-3)


@pytest.mark.parametrize("kind", ["beam", "shell", "mass", "modal"])
def test_damping_of_sections(kind: str) -> None:
    """Damping ratios `tau w/2` and `rate/(2 w)` of the frequencies without it."""
    tau, rate = (0.0, 3.0) if kind == "mass" else (TAU, 0.0)
    damping = {"stiffness_damping": tau, "mass_damping": rate}
    model = sm.Modal(6) if kind == "modal" else "exact"
    scenes = [column(0.0, model), column(0.0, model, **damping)]
    if kind == "shell":
        metal = sm.Isotropic(70e9, 0.3, 5e-3, 2700.0)
        held = {"supports": sm.Clamped("left"), "loads": sm.Gravity((0, 0, -1e-3))}
        scenes = [
            replace(
                scenes[0],
                beams=(),
                shells=sm.Shell("plate", sm.Rectangle(1.0, 0.2), section, mesh=(4, 1)),
                **held,
            )
            for section in (metal, replace(metal, **damping))
        ]
    plain, made = (sm.modes(s, count=3, loaded=True, pictures=False) for s in scenes)
    omega = plain.table["omega_rad_per_s"].to_numpy()
    zeta = tau * omega / 2 + rate / (2 * omega)
    exact = omega * (-zeta + 1j * np.sqrt(1 - zeta**2))
    # strains of the load's own bending are so small that they change nothing
    assert np.abs(values(made) / exact - 1).max() < 1e-5
    assert plain.table["growth_per_s"].tolist() == [0.0, 0.0, 0.0]


def test_what_is_left_out_is_said() -> None:
    """On static paths the load factor is unknown: modes are without damping, and they say so."""
    scene = ziegler(2.0, 0.5, "static", sm.PointForce)
    across = sm.PointForce("end", (0, 0.1, 0), body="B")
    path = sm.PathFollowing(load_end=1.0)
    scene = replace(scene, loads=across, path=path, t_end=10.0)
    made = sm.modes(scene, count=2, loaded=True, pictures=False)
    assert any("damping (dampers" in s and "is left out" in s for s in made.warnings)
    assert made.table["growth_per_s"].tolist() == [0.0, 0.0]
