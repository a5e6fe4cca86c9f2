"""A shell or a beam as a participant of preCICE: forces at its nodes in, displacements out."""

import importlib
from dataclasses import replace
from typing import Any

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.errors import SceneError
from shellmb.exchange.motion import SceneMotion
from shellmb.scene import Scene
from shellmb.scene.control.signals import Input
from shellmb.scene.loads.loads import PointForce


def couple_precice(
    scene: Scene,
    configuration: str,
    body: str,
    *,
    participant: str = "Solid",
    mesh: str = "Solid-Mesh",
    reads: str = "Force",
    writes: str = "Displacement",
) -> SceneMotion:
    """Step a scene as preCICE says, in one process, until the coupling ends.

    Forces change linearly over a time window; windows longer than the scene's `dt` take several
    steps. Implicit coupling goes back to the start of a window bit for bit.

    Args:
        scene: The scene, to which forces at the nodes of the body are added.
        configuration: Path of the configuration of preCICE.
        body: Name of a shell or a beam.
        participant: Its name in the configuration.
        mesh: Name of its mesh.
        reads: Name of the forces there [N].
        writes: Name of the displacements there [m].

    Returns:
        The motion at its end.

    Raises:
        SceneError: If pyprecice is missing, or the scene cannot be stepped.
    """
    plain = SceneMotion(scene)
    try:
        precice: Any = importlib.import_module("precice")
    except ImportError as error:
        raise SceneError(
            f"couple_precice: pyprecice cannot be imported ({error}); install the library preCICE "
            "3 and `pip install pyprecice`"
        ) from None
    rows, points = _free_nodes(plain, body)
    forces = [
        PointForce(x, e, body=body, time=Input(f"{body}.{row}.{c}", linear=True))
        for row, x in zip(rows.tolist(), map(tuple, points.tolist()), strict=True)
        for c, e in enumerate(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))
    ]
    motion = SceneMotion(replace(scene, loads=(*scene.loads, *forces)))
    names = [force.time.name for force in forces]  # type: ignore[union-attr]
    solver = precice.Participant(participant, configuration, 0, 1)
    vertices = solver.set_mesh_vertices(mesh, points)

    def write() -> None:
        solver.write_data(mesh, writes, vertices, motion.nodes(body).displacement[rows])

    if solver.requires_initial_data():
        write()
    solver.initialize()
    while solver.is_coupling_ongoing():
        # a trial begins with one
        solver.requires_writing_checkpoint()
        dt = float(solver.get_max_time_step_size())
        found = np.asarray(solver.read_data(mesh, reads, vertices, dt)).ravel()
        motion.inputs.update(zip(names, found.tolist(), strict=True))
        motion.trial(dt)
        write()
        solver.advance(dt)
        if solver.requires_reading_checkpoint():
            motion.reject()
        else:
            motion.accept()
    solver.finalize()
    return motion


def _free_nodes(motion: SceneMotion, body: str) -> tuple[Ints, Floats]:
    """Numbers and positions of the nodes that supports do not hold."""
    nodes, model = motion.nodes(body), motion.simulation.model
    if model.comm.size > 1 or body not in model.meshed:
        raise SceneError(f"couple_precice: '{body}' must be a shell or a beam, in one process")
    owner = model.meshed[body]
    held = np.concatenate([np.zeros(0, int), *(fixed.dofs for fixed in owner.fixed)])
    free = ~np.isin(owner.mixed.dofs["u"].reshape(-1, 3), held).all(axis=1)
    return np.flatnonzero(free), nodes.reference[free]
