"""Modes about states of what spins in a frame that does not: tops, rotors on supports that differ.

The kind: small motions of spinning bodies are those of their axes, and have gyroscopic forces,
whatever the frame turns with; what is not the same all around is said by a number.
"""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import shellmb as sm

SPIN = 40.0
A, C, WEIGHT = 0.28, 0.15, 2.0 * 9.81 * 0.3  # of the top, A about its tip


def top(inertia: tuple[float, float, float], scheme: str = "ep4") -> sm.Scene:
    """A heavy top that stands on its tip."""
    return sm.Scene(
        "top",
        rigid_bodies=sm.RigidBody("top", 2.0, inertia, com=(0, 0, 0.3)),
        joints=sm.Spherical("tip", "ground", "top", at=(0, 0, 0)),
        loads=sm.Gravity((0, 0, -9.81)),
        initial=sm.InitialVelocity(spin=(0, 0, SPIN)),
        scheme=scheme,
        dt=0.002,
        t_end=0.02,
    )


def test_a_top_has_its_modes_in_every_frame() -> None:
    """`A w^2 - C Spin w + m g l = 0` in space; from a frame that turns its rate is subtracted."""
    run = sm.run(top((A - 0.18, A - 0.18, C)), pictures=False)
    seen = np.roots([A, -C * SPIN, WEIGHT])
    for rate in (None, 0.0, 20.0, -10.0):
        given: Any = {} if rate is None else {"rates": [rate]}
        if rate:
            given |= {"axis": (0, 0, 1), "about": (0, 0, 0)}
        made = sm.modes(run, count=3, pictures=False, **given)
        exact = np.sort(np.abs(seen - (SPIN if rate is None else rate)))
        assert made.summary["omega_rad_per_s"][1:] == pytest.approx(exact, rel=1e-8)
        assert made.rigid == 1
        assert made.drift < 1e-8
        assert not made.warnings


def test_what_is_not_the_same_all_around_is_said() -> None:
    """Its coefficients vary in space: by 2 (J1 - J2) Spin, over the inertia of all, in a radian."""
    run = sm.run(top((0.10, 0.08, C)), pictures=False)
    assert sm.modes(run, count=3, pictures=False).drift < 1e-8
    made = sm.modes(run, count=3, rates=[0.0], pictures=False)
    slowest = made.summary["omega_rad_per_s"][1]
    # `J' = W J - J W` has the difference twice; about the centre it is (J1 + J2 + J3)/2
    share = math.sqrt(2) * 0.02 * SPIN / ((0.10 + 0.08 + C) / 2)
    assert made.drift == pytest.approx(share / slowest, rel=1e-6)
    (said,) = made.warnings
    assert "inertia" in said
    assert f"{made.drift:.2g}" in said


# bearings at the ends of a shaft, a disc between them
LENGTH, PLACE, RADIUS, YOUNG = 0.6, 0.2, 0.012, 210e9
MASS, POLAR, ACROSS = 10.0, 0.4, 0.2
STIFF, VISCOUS = (2e6, 8e6), (100.0, 400.0)
FAR = 1e5


def rotor(scheme: str, spin: float, flexible: bool) -> sm.Scene:
    """A disc on a shaft along x, in bearings that differ in y and z and are dampers, too."""
    ends = {"front": 0.0, "back": LENGTH}
    body, at = ("shaft", {"front": "start", "back": "end"}) if flexible else ("disc", {})
    place = {name: at.get(name, name) for name in ends}
    bearings: list[Any] = [
        part
        for name, x in ends.items()
        for axis, k, c in zip("yz", STIFF, VISCOUS, strict=True)
        for part in (
            sm.Spring(
                f"{axis} {name}",
                sm.GROUND,
                body,
                at=(x, -FAR * (axis == "y"), -FAR * (axis == "z")),
                second_at=place[name],
                stiffness=k,
            ),
            sm.Damper(
                f"{axis} {name} damper",
                sm.GROUND,
                body,
                at=(x, -FAR * (axis == "y"), -FAR * (axis == "z")),
                second_at=place[name],
                damping=c,
            ),
        )
    ]
    along = sm.Spring(
        "x", sm.GROUND, body, at=(-FAR, 0, 0), second_at=place["front"], stiffness=1e7
    )
    points = {name: (x, 0.0, 0.0) for name, x in ends.items()}
    disc = sm.RigidBody("disc", MASS, (POLAR, ACROSS, ACROSS), position=(PLACE, 0, 0))
    if not flexible:
        disc = replace(disc, points={n: (x - PLACE, 0.0, 0.0) for n, (x, *_) in points.items()})
    # nearly massless
    steel = sm.CircularSection(YOUNG, 0.3, radius=RADIUS, density=1e-1)
    whole = {
        "beams": sm.Beam("shaft", sm.Line((0, 0, 0), (LENGTH, 0, 0)), steel, elements=6),
        "joints": sm.Weld("hub", "shaft", "disc", at=(PLACE, 0, 0)),
    }
    return sm.Scene(
        "rotor",
        rigid_bodies=disc,
        force_elements=[*bearings, along],
        initial=sm.InitialVelocity(spin=(spin, 0, 0)),
        scheme=scheme,
        dt=5e-5,
        t_end=2e-4,
        **(whole if flexible else {}),
    )


def whirls(spin: float, flexible: bool) -> np.ndarray:
    """Eigenvalues of the disc by four coordinates: places in y and z, and slopes there."""
    a, b, EI = PLACE, LENGTH - PLACE, YOUNG * math.pi * RADIUS**4 / 4
    # what a force and a moment on the disc do to a shaft on rigid bearings
    bends = np.array([[a * a * b * b, a * b * (b - a)], [a * b * (b - a), a * a - a * b + b * b]])
    bends = bends / (3 * LENGTH * EI) * (1.0 if flexible else 0.0)
    # reactions of the bearings, and places and slopes that follow these
    share = np.array([[b, -1.0], [a, 1.0]]) / LENGTH
    M, D = np.diag([MASS, MASS, ACROSS, ACROSS]), np.zeros((4, 4))
    D[2, 3], D[3, 2] = POLAR * spin, -POLAR * spin
    # s-dependent bearings: one eigenvalue at a time from the undamped ones
    signs = np.diag([1.0, -1.0])

    def matrix(s: complex) -> np.ndarray:
        K = np.zeros((4, 4), dtype=complex)
        for place, (k, c) in enumerate(zip(STIFF, VISCOUS, strict=True)):
            compliance = bends + share.T @ share / (k + s * c)
            # v and its slope dv/dx: about z it is that, about y its opposite
            turn = signs if place else np.eye(2)
            rows = [place, 3 - place]
            K[np.ix_(rows, rows)] = turn @ np.linalg.inv(compliance) @ turn
        return s * s * M + s * D + K

    K = matrix(0j).real
    first = np.block(
        [[np.zeros((4, 4)), np.eye(4)], [-np.linalg.solve(M, K), -np.linalg.solve(M, D)]]
    )
    found = []
    for s in np.linalg.eigvals(first):
        if s.imag > 0:
            for _ in range(50):
                h = 1e-6 * abs(s)
                slope = (np.linalg.det(matrix(s + h)) - np.linalg.det(matrix(s - h))) / (2 * h)
                s = s - np.linalg.det(matrix(s)) / slope
            found.append(s)
    return np.array(sorted(found, key=abs))


@pytest.mark.parametrize("flexible", [False, pytest.param(True, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "scheme", ["ep4", *(pytest.param(s, marks=pytest.mark.slow) for s in ("ep", "ed", "ed3"))]
)
def test_rotors_in_bearings_that_differ(scheme: str, flexible: bool) -> None:
    spin = 1000.0
    exact = whirls(spin, flexible)
    # the gyroscopic terms matter
    assert abs(exact / whirls(0.0, flexible) - 1).max() > 0.1
    run = sm.run(rotor(scheme, spin, flexible), pictures=False)
    made = sm.modes(run, count=6, pictures=False)
    assert made.rate == 0.0
    assert not made.warnings
    summary = made.summary
    found = np.array(summary["growth_per_s"]) + 1j * np.array(summary["omega_rad_per_s"])
    # shear of the shaft, what steps of 0.05 rad leave of the spin, and springs that are not endless
    close = 4e-3 if flexible else 1e-4
    for s in exact:
        assert abs(found - s).min() < close * abs(s)
