"""Thin-walled beams of kinked shells, all clamped at one end: L, T, Y and box sections."""

import math
from typing import Any

from mpi4py import MPI

import numpy as np
import pytest

from shellmb.demos.references.beams import timoshenko_frequencies
from shellmb.observers.account.energy import EnergyAccount
from shellmb.preprocessing.checked_model import checked_model
from shellmb.running.natural_modes.vibration import natural_modes
from shellmb.scene import Clamped, EdgeForce, Isotropic, Join, Rectangle, Scene, Shell
from shellmb.simulate.simulation import Simulation

L, B, T, E, RHO = 2.0, 0.2, 0.01, 7e10, 2700.0
SECTION = Isotropic(E=E, nu=0.0, thickness=T, density=RHO)
FORCE = 20.0


def section(walls: dict[str, tuple[tuple, tuple]], joins: list[Join], **options: Any) -> Scene:
    """Walls along x, each with the corner it begins at and its direction across; all clamped."""
    shells = [
        Shell(name, Rectangle(L, B, origin=origin, axis2=across), SECTION, mesh=(4, 1))
        for name, (origin, across) in walls.items()
    ]
    supports = [Clamped("left", body=name) for name in walls]
    return Scene("section", shells, supports=supports, joins=joins, **options)


def box(**options: Any) -> Scene:
    corners = [(0, 0, 0), (0, B, 0), (0, B, B), (0, 0, B)]
    across = [(0, 1, 0), (0, 0, 1), (0, -1, 0), (0, 0, -1)]
    names = ["floor", "right", "roof", "left"]
    walls = dict(zip(names, zip(corners, across, strict=True), strict=True))
    joins = [Join(a, b, "top", "bottom") for a, b in zip(names, names[1:] + names[:1], strict=True)]
    return section(walls, joins, **options)


def tee(**options: Any) -> Scene:
    across = {"web": (0, 0, -1), "right": (0, 1, 0), "left": (0, -1, 0)}
    joins = [Join("web", flange, "bottom", "bottom") for flange in ("right", "left")]
    return section({k: ((0, 0, 0), v) for k, v in across.items()}, joins, **options)


def angle(**options: Any) -> Scene:
    across = {"lying": (0, 1, 0), "standing": (0, 0, 1)}
    joins = [Join("lying", "standing", "bottom", "bottom")]
    return section({k: ((0, 0, 0), v) for k, v in across.items()}, joins, **options)


def star(pairs: tuple[str, ...], **options: Any) -> Scene:
    """Three walls that meet at 120 degrees, joined pair by pair."""
    c, s = math.cos(math.pi / 6), math.sin(math.pi / 6)
    across = {"a": (0, 0, 1), "b": (0, c, -s), "c": (0, -c, -s)}
    joins = [Join(*pair, "bottom", "bottom") for pair in pairs]
    return section({k: ((0, 0, 0), v) for k, v in across.items()}, joins, **options)


def shear_force(*webs: str) -> list[EdgeForce]:
    """A force along z at the free end, spread over the webs."""
    return [EdgeForce("right", (0, 0, FORCE / B / len(webs)), body=web) for web in webs]


def displacement(simulation: Simulation, wall: str, point: tuple[float, float, float]) -> Any:
    body = simulation.model.shells[wall]
    node = np.argmin(np.linalg.norm(body.mixed.nodes("u") - point, axis=1))
    return simulation.problem.state(wall).x.array[body.mixed.dofs["u"].reshape(-1, 3)[node]]


# second moment of area and shear area: of a box 5/12 of it all (Cowper 1966, nu = 0), of the T its
# web, times 5/6, which leaves out the small share of the flange
BOX = (2 / 3 * B**3 * T + B * T**3 / 6, 5 / 12 * 4 * B * T)
TEE = (B**3 * T / 4, 5 / 6 * B * T)


def tip(inertia: float, area: float) -> float:
    """Deflection of a Timoshenko cantilever by a force at its end."""
    return FORCE * L**3 / (3 * E * inertia) + FORCE * L / (E / 2 * area)


def box_frequency() -> float:
    """First circular frequency of the box as a Timoshenko beam with rotary inertia."""
    inertia, area = BOX
    mass, shear = RHO * 4 * B * T, E / 2 * area
    stiffness, rotary = E * inertia, RHO * inertia
    found = timoshenko_frequencies("clamped-free", 1, stiffness, L, mass, shear, rotary)
    return float(found[0])


@pytest.mark.parametrize("scheme", ["linear-statics", "static"])
def test_bending_of_a_clamped_box(scheme: str) -> None:
    times = {} if scheme == "linear-statics" else {"dt": 1.0}
    simulation = Simulation(box(scheme=scheme, loads=shear_force("left", "right"), **times))
    # one kink at each corner of the clamped end ties two directors that are both held
    owners = {item.row.owner for item in simulation.redundant}
    assert len(owners) == 4
    assert "kink between 'left' and 'floor' at (0, 0, 0)" in owners
    simulation.run()
    # 4 elements along the beam; the walls' own bending at the corners is 1e-3 of it
    found = displacement(simulation, "right", (L, B, B / 2))[2]
    assert found == pytest.approx(tip(*BOX), rel=2e-3)


def test_bending_of_a_clamped_tee() -> None:
    simulation = Simulation(tee(scheme="linear-statics", loads=shear_force("web")))
    simulation.run()
    found = displacement(simulation, "web", (L, 0, -B))[2]
    # shear is 1.8 % of it, what its coefficient leaves out some tenths of that
    assert found == pytest.approx(tip(*TEE), rel=5e-3)


def test_frequencies_of_a_clamped_box() -> None:
    exact = box_frequency()
    found = natural_modes(box(), count=2).omega
    # a square bends both ways alike
    assert found[0] == pytest.approx(exact, rel=2e-3)
    assert found[1] == pytest.approx(found[0], rel=1e-6)


@pytest.mark.parametrize(("scheme", "steps"), [("ep", 24), ("ed", 12)])
def test_a_clamped_box_swings_with_its_first_mode(scheme: str, steps: int) -> None:
    """Under a force that is there at once it swings about the static deflection."""
    half = math.pi / box_frequency()
    options = {"scheme": scheme, "dt": half / steps, "t_end": half}
    energy = EnergyAccount()
    simulation = Simulation(box(loads=shear_force("left", "right"), **options))
    simulation.run([energy])
    # the first mode has 97 % of the deflection, and twice the static one after half its period
    found = displacement(simulation, "right", (L, B, B / 2))[2]
    assert found == pytest.approx(2 * tip(*BOX), rel=0.05)
    assert abs(energy.relative_error) < 1e-9


def test_an_angle_moves_and_goes_on_from_a_saved_state() -> None:
    options = {"scheme": "ep", "dt": 1e-3, "t_end": 2e-3, "loads": shear_force("standing")}
    whole = Simulation(angle(**options))
    whole.advance()
    saved = whole.arrays(), whole.state()
    whole.advance()
    rest = Simulation(angle(**options))
    rest.restore(*saved)
    rest.run()
    assert rest.step == whole.step == 2
    for name, array in whole.live().items():
        np.testing.assert_allclose(rest.live()[name], array, rtol=1e-7, atol=1e-9)


def test_an_angle_twists_first_and_bends_about_its_weak_axis_next() -> None:
    found = natural_modes(angle(), count=2)
    assert found.rigid == 0
    # legs of t b^3 / 3 about the corner, the centre of shear: G J / (rho I_p) = G t^2 / (rho b^2)
    twist = math.pi / (2 * L) * math.sqrt(E / 2 / RHO) * T / B
    weak = B**3 * T / 12
    bending = 1.8751**2 * math.sqrt(E * weak / (2 * RHO * B * T)) / L**2
    # the clamped end does not warp through its thickness, and shear is left out
    np.testing.assert_allclose(found.omega, [twist, bending], rtol=0.02)


def test_joining_each_wall_to_both_others_changes_nothing() -> None:
    """Links that run in a circle, and at each of nine nodes one kink too many."""
    options = {"scheme": "linear-statics", "loads": shear_force("a")}
    tips, counts = [], []
    for joined in (("ab", "ac"), ("ab", "bc", "ca")):
        simulation = Simulation(star(joined, **options))
        simulation.run()
        tips.append(displacement(simulation, "a", (L, 0, B)))
        counts.append(len(simulation.redundant))
    np.testing.assert_allclose(tips[1], tips[0], rtol=1e-9, atol=1e-14)
    # at the clamped end all of them
    assert counts == [2, 8 + 3]


def test_the_last_kink_is_the_one_that_is_left_out() -> None:
    _, redundant = checked_model(star(("ab", "ac", "bc"), scheme="linear-statics"), MPI.COMM_WORLD)
    last = [item for item in redundant if item.with_]
    assert len(last) == 8
    assert all(item.row.body == "kink between 'b' and 'c'" for item in last)
