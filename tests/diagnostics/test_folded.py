"""Neighbouring directors of an element that are too far apart: said of beams and of shells."""

import math
import re
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest

from shellmb.diagnostics.elements.director_angles import BOUND, Folded, _Neighbours
from shellmb.running.execute import execute
from shellmb.scene import (
    Beam,
    CircularArc,
    Clamped,
    EdgeMoment,
    GeneralSection,
    InitialVelocity,
    Isotropic,
    Line,
    PointMoment,
    Rectangle,
    Scene,
    Shell,
    Solver,
    Table,
)
from shellmb.simulate.simulation import Simulation

SECTION = GeneralSection(
    (1e4, 1e4, 1e4, 1.0, 1.0, 1.0), mass_per_length=1.0, second_moments=(1e-3, 0.0, 1e-3)
)


def bent(angle: float, elements: int, degree: int = 2, about: int = 2) -> Scene:
    """A beam bent or twisted in statics; element by element by the same angle."""
    moment = [0.0, 0.0, 0.0]
    moment[about] = angle
    beam = Beam("strip", Line((0, 0, 0), (1, 0, 0)), SECTION, elements=elements, degree=degree)
    return Scene(
        "bent",
        beams=beam,
        supports=Clamped("start"),
        loads=PointMoment("end", tuple(moment)),
        scheme="static",
        # with steps of 0.25 round-off decides whether four elements stay at the equilibrium
        dt=0.125,
        solver=Solver(max_iterations=60),
    )


# 2 pi in three elements is beyond what they resist
@pytest.mark.parametrize(
    ("elements", "degree", "about", "warns"),
    [(4, 2, 2, True), (4, 2, 0, True), (8, 2, 2, False), (4, 3, 2, False), (8, 2, 0, False)],
)
def test_a_rolled_or_twisted_beam(elements: int, degree: int, about: int, warns: bool) -> None:
    """A full turn: 90 degrees an element are too many with degree 2, by 7 per cent of stiffness."""
    scene = bent(2 * math.pi, elements, degree, about)
    found = [caution.says for caution in execute(scene).warnings]
    assert bool(found) == warns, found
    if warns:
        (said,) = found
        assert re.match(r"beam 'strip' turns by (4[5-9]|5\d) degrees between", said), said


def test_a_fold_that_comes_and_goes() -> None:
    """Kind: what a run does in between, of which its end has nothing left."""
    scene = bent(math.pi, 2)
    # at the tenth of twenty steps the moment is largest, at the end there is none
    load = PointMoment("end", (0, 0, 1.05 * math.pi), time=Table((0, 0.5, 1), (0, 1, 0)))
    warned = execute(replace(scene, loads=load, dt=0.05)).warnings
    # under a dead moment equilibria are unstable, too, which is said beside
    (said,) = [w for w in warned if w.watch == "folded"]
    assert "at t = 0.5;" in said.says


def test_a_rolled_strip() -> None:
    """The same of a shell, by its directors alone."""
    section = Isotropic(E=12.0 * 1e9, nu=0.0, thickness=1e-3)

    def scene(elements: int) -> Scene:
        strip = Shell("strip", Rectangle(1.0, 0.25), section, mesh=(elements, 1))
        load = EdgeMoment("right", (0, -2 * math.pi * float(section.D[0, 0]), 0))
        return Scene(
            "rolled", strip, supports=Clamped("left"), loads=load, scheme="static", dt=0.25
        )

    # under a dead moment it is unstable, too, which is said beside
    coarse, fine = (execute(scene(n)).warnings for n in (3, 8))
    (said,) = [w for w in coarse if w.watch == "folded"]
    assert said.says.startswith("shell 'strip' turns by")
    assert [w.watch for w in fine] == ["stability"]


def test_rigid_motions_and_curves_at_rest_are_no_folds() -> None:
    """A ring of few elements that spins: what its nodes turn apart by is by its mesh."""
    ring = Beam("ring", CircularArc((0, 0, 0), (1, 0, 0), (0, 0, 1), 5.5), SECTION, elements=3)
    spin = InitialVelocity(spin=(0.3, 0.2, 0.5))
    scene = Scene("ring", beams=ring, initial=spin, scheme="ep", dt=0.1, t_end=0.5)
    assert execute(scene).warnings == ()


def test_opposite_directors() -> None:
    """Neighbours that point in opposite directions, in one node of a straight beam, are found."""
    simulation = Simulation(bent(1e-3, 4))
    simulation.run()
    watch = Folded(cast(Any, SimpleNamespace()))
    watch.start(simulation)
    assert list(watch.cautions(simulation)) == []
    body, q = simulation.model.beams["strip"], simulation.problem.state("strip").x.array
    node = int(abs(body.mixed.nodes("u")[:, 0] - 0.5).argmin())
    rows = body.mixed.dofs["w"].reshape(-1, 3, 3)[node]
    q[rows] = [(-2, 0, 0), (0, -2, 0), (0, 0, 0)]
    (caution,) = watch.cautions(simulation)
    assert caution.body == "strip"
    assert caution.value == pytest.approx(math.pi, abs=1e-2)
    assert caution.value > BOUND
    # what was found is kept, and taken up by a run that goes on
    other = Folded(cast(Any, SimpleNamespace()))
    other.restore(watch.state())
    assert other.state() == watch.state()


@pytest.mark.parametrize(("cell", "count"), [("quad", 12), ("tri", 16)])
def test_neighbours_of_shells(cell: Any, count: int) -> None:
    """Along the lines of nodes: of a square 3x3 points, of two triangles the diagonals of four."""
    plate = Shell(
        "plate", Rectangle(1.0, 1.0), Isotropic(1.0, 0.3, thickness=0.1), mesh=(1, 1), cell=cell
    )
    scene = Scene("plate", plate, supports=Clamped("left"), scheme="static", dt=1.0)
    body = Simulation(scene).model.shells["plate"]
    assert len(_Neighbours(body)._pairs) == count
