"""Static problems in shellmb."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from shellmb.demos.verification.measuring import Stopwatch
from shellmb.errors import ConvergenceError
from shellmb.model.locations.nodes import local_nodes
from shellmb.scene import Scene
from shellmb.simulate.simulation import Simulation
from tests.bench.peers.statics.problem import TOLERANCE, Answer, Static

DEGREES = {"degree 2": 2, "degree 3": 3}


def solve(scene: Scene, case: Static, points: Sequence[Sequence[float]]) -> Answer:
    """Solve a scene of one shell under its full load; set-up and compilation are not timed.

    Args:
        scene: The scene, for its mesh, degree, tolerance and load steps to be replaced.
        case: How.
        points: Points that are looked at, nodes of the mesh, m.
    """
    base, dt = scene.shells[0], 1 / case.load_steps
    shell = replace(base, mesh=case.mesh, degree=DEGREES[case.element])  # type: ignore[arg-type]
    scene = replace(
        scene,
        shells=(shell,),
        solver=replace(scene.solver, tolerance=TOLERANCE),
        dt=dt,
    )
    simulation = Simulation(scene)
    body = simulation.model.meshed[shell.name]
    q = simulation.problem.levels[shell.name].q.x.array
    watch, failed = Stopwatch(), ""
    try:
        # a load step that is too large is taken in parts
        simulation.run([])
    except ConvergenceError:
        failed = f"no convergence in step {simulation.step + 1}"
    cpu, dofs = watch.cpu, body.mixed.dofs["u"].reshape(-1, 3)
    nodes = [local_nodes(body, (x, y, z), "the points")[0] for x, y, z in points]
    return Answer(q[dofs[nodes]], simulation.iterations, cpu, failed)
