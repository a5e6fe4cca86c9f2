"""Stiffness and mass matrices of a model at a state, and energies that small strains leave out."""

from collections.abc import Callable, Mapping
from typing import Any

from mpi4py import MPI

import basix
import numpy as np
import ufl
from dolfinx import fem
from ufl import Form

from shellmb.arrays import Floats
from shellmb.model.body import TimeFunction, added
from shellmb.model.frames.beam import BeamModel
from shellmb.model.model import Model
from shellmb.model.shells.shell import ShellModel
from shellmb.native.expressions import values_in_cells
from shellmb.preprocessing.bodyfields import body_field
from shellmb.schemes.interval import at_state
from shellmb.schemes.residuals.residual import sub_forces
from shellmb.schemes.residuals.rows import Span
from shellmb.system.assembly.blocks import BlockSystem
from shellmb.system.assembly.fields import DependentFunctions, Field
from shellmb.system.assembly.functionals import functionals

# forms that add up to each block of a matrix
Blocks = dict[tuple[int, int], list[Form]]


def tangent(
    model: Model,
    arrays: Mapping[str, Floats] | None = None,
    factor: Callable[[TimeFunction | None], float] | None = None,
) -> tuple[BlockSystem, Blocks, Blocks]:
    """Block system at a state, with the forms of its stiffness and mass matrices.

    Args:
        model: The bodies.
        arrays: Local arrays of the state by `NAME/q`; None: the reference. One of statics has none
            of the inertia of bodies in modes, which follows from modes and frames.
        factor: Factors of the loads at that state by their time functions; None: no loads.
    """
    fields: list[Field] = []
    followers: list[DependentFunctions] = []
    absent: list[tuple[Callable[[Floats], None], Floats]] = []
    stiffness: Blocks = {}
    alone: list[list[Form]] = []
    mass: Blocks = {}
    numbers = {body.name: k for k, body in enumerate(model.bodies)}
    for k, body in enumerate(model.bodies):
        space = body.mixed.space
        q = fem.Function(space)
        if arrays and f"{body.name}/q" not in arrays and body.follow is not None:
            absent.append((body.follow, np.asarray(q.x.array)))
        elif arrays:
            q.x.array[:] = arrays[f"{body.name}/q"]
        dq, trial = ufl.TestFunction(space), ufl.TrialFunction(space)
        sub = Span(at_state(q), [q], 0)
        form, terms = sub_forces(body, sub, dq, trial)
        if sub.states is not None:
            followers.append(DependentFunctions(**vars(sub.states)))
        forms = [form]
        loads = body.loads() if factor is not None else None
        if loads is not None and factor is not None:
            loads.update(factor)
            work = loads.virtual_work(q, dq)
            forms.append(-work if work is not None else None)
        residual = added(forms)
        alone.append([form for term in terms for form in term.alone])
        alone[k] += [] if residual is None else [residual]
        inertia = body.inertia(trial, dq)
        if inertia is not None:
            mass[k, k] = [inertia]
        fields.append(body_field(body, q, (), numbers))
    system = BlockSystem(model.comm, fields, followers)
    for k, some in enumerate(alone):
        stiffness[k, k] = [by for form in some for j, by in system.derivatives(form) if j == k]
    if absent:
        system.join([array.copy() for array in system.arrays])
        for follow, state in absent:
            follow(state)
    system.follow()
    return system, stiffness, mass


def bending_scale(body: ShellModel | BeamModel) -> float:
    """`D/(m L^4)` of a shell or beam: the size of the square of its lowest frequency, rad^2/s^2."""
    stiffness, mass = body.bending
    return stiffness / mass / body.domain.length**4


def bending_scales(model: Model) -> list[float]:
    """Scales of the bending frequencies of all shells and beams, rad^2/s^2."""
    return [bending_scale(body) for body in model.meshed.values()]


class GeometricStiffness:
    """Energies of squares of rotations about a frame, as of `forms.floating.frame`.

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
