"""Natural modes of beams and rigid bodies."""

import math
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import shellmb as sm
from shellmb.errors import ConvergenceError
from shellmb.running.natural_modes.run import find_modes, write_found
from shellmb.running.natural_modes.vibration import natural_modes
from shellmb.scene import (
    Beam,
    Clamped,
    JointSpring,
    Line,
    PointForce,
    RectangularSection,
    Revolute,
    RigidBody,
    Scene,
    Weld,
)

E, RHO, B, H, L = 2e11, 7800.0, 0.02, 0.01, 1.0
BEAM = Beam(
    "bar",
    Line((0, 0, 0), (L, 0, 0)),
    RectangularSection(E=E, nu=0.3, width=B, height=H, density=RHO),
    elements=8,
)
WEAK, STIFF = B * H**3 / 12, H * B**3 / 12


def bernoulli(inertia: float, root: float) -> float:
    """Angular frequency of a slender beam."""
    return root**2 * math.sqrt(E * inertia / (RHO * B * H)) / L**2


def test_cantilever() -> None:
    """Both planes; shear and rotary inertia lower the third by (k h)^2, 0.2 %."""
    scene = Scene("cantilever", beams=BEAM, supports=Clamped("start"))
    modes = natural_modes(scene, count=4)
    roots = (1.87510407, 4.69409113)
    exact = sorted(bernoulli(i, r) for i in (WEAK, STIFF) for r in roots)
    np.testing.assert_allclose(modes.omega, exact, rtol=3e-3)
    assert modes.rigid == 0


def test_free_beam_has_six_rigid_modes() -> None:
    """Six rigid motions, then bending; elements of a quarter wave are 0.02 % too stiff."""
    modes = natural_modes(Scene("free", beams=BEAM, scheme="ep", dt=1.0, t_end=1.0), count=8)
    assert modes.rigid == 6
    exact = [bernoulli(inertia, 4.73004074) for inertia in (WEAK, STIFF)]
    np.testing.assert_allclose(modes.omega[6:], exact, rtol=3e-3)


def test_tip_mass_on_a_weld(tmp_path) -> None:  # type: ignore[no-untyped-def]
    """Rayleigh: a heavy tip mass with 33/140 of the beam's, 0.2 % too high at that ratio."""
    hub = RigidBody("hub", 2.0, (1e-3, 2e-3, 2e-3), position=(L, 0, 0), points={"out": (0.2, 0, 0)})
    scene = Scene(
        "tip mass",
        beams=BEAM,
        rigid_bodies=hub,
        supports=Clamped("start"),
        joints=Weld("weld", "bar", "hub", at="end"),
    )
    modes, _ = write_found(partial(find_modes, count=2), scene, tmp_path / "modes")
    mass = 2.0 + 33 / 140 * RHO * B * H * L
    exact = [math.sqrt(3 * E * inertia / L**3 / mass) for inertia in (WEAK, STIFF)]
    np.testing.assert_allclose(modes.omega, exact, rtol=5e-3)
    assert (tmp_path / "modes" / "modes.png").stat().st_size > 0
    item = modes.model.rigid.index["hub"]  # type: ignore[union-attr]
    tip = modes.shapes[0]["bar"][np.argmax(modes.model.beams["bar"].mixed.nodes("u")[:, 0])]
    np.testing.assert_allclose(modes.shapes[0]["rigid bodies"][item, :3], tip, atol=1e-9)


def test_spring_pendulum_has_one_mode() -> None:
    """`omega^2 = k/J`; more modes than there are freedoms are refused."""
    arm = RigidBody("arm", 2.0, (0.01, 0.2, 0.2), com=(0.5, 0, 0))
    scene = Scene(
        "spring",
        rigid_bodies=arm,
        joints=Revolute("pin", "ground", "arm", at=(0, 0, 0), axis=(0, 1, 0)),
        force_elements=JointSpring("spring", "pin", stiffness=100.0),
        scheme="ep",
        dt=1.0,
        t_end=1.0,
    )
    modes = natural_modes(scene, count=1)
    assert modes.omega2[0] == pytest.approx(100.0 / (0.2 + 2.0 * 0.25))
    # of more than there are the eigensolver breaks down
    for count in (2, 6):
        with pytest.raises(ConvergenceError, match=f"count is {count}; there are 1 modes"):
            natural_modes(scene, count=count)


def test_without_a_number_there_are_as_many_modes_as_freedoms(tmp_path: Path) -> None:
    """Kind: a default that refuses mechanisms; two links under a weight have two of everything."""
    links = tuple(RigidBody(n, 1.0, (0.1,) * 3, (0, 0, z)) for n, z in (("a", 0.5), ("b", 1.5)))
    axis = {"axis": (0, 1, 0)}
    column = Scene(
        "column",
        rigid_bodies=links,
        joints=(
            Revolute("j", "ground", "a", at=(0, 0, 0), **axis),
            Revolute("k", "a", "b", at=(0, 0, 1), **axis),
        ),
        force_elements=tuple(JointSpring(f"on {n}", n, stiffness=5.0) for n in "jk"),
        loads=PointForce((0, 0, 2.0), (0, 0, -1.0), body="b"),
        scheme="static",
        t_end=1.0,
    )
    # K v = P G v of equal links of length one
    exact = 5.0 * (3 - 5**0.5) / 2, 5.0 * (3 + 5**0.5) / 2
    assert sm.modes(column, buckling=True).load_factors == pytest.approx(exact, rel=1e-9)
    # a directory may be given, in which nothing is left of the first try
    kinds: dict[str, dict[str, Any]]
    kinds = {"rest": {}, "loaded": {"loaded": True}, "turning": {"rates": [0.0]}}
    for name, how in kinds.items():
        assert len(sm.modes(column, tmp_path / name, pictures=False, **how).table) == 2
    with pytest.raises(ConvergenceError, match="count is 6; there are 2 modes"):
        sm.modes(column, count=6)
    welds = tuple(Weld(j.name, j.first, j.second, at=j.at) for j in column.joints)
    with pytest.raises(ConvergenceError, match="there are no modes"):
        sm.modes(replace(column, joints=welds, force_elements=()))
