"""What distributed loads are on the modes of a body, from the body's own virtual work of each.

That of a dead load is linear in positions and directors, and so the same as that of one force at a
point for each direction that the load has (`model.reduced.loads`). What turns with the body, and
moments, are taken to the first order in the modes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem, la
from ufl import Form

from shellmb.kernels import compiled
from shellmb.model.frames.beam import BeamLoads, BeamModel
from shellmb.model.reduced.data import ModalForces, ModalPoint
from shellmb.model.shells.loads import DistributedLoads, ShellLoads
from shellmb.scene.loads.body_loads import LineForce, LineMoment
from shellmb.scene.loads.loads import EdgeForce, EdgeMoment, Gravity, SurfaceForce
from shellmb.simulate.reduction.alone import Alone, Arrays, Floats

DEAD = (SurfaceForce, EdgeForce, LineForce, Gravity)
MOMENTS = (EdgeMoment, LineMoment)

# directions in which a load has less than this share of its forces are none
NO_FORCE = 1e-12


class ProjectedLoads:
    """Distributed loads on the modes of a body.

    Args:
        alone: The body by itself.
        modes: Its modes.
        center: Its centre of mass, where its frame is, shape (3,), m.
        length: Its size, m.
    """

    def __init__(self, alone: Alone, modes: list[Arrays], center: Floats, length: float) -> None:
        self._alone, self._modes, self._center, self._length = alone, modes, center, length

    def points(self, loads: Sequence[Any]) -> tuple[ModalPoint, ...]:
        """Forces that keep their directions, as forces at points; collective."""
        return tuple(p for load in loads if isinstance(load, DEAD) for p in self._points(load))

    def forces(self, loads: Sequence[Any]) -> tuple[ModalForces, ...]:
        """All others, as forces on frame and amplitudes; collective."""
        found: list[ModalForces] = []
        for load in loads:
            if isinstance(load, MOMENTS):
                found += self._moments(load)
            elif not isinstance(load, DEAD):
                found.append(ModalForces(load.time, None, self._table(load)))
        return tuple(found)

    def _points(self, load: Any) -> Iterator[ModalPoint]:
        """A point for each direction in space that a load has independently."""
        alone, K = self._alone, len(self._modes)
        arrays = alone.zeros()
        arrays[load.body] = self._assembled(load)(None)
        arms = [alone.arm(a, self._center) for a in range(3)]
        shapes = [alone.along_x(mode, a) for a in range(3) for mode in self._modes]
        fields = [alone.one(), *arms, *shapes]
        rows = [[self._work(alone.along_x(arrays, i), f) for f in fields] for i in range(3)]
        table = np.array(rows)
        # forces and moments in one unit
        table[:, 1:4] /= self._length
        directions, sizes, profiles = np.linalg.svd(table, full_matrices=False)
        for size, direction, profile in zip(sizes, directions.T, profiles, strict=True):
            if size > NO_FORCE * sizes[0]:
                arm, shape = self._length * profile[1:4], profile[4:].reshape(3, K)
                yield ModalPoint(load.time, size * direction, float(profile[0]), arm, shape)

    def _moments(self, load: Any) -> Iterator[ModalForces]:
        """A moment that keeps its direction, by its components along the axes of the frame."""
        given, key = load.moment, "moment"
        if not callable(given):
            for a in range(3):
                unit = tuple(float(c) for c in np.eye(3)[a])
                table = self._table(replace(load, **{key: unit}))
                yield ModalForces(load.time, _along(np.array(given, dtype=float), a), table)
            return
        for i in range(3):
            for a in range(3):

                def turned(x: Any, i: int = i, a: int = a) -> Floats:
                    values = np.asarray(given(x), dtype=float)
                    return np.outer(np.eye(3)[a], values[i]).reshape(values.shape)

                table = self._table(replace(load, **{key: turned}))
                yield ModalForces(load.time, _along(np.eye(3)[i], a), table)

    def _table(self, load: Any) -> Floats:
        """Force and moment along the axes of the frame, and forces on the amplitudes.

        Returns:
            Of the body at rest, and per amplitude, shape (6 + K, 1 + K).
        """
        alone, K = self._alone, len(self._modes)
        assembled, name = self._assembled(load), load.body
        rigid = [alone.motion(axis, self._center) for axis in range(6)]
        fields = [*rigid, *self._modes]
        found = np.zeros((6 + K, 1 + K))
        still = alone.zeros()
        still[name] = assembled(None)
        for column, mode in enumerate([None, *self._modes]):
            changed = still
            if mode is not None:
                changed = alone.zeros()
                changed[name] = assembled(mode[name])
            found[:, column] = [self._work(changed, f) for f in fields]
            if mode is not None:
                # forces at rest on what the mode has moved
                found[3:6, column] += [self._work(still, self._turned(mode, a)) for a in range(3)]
        return found

    def _turned(self, mode: Arrays, axis: int) -> Arrays:
        """`e_a x phi`."""
        out = self._alone.zeros()
        for name in self._alone.model.meshed:
            dofs = self._alone.bodies[name].mixed.dofs
            for part in ("u", "bubble", "w"):
                if part in dofs:
                    vectors = mode[name][dofs[part]].reshape(-1, 3)
                    out[name][dofs[part].ravel()] = np.cross(np.eye(3)[axis], vectors).ravel()
        return out

    def _assembled(self, load: Any) -> Callable[[Floats | None], Floats]:
        """Virtual work of a load at rest, or its derivative along a state; local arrays."""
        body: Any = self._alone.bodies[load.body]
        kind: Any = BeamLoads if isinstance(body, BeamModel) else ShellLoads
        acting: DistributedLoads = kind(body, [load])
        acting.update(lambda time: 1.0)
        q, change = fem.Function(body.mixed.space), fem.Function(body.mixed.space)
        work = acting.virtual_work(q, ufl.TestFunction(body.mixed.space))
        assert work is not None

        def of(form: Form) -> Floats:
            vector = fem.assemble_vector(compiled(form))
            vector.scatter_reverse(la.InsertMode.add)
            vector.scatter_forward()
            return np.array(vector.array)

        def along(direction: Floats | None) -> Floats:
            if direction is None:
                return of(work)
            change.x.array[:] = direction
            return of(ufl.derivative(work, q, change))

        return along

    def _work(self, forces: Arrays, field: Arrays) -> float:
        """Work of nodal forces on a field, of what each rank owns; collective."""
        total = 0.0
        for name in self._alone.model.meshed:
            index_map = self._alone.bodies[name].mixed.space.dofmap.index_map
            here = slice(index_map.size_local)
            total += float(forces[name][here] @ field[name][here])
        return self._alone.comm.allreduce(total, op=MPI.SUM)


def _along(moment: Floats, a: int) -> Floats:
    """What gives the component of a moment along one axis from all three of them, shape (9,)."""
    found = np.zeros((3, 3))
    found[a] = moment
    return found.ravel()
