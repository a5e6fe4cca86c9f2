"""Probes at any point of a body, between nodes too: values follow the functions of the element."""

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import shellmb as sm

STEEL = sm.Isotropic(E=210e9, nu=0.3, thickness=1e-2, density=7850.0)
ROUND = sm.CircularSection(210e9, 0.3, radius=0.02, density=7850.0, shear_correction=0.9)
LINEAR, SPIN = np.array([1.0, 2.0, 3.0]), np.array([0.3, -0.7, 1.1])
MOVING = ("position", "velocity")


def bodies(cell: str = "quad", degree: int = 2) -> dict[str, tuple[sm.Shell | sm.Beam, list]]:
    """Bodies of each kind, with points of them that are no nodes."""
    flat = sm.Shell("flat", sm.Rectangle(1.0, 0.5), STEEL, mesh=(3, 2), cell=cell, degree=degree)
    arc = np.radians([7.0, 31.0])
    drum = sm.Cylinder(2.0, 1.0, (0.0, 60.0), origin=(0.0, 0.0, 1.0))
    bent = sm.Shell("bent", drum, STEEL, mesh=(3, 2), cell=cell, degree=degree)
    line = sm.Line((0.0, 0.0, 3.0), (1.0, 1.0, 3.0))
    beam = sm.Beam("beam", line, ROUND, elements=3, degree=degree)
    return {
        "flat": (flat, [(0.377, 0.111, 0.0), (0.95, 0.499, 0.0), (0.5, 0.25, 0.0)]),
        "bent": (bent, [(2 * math.cos(a), 2 * math.sin(a), 1.41) for a in arc]),
        "beam": (beam, [(c, c, 3.0) for c in (0.1234, 0.77)]),
    }


def turning(cell: str, degree: int, scheme: str, **more) -> sm.Scene:
    """All of them in one rigid motion, as it begins."""
    made = bodies(cell, degree)
    probes = [
        sm.Probe(f"{name}_{k}_{quantity}_{c}", at, quantity, component=c, body=name)
        for name, (_, points) in made.items()
        for k, at in enumerate(points)
        for quantity in (*MOVING, *(("angular_velocity",) if name == "beam" else ()))
        for c in range(3)
    ]
    return sm.Scene(
        "turning",
        [made["flat"][0], made["bent"][0]],
        beams=made["beam"][0],
        initial=sm.InitialVelocity(linear=LINEAR, spin=SPIN),
        probes=probes,
        scheme=scheme,
        **{"dt": 1e-3, "t_end": 2e-3} | more,
    )


def vectors(row, name: str, k: int, quantity: str) -> np.ndarray:
    return np.array([row[f"{name}_{k}_{quantity}_{c}"] for c in range(3)])


@pytest.mark.parametrize(
    ("cell", "degree", "scheme"),
    [
        ("quad", 2, "ep"),
        pytest.param("tri", 2, "ed3", marks=pytest.mark.slow),
        pytest.param("quad", 3, "ep4", marks=pytest.mark.slow),
    ],
)
def test_a_rigid_motion_is_exact(cell: str, degree: int, scheme: str, tmp_path: Path) -> None:
    """Velocities are those of the motion at the place, which is on the body."""
    scene = turning(cell, degree, scheme)
    run = sm.run(scene, tmp_path / "run", pictures=False)
    first, last = run.history.iloc[0], run.history.iloc[-1]
    for name, (_, points) in bodies(cell, degree).items():
        for k, at in enumerate(points):
            place = vectors(first, name, k, "position")
            # elements of the drum are of order 2: off by 2 (20 degrees)^3/72 at most
            assert np.linalg.norm(place - at) < (1.3e-3 if name == "bent" else 1e-14)
            expected = LINEAR + np.cross(SPIN, place)
            assert vectors(first, name, k, "velocity") == pytest.approx(expected, abs=1e-13)
        for row in (first, last):
            ends = [vectors(row, name, k, "position") for k in range(len(points))]
            distances = [np.linalg.norm(end - ends[0]) for end in ends]
            if row is first:
                as_made = distances
        # not round-off: the spin stretches the bodies by 1e-7 or less
        assert distances == pytest.approx(as_made, abs=1e-6)
    spin = vectors(first, "beam", 1, "angular_velocity")
    assert spin == pytest.approx(SPIN, abs=1e-13)


def cantilever(n: int, at: float, load: float = 10.0) -> sm.Scene:
    beam = sm.Beam("beam", sm.Line((0, 0, 0), (1, 0, 0)), ROUND, elements=n)
    probes = [
        sm.Probe("w", (at, 0.0, 0.0), component=2),
        sm.Probe("m", (at, 0.0, 0.0), "moment", component="norm"),
    ]
    pull = sm.PointForce("end", (0, 0, load))
    return sm.Scene(
        "c", beams=beam, supports=sm.Clamped("start"), loads=pull, probes=probes,
        scheme="linear-statics",
    )  # fmt: skip


def test_values_converge_with_the_order_of_the_element() -> None:
    """A cantilever of Timoshenko's, at a point that is a node of none of the meshes."""
    at, load, r = 1 / math.pi, 10.0, 0.02
    bending = 210e9 * math.pi * r**4 / 4
    shear = 0.9 * 210e9 / 2.6 * math.pi * r**2
    exact = load * at**2 / 2 * (1 - at / 3) / bending + load * at / shear
    rows = [sm.run(cantilever(n, at)).history.iloc[-1] for n in (2, 4, 8)]
    errors = [abs(row["w"] - exact) / exact for row in rows]
    assert errors[0] / errors[2] > 4**2.6
    assert [row["m"] for row in rows] == pytest.approx([load * (1 - at)] * 3, rel=1e-9)


def test_points_off_a_body_are_refused_with_their_distance() -> None:
    """Also such as are off by less than the size of an element, or than a plate is thick."""
    for at, off in (((0.5, 0.2, 0.3), "0.3"), ((1.5, 0.2, 0), "0.5"), ((0.5, 0.2, 5e-3), "0.005")):
        plate = bodies()["flat"][0]
        probe = sm.Probe("far", at)
        scene = sm.Scene("off", plate, supports=sm.Clamped("left"), probes=probe)
        with pytest.raises(sm.SceneError, match=rf"is not on shell 'flat'; it is {off} m away"):
            sm.run(scene)


def plate(load: float = 3.0) -> sm.Scene:
    shell, points = bodies()["flat"]
    quantities = ("displacement", "membrane", "bending", "shear", "director")
    probes = [sm.Probe(q, points[0], q, component=0) for q in quantities]
    probes.append(sm.Probe("w", points[0]))
    loads = sm.EdgeForce("right", (load * 1e3, 0.0, load))
    return sm.Scene(
        "p", shell, supports=sm.Clamped("left"), loads=loads, probes=probes, scheme="linear-statics"
    )


def test_derivatives_know_them() -> None:
    found = sm.sensitivities(plate, ["load"])
    last = found.run.history.iloc[-1]
    table = found.history["load"].iloc[-1]
    for name in ("w", "displacement", "membrane", "bending", "shear"):
        assert table[name] == pytest.approx(last[name] / 3.0, rel=1e-6)


def moving(load: float = 3.0) -> sm.Scene:
    changes = {"scheme": "ep", "dt": 5e-3, "t_end": 0.02}
    return replace(plate(load), probes=sm.Probe("w", (0.877, 0.411, 0.0)), **changes)


def test_the_adjoint_knows_them() -> None:
    found = sm.adjoint(moving, lambda history: history["w"][-1], parameters=["load"])
    above, below = (sm.run(moving(3.0 + h)).history["w"].iloc[-1] for h in (1e-4, -1e-4))
    assert found.parameters["load"] == pytest.approx((above - below) / 2e-4, rel=1e-6)


def test_a_curved_beam_turns_as_one() -> None:
    """Directors between its nodes are no unit vectors, which changes no angular velocity."""
    arc = sm.Arc((1.0, 0.0, 0.0), (math.sqrt(0.5), math.sqrt(0.5), 0.0), (0.0, 1.0, 0.0))
    at = (math.cos(0.13), math.sin(0.13), 0.0)
    probes = [sm.Probe(f"w{c}", at, "angular_velocity", c, body="ring") for c in range(3)]
    scene = sm.Scene(
        "ring",
        beams=sm.Beam("ring", arc, ROUND, elements=3),
        initial=sm.InitialVelocity(spin=SPIN),
        probes=probes,
        scheme="ep",
        dt=1e-4,
        t_end=1e-4,
    )
    row = sm.run(scene).history.iloc[0]
    assert [row[f"w{c}"] for c in range(3)] == pytest.approx(SPIN, rel=1e-10)


@pytest.mark.mpi
def test_two_ranks_read_the_same(mpirun: Callable[..., str]) -> None:
    code = (
        f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r})\n"
        "import shellmb as sm\nfrom mpi4py import MPI\nimport test_between_nodes as t\n"
        "row = sm.run(t.plate(), pictures=False).history.iloc[-1]\n"
        "names = ('w', 'displacement', 'membrane', 'bending', 'shear', 'director')\n"
        "MPI.COMM_WORLD.rank or print(*(repr(float(row[n])) for n in names))"
    )
    one = sm.run(plate()).history.iloc[-1]
    two = [float(word) for word in mpirun(2, "-c", code).split()]
    names = ("w", "displacement", "membrane", "bending", "shear", "director")
    assert two == pytest.approx([float(one[n]) for n in names], rel=1e-8)
