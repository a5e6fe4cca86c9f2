"""Friction and damping between shells that deform, and beams on them: what is kept, and lost.

The kind: forces that take energy in every step, book it, have no sum and no moment, and follow
Coulomb's law and Hunt and Crossley's, whatever the bodies, units and axes.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq

from shellmb.running.execute import execute
from shellmb.scene import (
    Beam,
    CircularSection,
    Clamped,
    Contact,
    Faces,
    Gravity,
    InitialVelocity,
    Isotropic,
    Line,
    Rectangle,
    Scene,
    Shell,
    Solver,
)
from tests.contact.test_faces import SIDE, SPEED, THICK, TURNED, momenta, plates

SLOW = pytest.mark.slow
OTHERS = [("ep4", None), ("ed", 0.5), ("ed3", 0.5)]
SCHEMES = [("ep", None), *[pytest.param(*s, marks=SLOW) for s in OTHERS]]
MU, CHI, SPIN = 0.3, 0.5, (0.5, -0.3, 5.0)
RUBS = {"friction": MU, "slip_speed": 1e-2, "relative_damping": CHI}
MASS = 2700.0 * THICK * SIDE**2


def rubbing(units: float = 1.0, radius: float = 2e-3, **more: Any) -> Scene:
    """Two free plates that meet and rub, one of which turns.

    Args:
        units: Units of length in a metre.
        radius: Distance of the surface from the points of the upper one, m.
        more: Of the contact and the scene.
    """
    scene = plates(units, **({"spin": SPIN, "t_end": 2e-3} | more))
    law = {"friction": MU, "slip_speed": 1e-2 * units, "relative_damping": CHI / units}
    faces = replace(scene.contacts[0].obstacle, thickness=(THICK - 2 * radius) * units)
    touch = replace(scene.contacts[0], obstacle=faces, radius=radius * units, **law)
    return replace(scene, contacts=touch)


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
@pytest.mark.parametrize("radius", [2e-3, pytest.param(0.0, marks=SLOW)])
def test_what_rubs_loses_energy_and_no_momentum(
    radius: float, scheme: str, alpha: float | None
) -> None:
    """EP keeps both momenta to round-off with friction, too; the others turn to their order."""
    found = execute(rubbing(radius=radius, scheme=scheme, alpha=alpha))
    history = found.history
    assert history["touch.energy"].iloc[-1] == 0
    # Newton's method leaves 1e-11 of the unknowns; 1e-14 was seen
    assert found.summary["energy_balance_error"] < 1e-10
    lost, start = history["touch.loss"].to_numpy(), history.total_energy.iloc[0]
    assert 0.1 < lost[-1] / start < 0.5 and np.diff(lost).min() >= -1e-13 * start
    assert np.max(np.diff(history.total_energy)) < 1e-11 * start
    scheme_takes = history.dissipation.to_numpy() - lost
    assert_allclose(scheme_takes, 0, atol=1e-13 * start) if alpha is None else None
    linear, angular = momenta(found)
    assert np.ptp(linear, axis=0).max() < 1e-11 * MASS * SPEED
    bound = {"ep": 1e-11}.get(scheme, 1e-4)
    assert np.ptp(angular, axis=0).max() < bound * MASS * SPEED * SIDE
    # slip is a hundred times the slip speed, and in nearly one direction
    normal, across = history["touch.normal"][1:], history["touch.friction"][1:]
    assert (across <= MU * normal * (1 + 1e-9)).all()
    pressed = normal > normal.max() / 2
    assert (across[pressed] > 0.9 * MU * normal[pressed]).all()


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["ep", "ep4"])
def test_units_and_axes(scheme: str) -> None:
    """Forces and losses are the same physics in other units and axes."""
    one = execute(rubbing(scheme=scheme)).history
    other = execute(rubbing(1e3, axes=TURNED, scheme=scheme)).history
    for name, factor in (("normal", 1.0), ("friction", 1.0), ("loss", 1e3)):
        size = np.nanmax(one[f"touch.{name}"])
        # what Newton's method leaves
        assert_allclose(other[f"touch.{name}"] / factor, one[f"touch.{name}"], atol=1e-7 * size)


@pytest.mark.slow
@pytest.mark.parametrize("twin", [{"solve": "full"}, {"newton": "full"}])
def test_other_ways_to_solve(twin: dict[str, Any]) -> None:
    """Entries of directors reach the reduced matrix through their tangents: steps are alike."""
    scene = rubbing()
    found = [execute(replace(scene, solver=Solver(tolerance=1e-11, **how))) for how in ({}, twin)]
    for name in ("touch.friction", "touch.loss", "touch.normal"):
        one, other = (f.history[name] for f in found)
        assert_allclose(other, one, atol=1e-8 * np.nanmax(one))
    # as few as for any step of this size: the derivatives are those of the forces
    assert all(f.summary["newton_iterations"] < 11 * f.summary["steps"] for f in found)


def rebound(speed: float, chi: float) -> float:
    """Speed after an impact with Hunt and Crossley's damping, whatever the force is.

    `v dv/dp = -F(p) (1 + chi v)/m` leaves `v/chi - ln(1 + chi v)/chi^2` as it is in size.
    """
    first = speed / chi - np.log1p(chi * speed) / chi**2
    last = brentq(lambda v: -v / chi - np.log1p(-chi * v) / chi**2 - first, 0, 1 / chi - 1e-12)
    return float(last)


@pytest.mark.slow
@pytest.mark.parametrize(("scheme", "alpha"), [("ep", None), ("ep4", None), ("ed3", 0.5)])
def test_restitution_of_plates_that_cover_one_another(scheme: str, alpha: float | None) -> None:
    """They meet as rigid ones do, at a relative speed that Hunt and Crossley's law gives back."""
    chi, results = 1.0, []
    for dt in (2e-5, 1e-5):
        scene = plates(scheme=scheme, alpha=alpha, shift=(0.0, 0.0), stiff=1e4, dt=dt)
        touch = replace(scene.contacts[0], relative_damping=chi)
        found = execute(replace(scene, contacts=touch))
        end = found.history.iloc[-1]
        assert end["touch.energy"] == 0 and (found.history["touch.Fz"].dropna() >= 0).all()
        # nothing vibrates: what is left is the motion apart
        results.append(np.sqrt(2 * end.kinetic_energy / MASS) * np.sqrt(2))
    expected = rebound(SPEED, chi)
    assert expected < 0.75 * SPEED
    errors = np.abs(np.array(results) - expected) / expected
    # of second order in the step, forty of which an impact takes: factors of 3.96 to 5.8 were seen
    assert errors[1] < 1e-3 and errors[1] < errors[0] / 3.5


def test_damping_does_not_attract() -> None:
    """Strong damping and a fast rebound: no step of any point pulls."""
    scene = plates(dt=2e-4, t_end=2e-3)
    touch = replace(scene.contacts[0], relative_damping=100.0)
    found = execute(replace(scene, contacts=touch)).history
    assert found["touch.normal"].max() > 100
    # sums of sizes are sizes of sums where all push one way; plates bend and turn by 1e-4
    assert_allclose(found["touch.Fz"][1:], found["touch.normal"][1:], rtol=1e-4, atol=1e-9)
    assert found["touch.loss"].iloc[-1] > 0.9 * (found.total_energy[0] / 2)


def pushed(share: float, **more: Any) -> Scene:
    """A plate that weighs on a clamped one and is pulled along it, by a turned weight.

    Args:
        share: The pull, in what friction holds.
        more: Of the scene.
    """
    section = Isotropic(70e9, 0.3, thickness=THICK, density=2700.0)
    low = Shell("low", Rectangle(SIDE, SIDE), section, mesh=(2, 2))
    size, g, k = 0.06, 9.81, 1e8
    up = Shell("up", Rectangle(size, size, origin=(0.07, 0.07, THICK)), section, mesh=(1, 1))
    touch = Contact(
        "touch",
        Faces("low", THICK / 2),
        k,
        "up",
        radius=3 * THICK / 4,
        smoothing=1e-6,
        friction=MU,
        slip_speed=1e-3,
        relative_damping=20.0,
    )
    return Scene(
        "pushed",
        [low, up],
        supports=[Clamped(edge, "low") for edge in ("left", "right", "bottom", "top")],
        contacts=touch,
        loads=Gravity((share * MU * g, 0, -g), body="up"),
        **({"scheme": "ed3", "alpha": 1.0, "dt": 1e-3, "t_end": 0.06} | more),
    )


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["ep", "ed3"])
def test_friction_holds_mu_n(scheme: str) -> None:
    """Below `mu N` it creeps at the speed that the regularised law tells, above it slides off."""
    g, slow, share = 9.81, 1e-3, 0.6
    alpha = 1.0 if scheme == "ed3" else None
    weight = 2700.0 * THICK * 0.06**2 * g
    held = execute(pushed(share, scheme=scheme, alpha=alpha)).history
    late = held.iloc[-20:]
    assert_allclose(late["touch.normal"].mean(), weight, rtol=0.02)
    assert_allclose(late["touch.friction"].mean(), share * MU * weight, rtol=0.02)
    creep = slow * share / np.sqrt(1 - share**2)
    momentum = weight / g * creep
    # the plate rocks by a little: edges of the plate below bend
    assert_allclose(late.momentum_x.mean(), momentum, rtol=0.2)
    slid = execute(pushed(2.0, scheme=scheme, alpha=alpha)).history
    late = slid.iloc[-20:]
    assert_allclose(late["touch.friction"].mean(), MU * weight, rtol=0.02)
    rise = np.diff(late.momentum_x).mean() / (1e-3 * weight / g)
    # twice what friction holds pulls
    assert_allclose(rise, MU * g, rtol=0.03)


def fallen(spin: float = 0.0, **more: Any) -> Scene:
    """A round beam that falls on a free plate and may turn about itself."""
    section = Isotropic(70e9, 0.3, thickness=THICK, density=2700.0)
    r = 4e-3
    plate = Shell("plate", Rectangle(SIDE, SIDE), section, mesh=(4, 4))
    line = Line((0.05, 0.03, THICK / 2 + r + 1e-4), (0.15, 0.16, THICK / 2 + r + 1e-4))
    beam = Beam("beam", line, CircularSection(70e9, 0.3, radius=r, density=2700.0), elements=4)
    touch = Contact("touch", Faces("plate", THICK), 1e6, "beam", radius=r, smoothing=2e-5, **RUBS)
    along = np.array([0.1, 0.13, 0.0]) / np.hypot(0.1, 0.13)
    start = InitialVelocity((0, 0, -0.5), tuple(spin * along), body="beam")
    given = {"scheme": "ep", "dt": 1e-4, "t_end": 3e-3, "contacts": touch, "initial": start}
    return Scene("fallen", plate, beams=beam, solver=Solver(tolerance=1e-11), **(given | more))


@pytest.mark.slow
@pytest.mark.parametrize(("scheme", "alpha"), [("ep", None), *OTHERS])
def test_a_beam_that_turns_about_itself_rolls(scheme: str, alpha: float | None) -> None:
    """Its frames feel the moment of friction: momenta are kept, and the spin drives it sideways."""
    found = execute(fallen(200.0, scheme=scheme, alpha=alpha))
    history = found.history
    assert history["touch.normal"].max() > 10
    assert found.summary["energy_balance_error"] < 1e-10
    # until it rolls, friction is across the beam, and as large as Coulomb's
    first = int(np.flatnonzero(history["touch.normal"] > 1)[0])
    pull = np.array([history[f"touch.F{a}"][first] for a in "xy"])
    assert_allclose(np.linalg.norm(pull), MU * history["touch.normal"][first], rtol=0.02)
    across = np.array([-0.13, 0.1]) / np.hypot(0.13, 0.1)
    assert pull @ across > 0.99 * np.linalg.norm(pull)
    linear, angular = momenta(found)
    size = 2700.0 * np.pi * 4e-3**2 * np.hypot(0.1, 0.13) * 0.5
    assert np.ptp(linear, axis=0).max() < 1e-10 * size
    # of EP what Newton's method leaves, of the others what their order leaves
    bound = {"ep": 1e-9}.get(scheme, 1e-3)
    assert np.ptp(angular, axis=0).max() < bound * size * SIDE


@pytest.mark.slow
def test_both_sides_of_a_face() -> None:
    """A plate between two others that meet it at once: their forces mirror one another."""
    scene = plates()
    low, up = scene.shells
    origin = (0.017, 0.024, -THICK / 2 - 1e-4)
    under = replace(up, name="under", surface=replace(up.surface, origin=origin))
    (touch,) = scene.contacts
    law = {"friction": MU, "slip_speed": 1e-2}
    touches = [replace(touch, **law), replace(touch, name="below", body="under", **law)]
    start = [
        InitialVelocity((0, 0, -SPEED), (0, 0, 5.0), body="up"),
        InitialVelocity((0, 0, SPEED), (0, 0, 5.0), body="under"),
    ]
    shells = [low, up, under]
    found = execute(replace(scene, shells=shells, contacts=touches, initial=start)).history
    assert found["touch.normal"].max() > 100
    for column, sign in (("Fz", -1), ("Fx", 1), ("Fy", 1), ("friction", 1), ("loss", 1)):
        one, other = found[f"touch.{column}"], found[f"below.{column}"]
        # the middle plate stays where it is, but that its triangles are the same from both sides
        assert_allclose(other, sign * one, atol=1e-9 * found["touch.normal"].max())
