"""Volumes that shells enclose: gases and fluids inside, in motion and on paths."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

from mpi4py import MPI

import numpy as np
import pytest
import scipy.linalg

import shellmb as sm
from shellmb.errors import SceneError
from shellmb.model.model import Model
from shellmb.model.potentials import volume as module
from shellmb.model.potentials.volume import ReferenceCones
from shellmb.running.execute import RunResult, execute
from shellmb.scene import (
    Clamped,
    Cylinder,
    Disc,
    EnclosedVolume,
    Fixed,
    Gas,
    InitialVelocity,
    Isotropic,
    Join,
    PathFollowing,
    PointForce,
    Pressure,
    Probe,
    Scene,
    Shell,
    Sphere,
    SymmetryPlane,
)
from shellmb.simulate.simulation import Simulation

SKIN = Isotropic(E=1e3, nu=0.3, thickness=0.02, density=1.0)
PLANES = [
    SymmetryPlane("left", (0, 1, 0)),
    SymmetryPlane("right", (1, 0, 0)),
    SymmetryPlane("top", (0, 0, 1)),
]


def octant(flip: bool = False, **more: Any) -> Scene:
    """An eighth of a sphere between planes of symmetry."""
    surface = Sphere(1.0, polar=(0, 90), azimuth=(0, 90), flip=flip)
    shell = Shell("ball", surface, SKIN, mesh=(2, 2))
    probes = [Probe("pole", "pole", component=2), Probe("rim", "left-top", component=0)]
    return Scene("ball", shell, supports=PLANES, probes=probes, **({"dt": 1.0} | more))


def ball(**more: Any) -> Scene:
    """A whole sphere."""
    shell = Shell("ball", Sphere(1.0, polar=(0, 180)), SKIN, mesh=(2, 2))
    return Scene("ball", shell, **more)


def columns(run: RunResult) -> dict[str, Any]:
    return {name: values.to_numpy() for name, values in run.history.items()}


@pytest.mark.parametrize("scheme", ["ep", "ed", "ep4", "ed3"])
def test_a_gas_in_a_ball_that_flies_keeps_energy_and_momenta(scheme: str) -> None:
    run = execute(
        ball(
            volumes=EnclosedVolume("gas", gas=Gas(5.0, ambient=1.0)),
            initial=InitialVelocity(linear=(0.1, -0.2, 0.3), spin=(1.0, 2.0, -1.5)),
            scheme=scheme,
            dt=0.02,
            t_end=0.06,
        )
    )
    found = columns(run)
    # it breathes: volume and pressure change by much, and by the law of the gas
    ratio = found["gas.volume"] / found["gas.volume"][0]
    assert ratio.max() > 1.2
    assert found["gas.pressure"] == pytest.approx(5.0 * ratio**-1.4 - 1.0, rel=1e-12)
    # round-off; energies go up to 1.5, and the gas gives what the shell gets
    assert np.abs(found["energy_balance"]).max() < 1e-12
    assert found["gas.energy"].min() < -0.1 and found["strain_energy"].max() > 0.01
    # a gas loses nothing, so there is no column of it
    assert {n for n in found if n.startswith("gas.")} == {
        "gas.volume",
        "gas.pressure",
        "gas.energy",
    }
    for axis in "xyz":
        column = found[f"momentum_{axis}"]
        assert column == pytest.approx(column[0], abs=1e-12)


def test_motion_energy_and_pressure_have_one_law(monkeypatch: pytest.MonkeyPatch) -> None:
    """The kind: a reported pressure that is another writing of the law than the energy is."""

    def run() -> dict[str, Any]:
        gas = EnclosedVolume("gas", gas=Gas(5.0, ambient=1.0))
        return columns(execute(octant(volumes=gas, scheme="ep", dt=0.02, t_end=0.06)))

    before, written = run(), module.forms.gas_energy
    monkeypatch.setattr(module.forms, "gas_energy", lambda *given: 1.5 * written(*given))
    after = run()
    law = 5.0 * (after["gas.volume"] / after["gas.volume"][0]) ** -1.4 - 1.0
    # round-off, as above
    assert after["gas.pressure"] == pytest.approx(1.5 * law, rel=1e-12)
    assert np.abs(after["energy_balance"]).max() < 1e-12
    assert abs(after["gas.volume"][-1] / before["gas.volume"][-1] - 1) > 1e-3


@pytest.mark.parametrize("filling", [{"gas": Gas(5.0, ambient=1.0)}, {}])
def test_ep_keeps_the_angular_momentum_of_what_is_filled(filling: dict[str, Any]) -> None:
    """Forces of a volume of one shell or of two have no moment, whatever they do in a step."""
    flying = {"initial": InitialVelocity(linear=(5.0, -1.0, 2.0), spin=(1.0, 2.0, -1.5))}
    one = ball(volumes=EnclosedVolume("in", **filling), scheme="ep", dt=0.04, t_end=0.12, **flying)
    two = replace(
        one,
        shells=[
            Shell("upper", Sphere(1.0), SKIN, mesh=(2, 2)),
            Shell("lower", _Lower(), SKIN, mesh=(2, 2)),
        ],
        joins=Join("upper", "lower", "top", "top"),
        volumes=EnclosedVolume("in", ("upper", "lower"), **filling),
    )
    ends = []
    for scene in (one, two):
        found = columns(execute(scene))
        ends.append(found["in.pressure"][-1])
        spin = np.array([found[f"angular_momentum_{axis}"] for axis in "xyz"])
        # round-off; worst seen 5e-16 of the largest
        assert np.abs(spin - spin[:, :1]).max() < 1e-14 * np.abs(spin).max()
        assert np.abs(found["energy_balance"]).max() < 1e-12
    assert ends[0] == pytest.approx(ends[1], rel=1e-8)


def test_a_dome_of_gas_turns_on_its_plane_for_ever() -> None:
    dome = Scene(
        "dome",
        Shell("dome", Sphere(1.0), SKIN, mesh=(2, 2)),
        supports=SymmetryPlane("top", (0, 0, 1)),
        volumes=EnclosedVolume("gas", gas=Gas(5.0, ambient=1.0)),
        initial=InitialVelocity(spin=(0, 0, 2.0)),
        scheme="ep",
        dt=0.04,
        t_end=0.12,
    )
    spin = columns(execute(dome))["angular_momentum_z"]
    assert spin == pytest.approx(spin[0], rel=1e-14)


def test_a_volume_that_cannot_turn_has_no_rotation() -> None:
    gas = EnclosedVolume("gas", gas=Gas(5.0))
    moving: dict[str, Any] = {"scheme": "ep", "dt": 0.02, "t_end": 0.02}
    parts = {
        name: Simulation(scene).model.volumes[0].mixed.parts
        for name, scene in {
            "ball": ball(volumes=gas, **moving),
            "octant": octant(volumes=gas, **moving),
            "ball in ep4": ball(volumes=gas, **moving | {"scheme": "ep4"}),
        }.items()
    }
    assert [set(p) - {"v", "mu"} for p in parts.values()] == [{"rotation", "couple"}, set(), set()]


@pytest.mark.parametrize(
    ("scheme", "order"),
    [
        ("ep4", 3.7),
        pytest.param("ed", 1.8, marks=pytest.mark.slow),
        pytest.param("ed3", 2.2, marks=pytest.mark.slow),
    ],
)
def test_angular_momentum_is_kept_to_the_order_of_the_scheme(scheme: str, order: float) -> None:
    off = []
    for dt in (0.02, 0.01):
        found = columns(
            execute(
                ball(
                    volumes=EnclosedVolume("gas", gas=Gas(5.0, ambient=1.0)),
                    initial=InitialVelocity(spin=(1.0, 2.0, -1.5)),
                    scheme=scheme,
                    dt=dt,
                    t_end=0.06,
                )
            )
        )
        spin = np.array([found[f"angular_momentum_{axis}"] for axis in "xyz"])
        off.append(np.abs(spin - spin[:, :1]).max())
    assert math.log2(off[0] / off[1]) > order


@pytest.mark.parametrize("scheme", ["ep4", pytest.param("ep", marks=pytest.mark.slow)])
@pytest.mark.parametrize("exponent", [1.4, pytest.param(1.0, marks=pytest.mark.slow)])
def test_a_gas_that_hardly_changes_is_a_spring(scheme: str, exponent: float) -> None:
    # kind: energies of order one that change by 1e-12 in a step. A difference of them over the
    # change of the volume has no digits, and steps were refused however small they were
    p0, push, w = 10.0, 1e-6, 0.1
    exact = (2 * SKIN.E * SKIN.thickness / (1 - SKIN.nu) + 3 * exponent * p0) / SKIN.thickness
    run = execute(
        replace(
            octant(),
            loads=(Pressure(push),),
            volumes=(EnclosedVolume("air", gas=Gas(p0, exponent)),),
            scheme=scheme,
            dt=w / exact**0.5,
            t_end=20 * w / exact**0.5,
        )
    )
    found = columns(run)
    breath = 3 * push / SKIN.thickness / exact * (1 - np.cos(w * np.arange(len(run.history))))
    volume = found["air.pressure"] / -exponent / p0
    # the mesh of four elements, 1 %, and EP's period
    assert volume == pytest.approx(breath, abs=0.02 * breath.max())
    # the energy is known to round-off of the volume's change, and is of the order of its square;
    # ten times the worst over kernels of BLAS, 2.1
    limit = 25 * np.finfo(float).eps / breath.max()
    assert np.abs(found["energy_balance"]).max() < limit * found["kinetic_energy"].max()


@pytest.mark.parametrize(
    "scheme", ["ed", "ep4", *(pytest.param(s, marks=pytest.mark.slow) for s in ("ep", "ed3"))]
)
def test_a_fluid_keeps_its_volume(scheme: str) -> None:
    pushed = {"loads": PointForce("pole", (0, 0, -1.0)), "scheme": scheme, "t_end": 0.06}
    found = columns(execute(octant(volumes=EnclosedVolume("water"), **pushed | {"dt": 0.02})))
    assert found["water.volume"] == pytest.approx(found["water.volume"][0], rel=1e-12)
    assert np.abs(found["energy_balance"]).max() < 1e-12
    # the pole goes down and the rim out
    assert found["pole"][-1] < -0.01 and found["rim"][-1] > 1e-4


@pytest.mark.parametrize("pressure", [0.0, 100.0])
def test_matrices_have_the_stiffness_of_a_gas(pressure: float) -> None:
    """A ball breathes at `rho h w^2 = 2 E h/((1 - nu) R^2) + 3 gamma p/R` (thin sphere)."""
    gas = EnclosedVolume("gas", gas=Gas(pressure)) if pressure else ()
    found = sm.matrices(octant(volumes=gas, scheme="ep", t_end=1.0))
    squares, shapes = scipy.linalg.eigh(found.K.toarray(), found.M.toarray())
    s = math.sqrt(0.5)
    outwards = [
        sum(n * (found.row(place, component=k) @ shapes) for k, n in enumerate(place))
        for place in ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (s, 0.0, s))
    ]
    least, most = np.sort([np.min(outwards, axis=0), np.max(outwards, axis=0)], axis=0)
    # others go in and out at once, of which one is off by 0.8 % only
    alike = squares[np.minimum(least / most, most / least) > 0.5]
    exact = (2 * 1e3 / 0.7 + 3 * 1.4 * pressure / 0.02) / 1.0
    # of the mesh: 9e-4; without the gas's part the nearest were off by 17 %
    assert np.abs(alike / exact - 1).min() < 3e-3


@pytest.mark.parametrize("flip", [False, True])
def test_a_given_volume_has_the_pressure_that_such_a_load_would_be(flip: bool) -> None:
    change = 0.05
    filled = octant(flip, volumes=EnclosedVolume("oil", change=lambda t: change * t))
    found = columns(execute(filled))
    pressure = found["oil.pressure"][-1]
    # of a thin sphere, to the 0.3 % of the mesh: S = E/(1 - nu) (s^2 - 1)/2, p s^2 = 2 h S s
    stretch = (1 + change) ** (1 / 3)
    exact = 2 * 0.02 * 1e3 / 0.7 * (stretch**2 - 1) / 2 / stretch
    assert pressure == pytest.approx(exact, rel=3e-3)
    assert found["oil.volume"][0] == pytest.approx(math.pi / 6, rel=3e-3)
    by_load = columns(execute(octant(flip, loads=Pressure(-pressure if flip else pressure))))
    for name in ("pole", "rim"):
        # Newton's tolerance
        assert by_load[name][-1] == pytest.approx(found[name][-1], abs=1e-9)


def test_halves_that_are_joined_enclose_what_the_whole_does() -> None:
    half = Shell("upper", Sphere(1.0), SKIN, mesh=(2, 2))
    down = Shell("lower", _Lower(), SKIN, mesh=(2, 2))
    held = {
        "supports": [
            Fixed("pole", displacement=(0, 0, 0), body="upper"),
            Fixed((0, 0, -1.0), displacement=(0, 0, None), body="lower"),
            Fixed((1.0, 0, 0), displacement=(None, 0, None), body="upper"),
        ],
        "volumes": EnclosedVolume("oil", ("upper", "lower"), change=lambda t: 0.01 * t),
        "probes": Probe("far", (0, 0, -1.0), component=2, body="lower"),
        "dt": 1.0,
    }
    joined = Scene("ball", [half, down], joins=Join("upper", "lower", "top", "top"), **held)
    found = columns(execute(joined))
    supports = [
        Fixed("pole", displacement=(0, 0, 0)),
        Fixed("antipole", displacement=(0, 0, None)),
        Fixed((1.0, 0, 0), displacement=(None, 0, None)),
    ]
    volume = EnclosedVolume("oil", change=lambda t: 0.01 * t)
    whole = ball(
        supports=supports, volumes=volume, probes=Probe("far", "antipole", component=2), dt=1.0
    )
    other = columns(execute(whole))
    for name in ("oil.pressure", "oil.volume", "far"):
        # they have equal elements
        assert found[name][-1] == pytest.approx(other[name][-1], rel=1e-8)


class _Lower(Sphere):
    """The other half of a sphere."""

    def __init__(self) -> None:
        super().__init__(1.0)

    def position(self, xi: Any, eta: Any) -> Any:
        return super().position(xi, eta) * np.array([[1.0], [1.0], [-1.0]])

    def normal(self, x: Any) -> Any:
        return x / np.linalg.norm(x, axis=0)


def test_a_path_along_the_volume_ends_where_steps_do() -> None:
    volume = EnclosedVolume("oil", change=lambda factor: 0.3 * factor)
    path = columns(execute(octant(volumes=volume, path=PathFollowing(load_end=1.0), t_end=20.0)))
    steps = columns(execute(octant(volumes=volume)))
    for name in ("pole", "rim", "oil.pressure"):
        # the last factor is known to 1e-9
        assert path[name][-1] == pytest.approx(steps[name][-1], rel=1e-8)


def test_cubic_shells_enclose_a_volume() -> None:
    """The kind: inside a closed surface cones leave nothing, whatever degree and mesh are."""
    volume = EnclosedVolume("oil")
    scene = ball(volumes=volume, scheme="ep", dt=1e-3, t_end=1e-3).with_options(degree=3)
    cones = ReferenceCones(volume, Model(scene, MPI.COMM_WORLD).shells["ball"])
    _, left = cones.lids()
    assert np.abs(left).max() < 100 * np.finfo(float).eps
    # of patches of degree 2
    assert cones.volume() == pytest.approx(4 * np.pi / 3, rel=5e-3)


def test_what_encloses_no_volume_is_refused() -> None:
    fluid = EnclosedVolume("water")
    with pytest.raises(SceneError, match=r"'water': it is open at .*; every edge must be joined"):
        execute(replace(octant(volumes=fluid), supports=PLANES[:2]))
    with pytest.raises(SceneError, match=r"it is open at .* origin \(0.0, 0.0, 1.0\)"):
        execute(octant(volumes=EnclosedVolume("water", origin=(0, 0, 1.0))))
    # the volume under two lids is not that of the cones over the wall
    tube = Shell("tube", Cylinder(1.0, 1.0, angles=(0, 360)), SKIN, mesh=(6, 2))
    lids = {"supports": [Clamped("bottom"), Clamped("top")]}
    middle = EnclosedVolume("water", origin=(0, 0, 0.5), change=lambda t: t)
    with pytest.raises(SceneError, match=r"edges that do not move are in no common plane through"):
        execute(Scene("tube", tube, volumes=middle, **lids))
    with pytest.raises(SceneError, match="gas and change are given"):
        EnclosedVolume("both", gas=Gas(1.0), change=lambda t: t)
    with pytest.raises(SceneError, match=r"exponent is 0\.5"):
        Gas(1.0, 0.5)
    with pytest.raises(SceneError, match="'water': with scheme 'linear-statics'"):
        octant(volumes=fluid, scheme="linear-statics", loads=Pressure(1.0))
    with pytest.raises(SceneError, match="another potential, contact, joint, element or volume"):
        octant(volumes=[fluid, fluid])


def test_a_gas_that_sets_a_shell_in_motion_is_no_false_alarm() -> None:
    """Nothing comes from outside, and the energies sum up to zero: what was seen is the kinetic."""
    gas = EnclosedVolume("gas", gas=Gas(5.0, ambient=1.0))
    run = execute(octant(volumes=gas, scheme="ep", dt=0.02, t_end=0.06))
    assert run.history["kinetic_energy"].max() > 0.01
    assert run.summary["warnings"] == []


def test_a_clamped_dome_stands_on_its_plane() -> None:
    dome = Shell("dome", Sphere(1.0), SKIN, mesh=(2, 2))
    oil = EnclosedVolume("oil", change=lambda t: 0.01 * t)
    found = columns(execute(Scene("dome", dome, supports=Clamped("top"), volumes=oil, dt=1.0)))
    assert found["oil.volume"][0] == pytest.approx(2 * math.pi / 3, rel=4e-3)
    assert found["oil.pressure"][-1] > 0


def test_a_can_with_a_held_rim_is_closed_by_its_bottom() -> None:
    tube = Shell("tube", Cylinder(1.0, 1.0, angles=(0, 360)), SKIN, mesh=(8, 2))
    bottom = Shell("bottom", Disc(1.0), SKIN, mesh=(2, 2))
    # the origin is a point of the lid's plane, far from the bottom
    oil = EnclosedVolume("oil", ("tube", "bottom"), change=lambda t: 0.01 * t, origin=(0, 0, 1))
    can = Scene(
        "can",
        [tube, bottom],
        joins=Join("tube", "bottom", "bottom", "top"),
        supports=[Clamped("bottom", body="tube"), SymmetryPlane("top", (0, 0, 1), body="tube")],
        volumes=oil,
        dt=1.0,
    )
    found = columns(execute(can))
    # both have normals to opposite sides; the mesh is within 1 %
    assert found["oil.volume"][0] == pytest.approx(math.pi, rel=1e-2)
    assert found["oil.pressure"][-1] > 0


@pytest.mark.parametrize(
    ("first", "then"),
    [
        ("ep4", "ep"),
        *(pytest.param(*p, marks=pytest.mark.slow) for p in (("ep", "ed"), ("", "ep"))),
    ],
)
def test_a_motion_goes_on_in_another_scheme_or_filled_anew(
    first: str, then: str, tmp_path: Path
) -> None:
    """Volumes follow from where the shells are: EP has unknowns of them that others lack."""
    filling = EnclosedVolume("gas", gas=Gas(5.0, ambient=1.0))
    moving = {"initial": InitialVelocity(spin=(1.0, 2.0, -1.5)), "dt": 0.02, "t_end": 0.04}
    before = ball(volumes=filling, scheme=first, **moving) if first else ball(scheme="ep", **moving)
    execute(before, tmp_path / "before", pictures=False)
    start = sm.FromRun(tmp_path / "before")
    scene = ball(volumes=filling, scheme=then, start=start, dt=0.02, t_end=0.04)
    found = columns(execute(scene))
    assert found["gas.pressure"] == pytest.approx(
        5.0 * (found["gas.volume"] / 4.18079688) ** -1.4 - 1.0, rel=1e-6
    )
    # round-off; worst seen 1e-14
    assert np.abs(found["energy_balance"]).max() < 1e-12
