"""Curved beams turned as a whole: nothing is strained, and solutions turn with the scene."""

import math

from mpi4py import MPI

import numpy as np
import pytest
import ufl
from dolfinx import fem
from dolfinx.fem.petsc import assemble_vector
from scipy.spatial.transform import Rotation

from shellmb.model.body import strain_energy
from shellmb.model.frames.beam import BeamModel, build_beam
from shellmb.native.kernels import compiled
from shellmb.scene import Beam, CircularArc, Clamped, GeneralSection, PointForce, PointMoment, Scene
from shellmb.schemes.base import at_state
from shellmb.schemes.residuals.residual import interval_forces
from shellmb.simulate.simulation import Simulation

TURN = Rotation.from_rotvec((0.4, -1.7, 0.9)).as_matrix()
RING = CircularArc((0, 0, 0), (1, 0, 0), (0, 0, 1), 2 * math.pi)
ARC = CircularArc((0, 0, 0), (1, 0, 0), (0.3, 0.2, 1), 1.9)


def turned(curve: CircularArc) -> CircularArc:
    center, start, axis = (
        tuple(TURN @ np.asarray(v)) for v in (curve.center, curve.start, curve.axis)
    )
    return CircularArc(center, start, axis, curve.angle_rad)


@pytest.mark.parametrize("degree", [2, 3])
@pytest.mark.parametrize("curve", [RING, ARC], ids=["ring", "arc"])
def test_no_strain_from_a_rigid_motion(curve, degree, coupled) -> None:
    """Energy and compatibility of a state that is a translation and a large rotation."""
    beam = Beam("b", curve, GeneralSection(coupled), elements=6, degree=degree)
    body = build_beam(beam, MPI.COMM_WORLD, [], dynamic=False)
    assert isinstance(body, BeamModel)
    q = fem.Function(body.mixed.space)
    D = body.node_directors()
    X = body.mixed.nodes("u")
    q.x.array[body.mixed.dofs["u"]] = (X @ TURN.T - X + (0.3, -2.0, 0.7)).ravel()
    q.x.array[body.mixed.dofs["w"]] = (D @ TURN.T - D).ravel()
    residual = compiled(interval_forces(body, at_state(q), ufl.TestFunction(body.mixed.space)))
    vector = assemble_vector(residual)
    scale = float(body.section.force.value)
    # positions of size 2 by the second derivative of shape functions, 1e3, times round-off
    assert vector.norm() < 1e-12 * scale
    strained = q.copy()
    strained.x.array[body.mixed.dofs["w"]] *= 0.9
    assert fem.assemble_scalar(compiled(strain_energy(body, strained))) > 1e-4
    vector.destroy()


def test_a_turned_scene_has_a_turned_solution(coupled) -> None:
    """Curve, up and loads of an arc with a coupled section in any direction."""
    force, moment, up = np.array([0.3, 0.4, 0.5]), np.array([0.1, -0.2, 0.2]), np.array([0, 0, 1.0])
    found = []
    for R, curve in ((np.eye(3), ARC), (TURN, turned(ARC))):
        beam = Beam("b", curve, GeneralSection(coupled), elements=4, up=tuple(R @ up))
        loads = (PointForce("end", tuple(R @ force)), PointMoment("end", tuple(R @ moment)))
        scene = Scene(
            "arc", beams=beam, supports=Clamped("start"), loads=loads, scheme="static", dt=1.0
        )
        simulation = Simulation(scene)
        simulation.run()
        body = simulation.model.beams["b"]
        u = simulation.problem.levels["b"].q.x.array[body.mixed.dofs["u"]].reshape(-1, 3)
        found.append(u @ R)
    assert np.abs(found[0]).max() > 0.2
    # Newton's tolerance of 1e-9, squared by its last iteration
    np.testing.assert_allclose(found[1], found[0], atol=1e-10)
