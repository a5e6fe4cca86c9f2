"""Runs tell of motions along thin quadrilaterals that their elements hardly resist.

The kind: displacements whose mean is right and which are false from node to node, where a thin
sheet of few elements is pulled along its surface. What is false of them is their distance from a
sheet of more elements; the bound separates it from true motions of thin curved bodies, however
little these stretch.
"""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from shellmb.arrays import Floats
from shellmb.diagnostics.elements.hourglass import Unresisted
from shellmb.diagnostics.elements.unresisted import UnresistedMotions
from shellmb.running.execute import RunResult, execute
from shellmb.scene import (
    Clamped,
    Cylinder,
    EdgeForce,
    EdgeMoment,
    Isotropic,
    Parametric,
    Rectangle,
    Scene,
    Shell,
)
from shellmb.simulate.simulation import Simulation

E, DENSITY, LENGTH, WIDTH = 70e9, 2700.0, 0.5, 0.1


def ring(xi: Floats, eta: Floats) -> Floats:
    """A quarter of a ring with radii of 0.1 and 0.5 m."""
    r, angle = 0.1 + 0.4 * eta, np.pi / 2 * xi
    return np.stack([r * np.sin(angle), r * np.cos(angle), 0 * r])


QUARTER = Parametric(ring)


def sheet(thickness: float, mesh: tuple[int, int] = (4, 1), nu: float = 0.3, **own: Any) -> Scene:
    """A sheet that is clamped at its left and pulled to the right by a strain of 1e-6."""
    metre, pascal = own.pop("metre", 1.0), own.pop("pascal", 1.0)
    axes = own.pop("axes", np.eye(3))
    section = Isotropic(
        E * pascal, nu, thickness=thickness * metre, density=DENSITY * pascal / metre**2
    )
    flat = Rectangle(LENGTH * metre, WIDTH * metre, axis1=tuple(axes[0]), axis2=tuple(axes[1]))
    surface = own.pop("surface", flat)
    force = 1e-6 * E * pascal * thickness * metre * axes[0]
    given = {"scheme": "static", "dt": 1.0, "t_end": 1.0} | own
    return Scene(
        "sheet",
        Shell("foil", surface, section, mesh=mesh, cell=given.pop("cell", "quad")),
        supports=Clamped("left"),
        loads=EdgeForce("right", tuple(force)),
        **given,
    )


def told(result: RunResult) -> list[float]:
    """Parts of displacements that the run says are false."""
    return [c.value for c in result.warnings if c.watch == "hourglass" and c.value is not None]


def displacement(result: RunResult) -> dict[tuple[int, int], float]:
    """Displacements along the sheet by places of nodes, in parts of its size."""
    body = result.simulation.model.shells["foil"]
    u = result.simulation.problem.state("foil").x.array[body.mixed.dofs["u"]].reshape(-1, 3)
    keys = np.rint(body.mixed.nodes("u")[:, :2] * 1e4).astype(int)
    return {(int(x), int(y)): float(v) for (x, y), v in zip(keys, u[:, 0], strict=True)}


@cache
def resisting(mesh: tuple[int, int], **own: Any) -> dict[tuple[int, int], float]:
    """Displacements of a thicker sheet of many elements, which has the same strains."""
    return displacement(execute(sheet(1e-2, mesh, **own)))


def distance(found: dict[tuple[int, int], float], true: dict[tuple[int, int], float]) -> float:
    """Root mean square over the nodes, relative to what is true there."""
    every = np.array([[found[k], true[k]] for k in found])
    return float(np.linalg.norm(every[:, 0] - every[:, 1]) / np.linalg.norm(every[:, 1]))


@pytest.mark.parametrize(
    ("thickness", "mesh"), [(1e-4, (4, 1)), (1e-3, (4, 1)), (1e-4, (2, 1)), (1e-2, (2, 1))]
)
def test_what_is_said_is_what_is_false(thickness: float, mesh: tuple[int, int]) -> None:
    """Root mean squares over the nodes; thickness is nothing to the strains of a pulled sheet."""
    result = execute(sheet(thickness, mesh))
    (said,) = told(result)
    assert "shell 'foil' move against one another" in result.warnings[0].says
    false = distance(displacement(result), resisting((20, 4)))
    assert false / 2 < said < 2 * false


@pytest.mark.parametrize(
    ("thickness", "mesh", "off"),
    [(1e-3, (2, 2), 0.019), (1e-3, (4, 1), 0.29), (1e-4, (4, 1), 0.83)],
)
def test_what_bends_along_its_surface_is_told_as_well(
    thickness: float, mesh: tuple[int, int], off: float
) -> None:
    """A quarter of a ring, one end of which is pulled away from its centre.

    Where elements are large, what is true of such a motion has a part that counts for false.
    """
    result = execute(sheet(thickness, mesh, surface=QUARTER))
    (said,) = told(result)
    false = distance(displacement(result), resisting((16, 16), surface=QUARTER))
    # two digits, as the documentation has them
    assert false == pytest.approx(off, rel=0.05)
    assert false / 2 < said < 4 * false


@pytest.mark.parametrize(
    "own",
    [
        {"mesh": (20, 4)},
        {"mesh": (8, 2)},
        # nothing that the clamp could hold back
        {"nu": 0.0},
        {"cell": "tri"},
    ],
    ids=["twenty by four", "eight by two", "no contraction", "triangles"],
)
def test_what_is_true_is_not_told(own: dict[str, Any]) -> None:
    assert told(execute(sheet(1e-4, **own))) == []


@pytest.mark.parametrize(
    "own",
    [
        # millimetres, and MPa
        {"metre": 1e3, "pascal": 1e-6},
        {"axes": np.array([[0.0, 0.6, 0.8], [0.6, -0.64, 0.48]])},
        {"scheme": "linear-statics"},
    ],
    ids=["units", "axes", "linear"],
)
def test_twins_are_told_alike(own: dict[str, Any]) -> None:
    (one,), (other,) = told(execute(sheet(1e-3))), told(execute(sheet(1e-3, **own)))
    # strains are 1e-6
    assert other == pytest.approx(one, rel=1e-4)


@pytest.mark.parametrize("scheme", ["ep", "linear-dynamics"])
def test_motions_are_told_of_as_well(scheme: str) -> None:
    """The first wave along the sheet, which takes 0.1 ms for its length, to and fro."""
    scene = sheet(1e-4, scheme=scheme, dt=5e-6, t_end=2e-4)
    (said,) = told(execute(scene))
    assert said > 0.04


def test_rigid_motions_and_uniform_strains_count_for_nothing() -> None:
    """Of a sheet that turns far, moves far and is pulled, what is false stays what it is."""
    simulation = Simulation(sheet(1e-3))
    simulation.run(())
    body = simulation.model.shells["foil"]
    look, q = Unresisted(body), simulation.problem.state("foil").x.array.copy()
    places = body.mixed.dofs["u"].reshape(-1, 3)
    X, u = body.mixed.nodes("u"), q[places]
    R = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
    false, every = look.shares(q, small=False)
    assert false > 1e-3 * every > 0
    q[places] = (X + u) @ R.T + (3.0, -2.0, 1.0) - X
    # round-off of 1e-16 of metres beside displacements of 1e-7
    np.testing.assert_allclose(look.shares(q, small=False), (false, every), rtol=1e-5)
    q[places] = X @ np.diag([1.5, 0.8, 1.0]) @ R.T - X
    none, stretched = look.shares(q, small=False)
    assert none < 1e-20 * stretched
    q[places] = 0.0
    assert not look.shares(q, small=False).any()


@pytest.mark.parametrize("mesh", [(8, 2), pytest.param((16, 4), marks=pytest.mark.slow)])
def test_thin_curved_bodies_that_bend_without_stretching_are_no_such(mesh: tuple[int, int]) -> None:
    """Half a tube that its edge's moment opens by a quarter, and a strip rolled up as far."""
    section = Isotropic(E, 0.3, thickness=1e-3, density=DENSITY)
    stiffness = E * 1e-9 / 12 / (1 - 0.3**2)
    tube = Shell("foil", Cylinder(1.0, 0.5, angles=(0, 180)), section, mesh=mesh)
    strip = replace(tube, surface=Rectangle(3.0, 0.5))
    for shell in (tube, strip):
        scene = Scene(
            "bent",
            shell,
            supports=Clamped("left"),
            loads=EdgeMoment("right", (0.0, 0.0, 0.25 * stiffness)),
            scheme="static",
            dt=0.25,
            t_end=1.0,
        )
        if shell is strip:
            scene = replace(scene, loads=EdgeMoment("right", (0.0, -0.25 * stiffness, 0.0)))
        assert told(execute(scene)) == []


def test_who_asks_twice_is_told_alike() -> None:
    """The last step is none of each tenth: it is looked at whenever somebody asks."""
    simulation = Simulation(sheet(1e-3))
    watch = UnresistedMotions(cast(Any, None))
    simulation.run([watch])
    before = watch.state()
    first, second = (list(watch.cautions(simulation)) for _ in range(2))
    assert first == second and first
    assert watch.state() == before


def test_sums_go_on_after_a_restart() -> None:
    simulation: Any = SimpleNamespace()
    first, second = UnresistedMotions(simulation), UnresistedMotions(simulation)
    first.restore({"steps": 10, "sums": {"foil": [1.0, 4.0]}})
    second.restore(first.state())
    simulation.scene = sheet(1e-3)
    (said,) = second.cautions(simulation)
    assert said.value == 0.5 and "by 50 % of its displacement" in said.says
