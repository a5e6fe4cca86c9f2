"""Energies that small strains leave out, in numbers: of squares of rotations."""

from typing import Any

from mpi4py import MPI

import basix
import numpy as np
import ufl
from dolfinx import fem

from shellmb.arrays import Floats
from shellmb.model.frames.beam import BeamModel
from shellmb.model.shells.shell import ShellModel
from shellmb.native.expressions import values_in_cells
from shellmb.system.assembly.functionals import functionals


class GeometricStiffness:
    """Energies of squares of rotations about a frame, as of `forms.floating.geometric_stiffness`.

    Args:
        body: The shell or beam.
    """

    def __init__(self, body: ShellModel | BeamModel) -> None:
        space = body.mixed.space
        self._q = q = fem.Function(space)
        self._R = fem.Constant(space.mesh, np.eye(3))
        formulation: Any = body.section.formulation
        self._comm, self._plane = space.mesh.comm, space.mesh.topology.dim == 2
        (stiff, _), length = body.bending, body.domain.length
        # of a column with one end clamped
        self._euler = np.pi**2 / 4 * stiff / length**2 / float(formulation.N0)
        N = body.forces(q) / formulation.N0
        points, _ = basix.make_quadrature(space.mesh.basix_cell(), 2)
        self._read, N = values_in_cells(N, points, space.mesh), formulation.N0 * N
        densities = body.of_squares(N, q, self._R)
        self._units = np.array([1.0, 1.0, body.stretching[0]])
        dx = ufl.dx(space.mesh, degree=2)
        self._energies = functionals([[density * dx] for density in densities], space.mesh.comm)

    def of(self, state: Floats, R: Floats | None = None) -> Floats:
        """Energies of forces along the body, of stretching, and of squares if edges were fixed, J.

        Args:
            state: Local array.
            R: Directors of the frame as rows.
        """
        self._q.x.array[:] = state
        if R is not None:
            self._R.value = R.T  # type: ignore[assignment]
        return self._units * self._energies()

    def compression(self, state: Floats) -> float:
        """Largest compression along the body, over what buckles it as a cantilever; collective.

        Args:
            state: Local array.
        """
        self._q.x.array[:] = state
        N = self._read()
        lowest = N[..., 0]
        if self._plane:
            mean, half = (N[..., 0] + N[..., 1]) / 2, (N[..., 0] - N[..., 1]) / 2
            lowest = mean - np.hypot(half, N[..., 2])
        most = float(np.max(-lowest, initial=0.0))
        return float(self._comm.allreduce(most, op=MPI.MAX)) / self._euler
