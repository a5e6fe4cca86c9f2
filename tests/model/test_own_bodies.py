"""Bodies of a user's own in scenes: what supports, joints, loads, probes and files make of them.

The kind: any field with strains, mass and constraints, on any mesh, in all schemes. Momenta, the
same motion by `Motion`, another shape of the same scene and runs at both sides of a parameter
decide; energies must close as those of all bodies do.
"""

from pathlib import Path
from typing import Any

from mpi4py import MPI

import numpy as np
import pytest
import ufl
from dolfinx import fem, mesh

import shellmb as sm
from shellmb.demos.own_body import chain
from shellmb.simulate.simulation import BaseObserver, Simulation

SCHEMES = ("ep", "ed", "ep4", "ed3")
MASS = 1e3 * 0.25**2
C = 4e5 * (np.diag([1, 1, 1, 0.5, 0.5, 0.5]) + np.pad(np.ones((3, 3)), (0, 3)))


def space(comm: MPI.Comm, width: float = 0.25, cell: Any = mesh.CellType.hexahedron) -> Any:
    corners = [np.zeros(3), np.array([1.0, width, 0.25])]
    box = mesh.create_box(comm, corners, [2, 1, 1], cell)
    return fem.functionspace(box, ("Lagrange", 1, (3,)))


def green(u: Any) -> Any:
    G = (ufl.grad(u) + ufl.grad(u).T + ufl.grad(u).T * ufl.grad(u)) / 2
    return ufl.as_vector([G[0, 0], G[1, 1], G[2, 2], 2 * G[0, 1], 2 * G[0, 2], 2 * G[1, 2]])


def block(on: Any = space, density: float = 1e3, tip: float = 0.25, **more: Any) -> sm.OwnBody:
    given: Any = {
        "strain": green,
        "energy": C,
        "mass": lambda v, w: density * ufl.dot(v, w),
        "points": {"tip": (1.0, tip, 0.25)},
        "regions": {
            "left": lambda x: np.isclose(x[0], 0.0),
            "right": lambda x: np.isclose(x[0], 1.0),
        },
    }
    return sm.OwnBody("block", on, **given | more)


def scene(body: sm.OwnBody | None = None, **more: Any) -> sm.Scene:
    options: Any = {
        "supports": sm.Clamped("left", body="block"),
        "loads": sm.Gravity((0.0, 0.0, -9.81)),
        "probes": sm.Probe("tip", "tip", body="block"),
        "scheme": "ep4",
        "dt": 5e-3,
        "t_end": 0.02,
    }
    return sm.Scene("solid", own_bodies=body or block(), **options | more)


def run(made: sm.Scene) -> sm.Run:
    return sm.run(made, pictures=False)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_solid_in_a_mechanism_keeps_all_balances(scheme: str) -> None:
    """Held by bolts along a region of a hub that turns, with a bob on a ball at a corner."""
    hub, bob = (
        sm.RigidBody("hub", 1.0, (0.01, 0.01, 0.01)),
        sm.RigidBody("bob", 5.0, (0.01, 0.01, 0.01), position=(1.0, 0.25, 0.25)),
    )
    joints = [
        sm.Revolute("hinge", sm.GROUND, "hub", at=(0, 0, 0), axis=(0, 1, 0)),
        sm.Weld("clamp", "hub", "block", at=(0, 0, 0), second_at="left"),
        sm.Spherical("ball", "block", "bob", at="tip"),
    ]
    probes = [sm.Probe("v", "center", "velocity", 2, body="bob")]
    found = run(scene(supports=(), rigid_bodies=[hub, bob], joints=joints, probes=probes,
                      scheme=scheme))  # fmt: skip
    history = found.history
    assert found.summary["energy_balance_error"] < 1e-11
    assert found.summary["linear_momentum_drift"] < 1e-10
    assert found.warnings == ()
    # what the ball exerts on the bob is what this gains beside its weight
    gained = 5.0 * np.diff(history["v"]) / 5e-3 + 5.0 * 9.81
    assert history["ball.F3"].to_numpy()[1:] == pytest.approx(gained, rel=1e-6)
    # the hub takes from the solid what the solid has from its weight, bob and motion
    assert abs(history["clamp.F3"].iloc[-1]) > 100


def test_a_body_in_modes_hangs_on_a_named_point() -> None:
    """Kind: a name is as good as coordinates, whatever the other body is reduced to."""
    section = sm.CircularSection(E=2e9, nu=0.3, radius=0.02, density=1000.0)
    line = sm.Line((1.0, 0.25, 0.25), (1.5, 0.25, 0.25))
    rod = sm.Beam("rod", line, section, elements=2, model=sm.Modal(2))
    by_name, by_place = (
        run(scene(beams=rod, joints=sm.Spherical("ball", "block", "rod", at=at))).history["ball.F3"]
        for at in ("tip", (1.0, 0.25, 0.25))
    )
    assert by_name.to_numpy()[1:] == pytest.approx(by_place.to_numpy()[1:], rel=1e-9)
    # half a metre of rod of 1.3 kg/m
    assert np.abs(by_name.to_numpy()[1:]).max() > 0.1


@pytest.mark.parametrize("scheme", SCHEMES)
def test_free_ones_keep_their_momenta(scheme: str) -> None:
    initial = sm.InitialVelocity(linear=(0.0, 1.0, 0.0), spin=(0.0, 0.0, 3.0))
    found = run(scene(supports=(), loads=(), initial=initial, scheme=scheme))
    first = found.history.iloc[0]
    assert first["momentum_y"] == pytest.approx(MASS * (1 + 3 * 0.5), rel=1e-12)
    assert first["momentum_x"] == pytest.approx(-MASS * 3 * 0.125, rel=1e-12)
    assert found.summary["linear_momentum_drift"] < 1e-12
    # of the paper's schemes EP keeps the angular momentum exactly, others to their order
    assert found.summary["angular_momentum_drift"] < (1e-11 if scheme == "ep" else 1e-5)
    assert found.summary["energy_balance_error"] < 1e-11


def test_supports_loads_and_statics() -> None:
    """A cantilever by its weight, on a foundation of its own, and pulled at a corner."""
    static: Any = {"scheme": "static", "dt": None, "t_end": None}
    linear = run(scene(scheme="linear-statics", dt=None, t_end=None))
    assert run(scene(**static)).history["tip"].iloc[-1] == pytest.approx(
        linear.history["tip"].iloc[-1], rel=0.1
    )
    with pytest.raises(sm.SceneError, match="own body 'block' can translate along y"):
        free = sm.Fixed("left", body="block", displacement=(0, None, 0))
        run(scene(supports=free, **static))

    def bedded(u: Any) -> Any:
        return ufl.as_vector([*(green(u)[k] for k in range(6)), u[0], u[1], u[2]])

    stiff = np.zeros((9, 9))
    stiff[:6, :6], stiff[6:, 6:] = C, 1e5 * np.eye(3)
    on_bed = run(scene(block(strain=bedded, energy=stiff), supports=(), **static))
    assert on_bed.history["tip"].iloc[-1] == pytest.approx(-1e3 * 9.81 / 1e5, rel=1e-6)
    driven = sm.Driven("left", body="block", about=(0, 0, 0), axis=(0, 1, 0),
                       rotation=lambda t: 5 * t**2)  # fmt: skip
    moved = run(scene(supports=driven, loads=()))
    assert moved.summary["energy_balance_error"] < 1e-11
    assert moved.history["work_supports"].iloc[-1] > 0
    spring = sm.Spring("spring", "block", sm.GROUND, "tip", (1.0, 0.25, 1.0), stiffness=100.0)
    pulled = scene(loads=sm.PointForce("tip", (0, 0, -50.0), body="block"), force_elements=spring)
    assert run(pulled).summary["energy_balance_error"] < 1e-11


def test_small_displacements_see_the_stiffness_of_any_energy() -> None:
    stiffness = ufl.as_matrix(C.tolist())

    def stiffening(e: Any) -> Any:
        return ufl.dot(e, stiffness * e) / 2 + 1e9 * ufl.dot(e, e) ** 2

    runs = [run(scene(block(energy=law), scheme="linear-dynamics")) for law in (C, stiffening)]
    tips = [found.history["tip"].to_numpy() for found in runs]
    np.testing.assert_allclose(*tips, rtol=1e-9)
    assert max(found.summary["energy_balance_error"] for found in runs) < 1e-11


def test_probes_between_nodes_and_tetrahedra() -> None:
    """A free fall is the same everywhere, on cells of any kind."""
    at = (0.3, 0.1, 0.2)
    probes = [sm.Probe(f"{q}", at, q, body="block") for q in ("displacement", "velocity")]
    for cell in (mesh.CellType.hexahedron, mesh.CellType.tetrahedron):
        body = block(lambda comm, cell=cell: space(comm, cell=cell))
        end = run(scene(body, supports=(), probes=probes)).history.iloc[-1]
        assert end["displacement"] == pytest.approx(-9.81 * 0.02**2 / 2, rel=1e-9)
        assert end["velocity"] == pytest.approx(-9.81 * 0.02, rel=1e-9)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_fields_without_places_move_as_by_themselves(scheme: str) -> None:
    """Point masses as one vector: the motion of `Motion`, to round-off."""
    made = sm.Scene("chain", own_bodies=chain(), scheme=scheme, dt=0.01, t_end=0.1)
    found = run(made)
    alone = sm.Motion(chain(), scheme=scheme, dt=0.01)
    alone.step(10)
    for name in ("kinetic_energy", "strain_energy", "work_terms", "dissipation"):
        assert found.history[name].iloc[-1] == pytest.approx(alone.energies[name], abs=1e-10)
    assert found.summary["constraint_max"] < 1e-12


class Stop(BaseObserver):
    """Ends a run after two steps, as Ctrl-C does."""

    count = 0

    def accepted(self, simulation: Simulation) -> None:
        self.count += 1
        if self.count == 2:
            raise KeyboardInterrupt


def test_files_pictures_and_restart(tmp_path: Path) -> None:
    whole = sm.run(scene(), tmp_path / "whole")
    assert set(whole.fields) == {"block"}
    assert (tmp_path / "whole" / "shape.png").is_file()
    out = tmp_path / "part"
    with pytest.raises(KeyboardInterrupt):
        sm.run(scene(), out, observers=[Stop()], pictures=False)
    other = scene(block(density=2e3))
    with pytest.raises(sm.SceneError, match=r"own_bodies\['block'\].mass.density was"):
        sm.resume(out, other, observers=[BaseObserver()], pictures=False)
    again = sm.resume(out, scene(), observers=[BaseObserver()], pictures=False)
    assert again.history["tip"].to_numpy() == pytest.approx(
        whole.history["tip"].to_numpy(), rel=1e-9
    )


@pytest.mark.slow
def test_derivatives_are_those_of_runs_at_both_sides() -> None:
    """By the energy, the density and the shape, forwards and backwards."""

    def made(stiffness: float = 4e5, density: float = 1e3, width: float = 0.25) -> sm.Scene:
        body = block(lambda comm: space(comm, width), density, width, energy=C / 4e5 * stiffness)
        return scene(body, probes=sm.Probe("tip", "tip", component=2, body="block"))

    values, steps = {"stiffness": 4e5, "density": 1e3, "width": 0.25}, (100.0, 0.3, 1e-4)
    found = sm.sensitivities(made, tuple(values))
    back = sm.adjoint(made, lambda h: float(h["tip"][-1]), parameters=tuple(values)[:2])
    for (name, value), step in zip(values.items(), steps, strict=True):
        ends = [run(made(**{name: value + s * step})).history["tip"].iloc[-1] for s in (1, -1)]
        right = (ends[0] - ends[1]) / (2 * step)
        assert found.history[name]["tip"].iloc[-1] == pytest.approx(right, rel=1e-4)
        if name in back.parameters:
            assert back.parameters[name] == pytest.approx(right, rel=1e-4)


REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "region": ({"supports": sm.Clamped("lefty")}, "has no edge 'lefty'; its edges are 'left'"),
    "offset": ({"supports": sm.Hinged("left", offset=(0, 0, 0.1))}, "offset is .* it must be 0"),
    "director": (
        {"supports": sm.Fixed("left", director=(0, 0, 0))},
        "must be left out, because only a shell has one",
    ),
    "outside": ({"probes": sm.Probe("x", (0, 0, 5.0))}, "is not on own body 'block'; it is 4.75"),
    "rotation": ({"probes": sm.Probe("x", "tip", "rotation")}, "it must be a beam or a rigid"),
    "pressure": ({"loads": sm.Pressure(3.0)}, "it acts on a shell"),
    "moment": ({"loads": sm.PointMoment("tip", (1, 0, 0))}, "it acts on a shell or beam or rigid"),
    "hinge": (
        {"joints": sm.Revolute("r", sm.GROUND, "block", at=(1, 0.25, 0.25), axis=(0, 0, 1))},
        "second is own body 'block', whose nodes have no frame",
    ),
    "edges": (
        {
            "shells": sm.Shell("p", sm.Rectangle(1.0, 1.0), sm.Isotropic(1e9, 0.3, 0.01, 1e3)),
            "joints": sm.EdgeHinge("h", "p", "block", at="right"),
            "supports": sm.Clamped("left", body="block"),
        },
        "second is own body 'block'; it must be a shell, a rigid body or the ground",
    ),
    "weld": (
        {"joints": sm.Weld("w", sm.GROUND, "block", at=(1, 0.25, 0.25))},
        "second_at is None; it must be a region of own body 'block': 'left', 'right'",
    ),
    "node": (
        {"joints": sm.Spherical("s", "block", sm.GROUND, at=(1, 0.2, 0.25))},
        "own body 'block' has no node at",
    ),
    "massless": ({"own_bodies": block(mass=None)}, "its mass is 0; it must be greater than 0"),
    "places": (
        {"own_bodies": chain(), "supports": sm.Clamped("left", body="chain"), "probes": ()},
        "own body 'chain' has no places; its field must be a vector of three displacements",
    ),
    "empty": (
        {"own_bodies": block(regions={"left": lambda x: x[0] < -5})},
        "region 'left' of own body 'block' has no vertex in it",
    ),
    "point": (
        {"own_bodies": block(points={"tip": (0.7, 0, 0)}), "probes": sm.Probe("x", "tip")},
        "point 'tip' is at .* where its mesh has no vertex",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_it_cannot_have_is_refused(case: str) -> None:
    given, sentence = REFUSED[case]
    with pytest.raises(sm.SceneError, match=sentence):
        made: Any = {"own_bodies": block(), "probes": (), "supports": sm.Clamped("left")}
        base: Any = {"scheme": "ep4", "dt": 5e-3, "t_end": 0.01}
        run(sm.Scene("solid", **made | base | given))


ASKED: dict[str, tuple[dict[str, Any], str]] = {
    "name": ({"name": 3}, "name is 3"),
    "space": ({"on": lambda comm: space(comm).mesh}, "space is .* it must be a function space"),
    "no strain": ({"strain": None}, "it has energy and no strain"),
    "no energy": ({"energy": None}, "it has strain and no energy"),
    "matrix": ({"energy": np.eye(5)}, "symmetric matrix of 6 by 6 finite numbers"),
    "symmetry": ({"energy": C + np.triu(C, 1)}, "symmetric matrix"),
    "finite": ({"energy": np.nan * C}, "finite numbers"),
    "text": ({"energy": "stiff"}, "energy is 'stiff'; it must be a function, or"),
    "density": ({"mass": 1e3}, "mass is 1000.0; it must be a function"),
    "quadratic": ({"mass": lambda v, w: ufl.dot(v, w) ** 2}, "not linear in the variation"),
    "skew": ({"mass": lambda v, w: ufl.dot(v, w) + v[0] * w[1]}, "is not symmetric"),
    "negative": ({"mass": lambda v, w: -ufl.dot(v, w)}, "or negative"),
    "work": ({"force": lambda u, rate, du, t: u[0]}, "force .* not linear in the variation"),
    "square": ({"force": lambda u, rate, du, t: du[0] ** 2}, "not linear in the variation"),
    "size": ({"size": 0.0}, "size is 0.0; it must be greater than 0"),
    "constraints": ({"constraints": [1]}, r"constraints\[0\] is 1"),
    "measure": ({"dx": 3}, "dx is 3"),
    "plane": ({"points": {"tip": (1.0, 0.25)}}, "a vector of three numbers"),
    "nan": ({"points": {"tip": (1.0, 0.25, np.nan)}}, "every component must be finite"),
    "number": ({"regions": {"left": 3}}, "regions is 3; it must be a function"),
    "one mark": ({"regions": {"left": lambda x: True}}, r"an array of shape \(\) at 12 points"),
}


@pytest.mark.parametrize("case", ASKED)
def test_what_it_is_made_of_is_looked_at(case: str) -> None:
    """Kind: arguments that ended in bare errors, ran as something else, or did nothing."""
    given, sentence = ASKED[case]
    wrong = dict(given)
    with pytest.raises(sm.SceneError, match=sentence):
        if "name" in wrong:
            sm.OwnBody(wrong["name"], space)
        run(scene(block(**wrong)))


def test_a_stiffness_may_be_of_ufl() -> None:
    """Kind: the same matrix as numbers, as a matrix of UFL and as a constant of a mesh."""
    there = space(MPI.COMM_WORLD)
    bodies = (
        block(),
        block(energy=ufl.as_matrix(C.tolist())),
        block(on=there, energy=fem.Constant(there.mesh, C)),
    )
    tips = [run(scene(body)).history["tip"].to_numpy() for body in bodies]
    for tip in tips[1:]:
        np.testing.assert_allclose(tip, tips[0], rtol=1e-10, atol=1e-15)


def test_linear_buckling_is_refused() -> None:
    """Kind: what has no resultants of its own would buckle nowhere, without a word."""
    load = sm.PointForce("tip", (-1.0, 0, 0), body="block")
    made = sm.Scene("solid", own_bodies=block(), supports=sm.Clamped("left"), loads=load)
    with pytest.raises(sm.SceneError, match="own body 'block' has strains of its own, of whose"):
        sm.modes(made, buckling=True)
