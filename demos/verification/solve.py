"""Solve a scene and read numbers off it."""

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem, geometry

from shellmb.arrays import Floats
from shellmb.model.locations.nodes import Place, local_nodes
from shellmb.native.kernels import compiled
from shellmb.scene import Scene
from shellmb.simulate.simulation import BaseObserver, Simulation

# points per direction and element for norms of errors: exact for the square of a quartic
NORM_DEGREE = 8


def solved(scene: Scene) -> Simulation:
    """Run a scene to its end."""
    simulation = Simulation(scene)
    simulation.run()
    return simulation


def displacement(simulation: Simulation, point: Place, body: str | None = None) -> Floats:
    """Displacement of a node after the last step, shape (3,), m; the same on all ranks.

    Args:
        simulation: The simulation, with a step solved.
        point: Name or coordinates.
        body: Name of the shell; None where there is one only.
    """
    shell = simulation.model.shells[simulation.scene.shell(body).name]
    u = simulation.problem.levels[shell.name].unknown[simulation.problem.last]
    values = u.x.array[shell.mixed.dofs["u"]].reshape(-1, 3)
    owned = shell.mixed.subspaces["u"].dofmap.index_map.size_local
    nodes = local_nodes(shell, point, "verify")
    here = values[nodes[nodes < owned]]
    total = np.sum(here, axis=0)
    simulation.model.comm.Allreduce(MPI.IN_PLACE, total)
    return np.asarray(total / simulation.model.comm.allreduce(len(here)))


def displacement_at(simulation: Simulation, point: tuple[float, float, float]) -> Floats:
    """Displacement at any point of the only shell, a flat one, shape (3,), m; for distorted meshes.

    Args:
        simulation: The simulation, with a step solved.
        point: Reference position, m.
    """
    (shell,) = simulation.model.shells.values()
    domain = shell.mixed.space.mesh
    u = simulation.problem.levels[shell.name].unknown[simulation.problem.last]
    x = np.array([point])
    candidates = geometry.compute_collisions_points(geometry.bb_tree(domain, 2), x)
    cells = geometry.compute_colliding_cells(domain, candidates, x).links(0)[:1]
    total = np.zeros(4)
    function = fem.Function(shell.mixed.subspaces["u"])
    function.x.array[:] = u.x.array[shell.mixed.dofs["u"]]
    for cell in cells:
        total[:3] += function.eval(x, np.array([cell]))
    total[3] = len(cells)
    simulation.model.comm.Allreduce(MPI.IN_PLACE, total)
    return np.asarray(total[:3] / total[3])


def linear_displacement(scene: Scene, point: Place) -> Floats:
    """Displacement of a point of the only shell of a scene, solved to its end, shape (3,), m."""
    return displacement(solved(scene), point)


class Path(BaseObserver):
    """Displacements of points after each load step.

    Args:
        points: Names or coordinates of nodes of the only shell.

    Attributes:
        times: Time of each step.
        values: Displacements, one array (points, 3) per step.
    """

    def __init__(self, *points: Place) -> None:
        self.points = points
        self.times: list[float] = []
        self.values: list[Floats] = []

    def accepted(self, simulation: Simulation) -> None:
        """Take the displacements down."""
        self.times.append(simulation.t)
        self.values.append(np.array([displacement(simulation, p) for p in self.points]))


def curve(scene: Scene, times: Floats, *points: Place) -> Floats:
    """Displacements of points along a path of loading, shape (times, points, 3), m.

    Args:
        scene: A static scene with one shell, `dt` such that every time is the end of a step.
        times: Times at which the displacements are wanted.
        points: Names or coordinates of nodes.
    """
    path = Path(*points)
    Simulation(scene).run([path])
    steps = [int(np.argmin(np.abs(np.array(path.times) - t))) for t in times]
    assert np.allclose(np.array(path.times)[steps], times, rtol=1e-9), "no step ends there"
    return np.array(path.values)[steps]


def deflection_error(simulation: Simulation, exact: ufl.core.expr.Expr) -> float:
    """Error of the deflection along z in L2, relative to the exact one, of the only shell.

    Args:
        simulation: The simulation, with a step solved.
        exact: The exact deflection, in terms of the spatial coordinate of the shell's mesh.
    """
    (shell,) = simulation.model.shells.values()
    q = simulation.problem.levels[shell.name].unknown[simulation.problem.last]
    dx = ufl.dx(degree=NORM_DEGREE)
    squares = [(shell.layout.part(q, "u")[2] - exact) ** 2 * dx, exact**2 * dx]
    error, size = (
        simulation.model.comm.allreduce(fem.assemble_scalar(compiled(f))) for f in squares
    )
    return float(np.sqrt(error / size))
