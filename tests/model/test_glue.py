"""Beams along shells: lines of the mesh, and that both kinds of glue are one and the same beam."""

import json
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from mpi4py import MPI

import numpy as np
import pytest

from shellmb.errors import SceneError
from shellmb.model.body import constraint_error
from shellmb.model.model import Model
from shellmb.model.shells.joins import line_along
from shellmb.observers.account.energy import EnergyAccount
from shellmb.scene import (
    AlongEdge,
    AlongLine,
    Beam,
    Clamped,
    Cylinder,
    Driven,
    Fixed,
    Glue,
    Gravity,
    Isotropic,
    PointForce,
    Rectangle,
    RectangularSection,
    Scene,
    Shell,
)
from shellmb.simulate.simulation import Simulation
from tests import scenes

E, NU, RHO = 2e11, 0.3, 7800.0
PLATE = Isotropic(E=E, nu=NU, thickness=2e-3, density=RHO)
BAR = RectangularSection(E=E, nu=NU, width=4e-3, height=8e-3, density=RHO)
MIDDLE = AlongLine("plate", (0, 0.2, 0), (1, 0.2, 0))
MOTION = {"dt": 1e-3, "t_end": 0.02}


plate = partial(scenes.plate, PLATE, (1.0, 0.4), mesh=(4, 2))


def glued(
    curve: Any = MIDDLE, kind: Any = "revolute", shell: Shell | None = None, **more: Any
) -> Scene:
    """A plate clamped at its left with a beam along a line, loaded at a corner, with weight."""
    shell = shell or plate()
    beam = Beam("beam", curve, more.pop("section", BAR), degree=shell.degree)
    given = {
        "supports": Clamped("left", body="plate"),
        "loads": (PointForce("right-bottom", (3.0, 2.0, 10.0), body="plate"), Gravity()),
    }
    return Scene("s", shell, beams=beam, glues=Glue("beam", "plate", kind), **{**given, **more})


def along(shell: Shell, curve: Any) -> tuple[np.ndarray, Model]:
    """Nodes of a line, checked against the shell's nodes with the same dofs."""
    free = {"supports": (), "scheme": "ep", **MOTION}
    model = Model(glued(curve, shell=shell, loads=(), **free), MPI.COMM_WORLD)
    body, beam = model.shells["plate"], model.beams["beam"]
    line = line_along(beam.beam, body)
    X, D = body.mixed.nodes("u"), body.node_directors()[:, 0]
    u = body.mixed.dofs["u"].reshape(-1, 3)
    nodes = [int(np.flatnonzero(u[:, 0] == dof)[0]) for dof in line.dofs["u"][:, 0]]
    np.testing.assert_array_equal(line.x, X[nodes])
    np.testing.assert_array_equal(line.dofs["w"], body.mixed.dofs["w"].reshape(-1, 3)[nodes])
    np.testing.assert_array_equal(line.dofs["lam"][:, 0], body.mixed.dofs["lam"][nodes])
    # the beam's own nodes are there, and its third director is the shell's
    numbers = beam.domain.numbers(beam.mixed.subspaces["u"])
    np.testing.assert_allclose(beam.mixed.nodes("u"), line.x[numbers], atol=1e-12)
    triads = beam.node_directors()
    np.testing.assert_array_equal(triads[:, 2], D[nodes][numbers])
    np.testing.assert_allclose(triads @ triads.transpose(0, 2, 1) - np.eye(3), 0, atol=1e-14)
    return line.x, model


@pytest.mark.parametrize("cell_degree", [("quad", 2), ("quad", 3), ("tri", 2)])
@pytest.mark.parametrize(
    ("curve", "ends"),
    [
        (AlongEdge("plate", "left"), ((0, 0, 0), (0, 0.4, 0))),
        (AlongEdge("plate", "right"), ((1, 0, 0), (1, 0.4, 0))),
        (AlongEdge("plate", "bottom"), ((0, 0, 0), (1, 0, 0))),
        (AlongEdge("plate", "top"), ((0, 0.4, 0), (1, 0.4, 0))),
        (MIDDLE, ((0, 0.2, 0), (1, 0.2, 0))),
        (AlongLine("plate", "right-top", "right-bottom"), ((1, 0.4, 0), (1, 0, 0))),
        (AlongLine("plate", (0.75, 0.2, 0), (0.25, 0.2, 0)), ((0.75, 0.2, 0), (0.25, 0.2, 0))),
    ],
)
def test_a_line_runs_from_its_start_to_its_end(
    curve: Any, ends: Any, cell_degree: tuple[Any, Any]
) -> None:
    cell, degree = cell_degree
    x, model = along(plate(cell=cell, degree=degree), curve)
    np.testing.assert_allclose(x[[0, -1]], ends, atol=1e-12)
    length = np.linalg.norm(np.subtract(*ends))
    steps = np.linalg.norm(np.diff(x, axis=0), axis=1)
    # as long as its pieces together: no step goes back
    assert steps.sum() == pytest.approx(length, rel=1e-12)
    assert len(x) == degree * model.beams["beam"].domain.mesh.topology.index_map(1).size_global + 1


def test_lines_of_a_curved_shell() -> None:
    """A generator is straight; a closed edge goes once around, as xi grows."""
    tube = Shell("plate", Cylinder(0.5, 2.0, angles=(0, 360)), PLATE, mesh=(6, 2))
    x, model = along(tube, AlongEdge("plate", "bottom"))
    assert len(x) == 12
    surface = tube.surface
    expected = surface.position(np.arange(12) / 12, np.zeros(12)).T
    np.testing.assert_allclose(x, expected, atol=1e-12)
    # the mesh is a polygon of parabolas: shorter than the circle by a little
    assert model.beams["beam"].domain.length == pytest.approx(2 * np.pi * 0.5, rel=2e-3)
    ends = surface.position(np.array([0.5, 0.5]), np.array([0.0, 1.0])).T
    x, _ = along(tube, AlongLine("plate", *(tuple(map(float, p)) for p in ends)))
    np.testing.assert_allclose(x, np.linspace(*ends, 5), atol=1e-12)


@pytest.mark.parametrize(
    ("curve", "sentence"),
    [
        (
            AlongLine("plate", (0, 0.2, 0), (0.9, 0.2, 0)),
            r"beam 'beam': the straight line from \(0, 0.2, 0\) to \(0.9, 0.2, 0\) in shell "
            r"'plate' has no element edge at \(0.9, 0.2, 0\)",
        ),
        (AlongLine("plate", (0, 0, 0), (1, 0.4, 0)), r"has no element edge at \(0, 0, 0\)"),
        (AlongLine("plate", (0, 0.1, 0), (1, 0.1, 0)), r"has no element edge at \(0, 0.1, 0\)"),
    ],
)
def test_a_line_off_the_element_edges_is_refused(curve: Any, sentence: str) -> None:
    with pytest.raises(SceneError, match=sentence):
        Model(glued(curve), MPI.COMM_WORLD)


@pytest.mark.parametrize("kind", ["revolute", "director"])
def test_supports_of_beam_and_shell_that_contradict_one_another_are_refused(kind: Any) -> None:
    moved = Fixed("start", displacement=(None, None, 1e-3), body="beam")
    scene = glued(kind=kind, supports=(Clamped("left", body="plate"), moved))
    sentence = (
        r"clamped edge 'left' and fixed components at 'start' contradict one another on beam "
        r"'beam': at \(0, 0.2, 0\) the displacement along z is 0 by the former and 0.001 by the "
    )
    with pytest.raises(SceneError, match=sentence):
        Model(scene, MPI.COMM_WORLD)


TURNED = Driven("left", about=(0, 0.2, 0), axis=(0, 1, 0), rotation=lambda t: 0.1 * t, body="plate")
DRILLED = Driven("left", about=(0, 0.2, 0), rotation=lambda t: 0.1 * t, body="plate")
LEANING = Fixed("left-bottom", director=(0.6, None, -0.2), body="plate")


@pytest.mark.parametrize(
    ("kind", "curve", "support", "sentence"),
    [
        ("revolute", MIDDLE, TURNED, "the latter turns the beam with shell 'plate'"),
        ("revolute", MIDDLE, DRILLED, "the latter turns the beam with shell 'plate'"),
        ("director", MIDDLE, DRILLED, "the latter turns the beam with shell 'plate'"),
        (
            "director",
            MIDDLE,
            TURNED,
            "director along x is 0.0998334 by the former",
        ),
        (
            "director",
            AlongEdge("plate", "bottom"),
            LEANING,
            "director along x is 0.6 by the former",
        ),
    ],
)
def test_a_clamped_beam_is_not_turned_by_its_shell(
    kind: Any, curve: Any, support: Any, sentence: str
) -> None:
    scene = glued(curve, kind, supports=(support, Clamped("start", body="beam")))
    with pytest.raises(SceneError, match=f"contradict one another .*{sentence}"):
        Model(scene, MPI.COMM_WORLD)


def end_state(simulation: Simulation) -> dict[str, np.ndarray]:
    """Nodal unknowns of plate and beam."""
    found = {}
    for name, body in simulation.model.meshed.items():
        q = simulation.problem.levels[name].unknown["f"].x.array
        found |= {f"{name}/{part}": q[body.mixed.dofs[part]] for part in ("u", "w")}
    return found


@pytest.mark.parametrize(
    "scheme", [{"scheme": "static"}, {"scheme": "ep", **MOTION}, {"scheme": "ed", **MOTION}]
)
def test_both_kinds_of_glue_are_equal(scheme: dict[str, Any]) -> None:
    """Eq. (35) and the identified director: the same states, the second with fewer unknowns."""
    found, sizes = [], []
    for kind in ("revolute", "director"):
        account = EnergyAccount()
        simulation = Simulation(glued(kind=kind, **scheme))
        simulation.run([account])
        found.append(end_state(simulation))
        sizes.append(simulation.problem.system.size)
        if scheme["scheme"] != "static":
            # a few tens of steps of round-off
            assert account.relative_error is not None
            assert account.relative_error < 1e-11
        for body in simulation.model.bodies:
            unknown = simulation.problem.levels[body.name].unknown["f"]
            assert constraint_error(body, unknown) < 1e-14
    size = np.max(np.abs(found[0]["beam/w"]))
    assert size > 1e-3
    for name, values in found[0].items():
        # Newton stops at 1e-8 of the scales and converges quadratically
        np.testing.assert_allclose(values, found[1][name], atol=1e-10 * max(1.0, size))
    # a director and its multiplier at nine nodes, two more multipliers at the eight free ones; in
    # ED for the states j and f and for the jump
    states = {"static": 1, "ep": 1, "ed": 3}[scheme["scheme"]]
    assert sizes[0] - sizes[1] == (9 * 4 + 8 * 2) * states


def test_a_director_without_inertia_is_not_shared() -> None:
    """Its velocity may jump where the other's may not: eq. (35) in place of the identification."""
    scene = glued(kind="director", scheme="ed", **MOTION)
    (beam,) = scene.beams
    scene = replace(scene, beams=replace(beam, rotary_inertia=False))
    account = EnergyAccount()
    simulation = Simulation(scene)
    simulation.run([account])
    (joints,) = (b for b in simulation.model.bodies if b.name.startswith("shell revolute"))
    assert joints.jump_parts == frozenset()
    assert account.relative_error is not None
    assert account.relative_error < 1e-11


def test_a_clamped_shell_takes_the_end_of_the_beam_with_it() -> None:
    """Also its drilling, which the director knows nothing of."""
    model = Model(glued(), MPI.COMM_WORLD)
    beam = model.beams["beam"]
    start = np.flatnonzero(beam.domain.numbers(beam.mixed.subspaces["u"]) == 0)
    held = np.concatenate([f.dofs for f in beam.fixed])
    for part, size in (("w", 9), ("lam", 6)):
        assert np.isin(beam.mixed.dofs[part].reshape(-1, size)[start], held).all()
    (joints,) = (b for b in model.bodies if b.name.startswith("shell revolute"))
    # of nine nodes eight are left
    assert len(joints.mixed.dofs["mu"]) == 16


@pytest.mark.parametrize("kind", ["revolute", "director"])
def test_a_driven_edge_turns_plate_and_beam_as_one(kind: Any) -> None:
    """Without loads they turn rigidly about the vertical: no strain, in statics."""
    driven = Driven("left", axis=(0, 0, 1), rotation=lambda t: 0.6 * t, body="plate")
    account = EnergyAccount()
    simulation = Simulation(glued(kind=kind, supports=driven, loads=()))
    simulation.run([account])
    c, s = np.cos(0.6), np.sin(0.6)
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    beam = simulation.model.beams["beam"]
    q = end_state(simulation)
    X = beam.mixed.nodes("u")
    np.testing.assert_allclose(q["beam/u"].reshape(-1, 3), X @ (R - np.eye(3)).T, atol=1e-9)
    expected = beam.node_directors() @ (R - np.eye(3)).T
    np.testing.assert_allclose(q["beam/w"].reshape(-1, 3, 3), expected, atol=1e-9)


def test_an_eccentric_stiffener_bends_as_a_composite_beam() -> None:
    """A narrow strip with a bar below it, nu = 0: beam theory about the common centroid."""
    width, t, b, h, length, force = 0.02, 4e-3, 4e-3, 12e-3, 1.0, 1e-3
    strip = Isotropic(E=E, nu=0.0, thickness=t)
    e = -(t + h) / 2
    bar = RectangularSection(E=E, nu=0.0, width=b, height=h, offset=(0.0, e))
    shell = Shell("plate", Rectangle(length, width), strip, mesh=(8, 2))
    scene = glued(
        AlongLine("plate", (0, width / 2, 0), (length, width / 2, 0)),
        shell=shell,
        section=bar,
        loads=PointForce((length, width / 2, 0), (0, 0, force), body="plate"),
        dt=1.0,
    )
    simulation = Simulation(scene)
    simulation.run()
    beam = simulation.model.beams["beam"]
    tip = int(np.argmax(beam.mixed.nodes("u")[:, 0]))
    u = end_state(simulation)["beam/u"].reshape(-1, 3)[tip]
    A1, A2 = width * t, b * h
    bending = E * (width * t**3 + b * h**3) / 12 + E * A1 * A2 / (A1 + A2) * e**2
    # shear adds 3 (h/L)^2 or so, shear lag of the strip (b/L)^2
    assert u[2] == pytest.approx(force * length**3 / 3 / bending, rel=2e-3)


PROGRAM = """
import json, sys
from mpi4py import MPI
import numpy as np
from shellmb.observers.account.energy import EnergyAccount
from shellmb.scene import *
from shellmb.simulate.simulation import Simulation

section = Isotropic(E=2e11, nu=0.3, thickness=2e-3, density=7800.0)
bar = RectangularSection(E=2e11, nu=0.3, width=4e-3, height=8e-3, density=7800.0)
motion = dict(dt=1e-3, t_end=5e-3)
flat = Shell("plate", Rectangle(1.0, 0.4), section, mesh=(4, 2))
vault = Shell("plate", Cylinder(0.5, 1.0, angles=(0, 360)), section, mesh=(6, 2), degree=3)
middle, rim = AlongLine("plate", (0, 0.2, 0), (1, 0.2, 0)), AlongEdge("plate", "top")
found = {}
for name, shell, curve, kind, scheme, alpha in (
    ("revolute", flat, middle, "revolute", "ep", 1),
    ("director", flat, middle, "director", "ed", 0.5),
    ("rim", vault, rim, "revolute", "ep", 1),
):
    scene = Scene(
        "s", shell, beams=Beam("beam", curve, bar, degree=shell.degree),
        glues=Glue("beam", "plate", kind), loads=Gravity((0.1, 3.0, -9.81)), scheme=scheme,
        alpha=alpha, supports=Clamped("left" if shell is flat else "bottom", body="plate"),
        **motion,
    )
    simulation, account = Simulation(scene), EnergyAccount()
    simulation.run([account])
    values = dict(account.values)
    for body, model in simulation.model.meshed.items():
        state = simulation.problem.levels[body].unknown["f"].x.array
        for part in ("u", "w"):
            here = float(np.sum(state[model.mixed.owned(part)] ** 2))
            values[body + "/" + part] = MPI.COMM_WORLD.allreduce(here) ** 0.5
    values["unknowns"] = simulation.problem.system.size
    found[name] = values
if MPI.COMM_WORLD.rank == 0:
    with open(sys.argv[1], "w") as file:
        json.dump(found, file)
"""


def test_the_same_on_two_ranks(mpirun: Any, tmp_path: Path) -> None:
    found = []
    for ranks in (1, 2):
        mpirun(ranks, "-c", PROGRAM, str(tmp_path / f"{ranks}.json"))
        found.append(json.loads((tmp_path / f"{ranks}.json").read_text()))
    for name, one in found[0].items():
        for key, value in one.items():
            # sums in another order; the balance is round-off itself
            close = pytest.approx(value, rel=1e-8, abs=1e-10)
            assert found[1][name][key] == close, f"{name}: {key}"
