"""Forces along a body that its modes, or linear strains, know nothing of: said by their size."""

from typing import Any

from mpi4py import MPI

import numpy as np
import pytest
import ufl
from dolfinx import fem
from scipy.spatial.transform import Rotation

from shellmb.preprocessing.checked_model import checked_model
from shellmb.preprocessing.modal.isolated import lowest_frequency
from shellmb.preprocessing.modal.tangent import GeometricStiffness
from shellmb.running.execute import execute
from shellmb.scene import (
    Beam,
    Clamped,
    GeneralSection,
    Isotropic,
    Line,
    Modal,
    PointForce,
    Probe,
    Rectangle,
    RigidBody,
    Scene,
    Shell,
    Weld,
)

BENDING = 200.0
# hardly a shear or a stretch
SECTION = GeneralSection(
    (4e8, 1e8, 1e8, 100.0, BENDING, BENDING),
    mass_per_length=1.5,
    second_moments=(1e-4, 0.0, 1e-4),
)


def column(model: Any, share: float) -> Scene:
    """A column under a share of its buckling load, `pi^2 D/(4 L^2)`, and a small force across."""
    load = share * np.pi**2 * BENDING / 4
    return Scene(
        "column",
        beams=Beam("rod", Line((0, 0, 0), (1, 0, 0)), SECTION, elements=4, model=model),
        supports=Clamped("start"),
        loads=PointForce("end", (-load, 0.0, 1e-2 * load)),
        probes=Probe("tip", "end", component=2),
        scheme="static",
    )


@pytest.mark.parametrize(
    "model",
    [
        pytest.param(Modal(modes=4), id="modal"),
        pytest.param("floating-frame", marks=pytest.mark.slow),
    ],
)
def test_the_share_is_what_deflections_are_off_by(model: Any) -> None:
    """Most of the softening is known: the frame turns, and so the load acts across it."""
    off, said = [], []
    for share in (0.02, 0.08, 0.4):
        exact, found = (execute(column(m, share)) for m in ("exact", model))
        tips = [run.history["tip"].iloc[-1] for run in (exact, found)]
        off.append(abs(tips[1] / tips[0] - 1))
        said.append([c["value"] for c in found.summary["warnings"] if "along it" in c["says"]])
    assert said[0] == []
    for error, values in zip(off[1:], said[1:], strict=True):
        assert len(values) == 1
        assert error / 3 < values[0] < 3 * error
    assert off[0] < 0.01


def unknowns_of(body: Any, forces: Any) -> np.ndarray:
    """Unknowns of membrane forces that are the same everywhere."""
    q = fem.Function(body.mixed.space)
    points = np.array([(x, y) for x in (0.1, 0.5, 0.8) for y in (0.2, 0.5, 0.9)])
    read = fem.Expression(ufl.as_vector([body.forces(q)[k] for k in range(3)]), points)
    domain, columns = q.function_space.mesh, []
    cells = np.arange(domain.topology.index_map(2).size_local, dtype=np.int32)
    for unknown in body.mixed.dofs["N"]:
        q.x.array[:] = 0.0
        q.x.array[unknown] = 1.0
        columns.append(read.eval(domain, cells).ravel())
    given = np.tile(forces, len(cells) * len(points))
    found, *_ = np.linalg.lstsq(np.transpose(columns), given)
    return found


@pytest.mark.parametrize("R", [np.eye(3), Rotation.from_rotvec((0.3, -1.0, 2.0)).as_matrix()])
@pytest.mark.parametrize("forces", [(3.0, 0.5, 0.7), (-2.0, 4.0, -1.0), (0.0, 0.0, 1.0)])
@pytest.mark.parametrize("omega", [(0.01, 0.02, -0.03), (0.0, 0.02, 0.01), (0.02, 0.02, 0.0)])
def test_forces_work_on_rotations(forces: Any, omega: Any, R: np.ndarray) -> None:
    """`|N_ab (w x e_a) . (w x e_b)|/2` of a plate, by vectors, and `N_ab S_ab/2` of its strain."""
    plate = Shell("plate", Rectangle(2.0, 0.5), Isotropic(1e6, 0.3, 0.01, 1.0), mesh=(2, 1))
    model, _ = checked_model(Scene("plate", plate, scheme="ep", dt=1, t_end=1), MPI.COMM_WORLD)
    body, strain = model.shells["plate"], np.array([[1e-3, 4e-4, 0], [4e-4, -2e-3, 0], [0, 0, 0]])
    state = np.zeros(len(fem.Function(body.mixed.space).x.array))
    X = body.mixed.nodes("u")
    seen = X @ (np.eye(3) + np.cross(omega, np.eye(3)).T + strain).T
    state[body.mixed.dofs["u"].reshape(-1, 3)] = seen @ R.T - X
    state[body.mixed.dofs["N"]] = unknowns_of(body, forces)
    squares, stretching, _ = GeometricStiffness(body).of(state, R.T)
    matrix = np.array([[forces[0], forces[2]], [forces[2], forces[1]]])
    moved = np.cross(omega, np.eye(3)[:2])
    area = 2.0 * 0.5
    assert squares == pytest.approx(area / 2 * abs(np.sum(matrix * (moved @ moved.T))), rel=1e-9)
    assert stretching == pytest.approx(area / 2 * np.sum(matrix * strain[:2, :2]), rel=1e-9)


@pytest.mark.parametrize(("held", "root"), [(False, 22.37), (True, 3.516)])
def test_a_beam_at_a_joint_is_as_soft_as_a_cantilever(held: bool, root: float) -> None:
    """`root sqrt(D/(m L^4))`: what a joint may hold as a clamp does, and what nothing holds."""
    rod = Beam("rod", Line((0, 0, 0), (1, 0, 0)), SECTION, elements=6)
    hub = RigidBody("hub", 1.0, (1.0, 1.0, 1.0))
    weld = Weld("root", "hub", "rod", at=(0, 0, 0))
    scene = Scene(
        "rod",
        beams=rod,
        rigid_bodies=hub if held else (),
        joints=weld if held else (),
        scheme="ep",
        dt=1,
        t_end=1,
    )
    model, _ = checked_model(scene, MPI.COMM_WORLD)
    exact = root * np.sqrt(BENDING / 1.5)
    # shear and rotary inertia
    assert lowest_frequency(model, "rod") == pytest.approx(exact, rel=4e-3)
