"""Distributed loads and users' terms on a body in modes, by the virtual work of each.

That of a dead load is linear in positions and directors, and so the same as that of one force at a
point for each direction that the load has (`model.reduced.floating_body`). What turns with the
body, and moments, are taken to the first order in the modes. Terms act on the body's own mesh, and
only the modes follow from what they are at rest.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from petsc4py import PETSc

import numpy as np
import ufl
from dolfinx import fem

from shellmb.arrays import Floats
from shellmb.model.body import Rates, TimeFunction
from shellmb.model.reduced.data import ModalForces, ModalPoint
from shellmb.native.derivatives import derivative
from shellmb.native.kernels import assembled
from shellmb.preprocessing.modal.isolated import IsolatedBody
from shellmb.preprocessing.modal.tangent import Blocks
from shellmb.scene import EdgeForce, EdgeMoment, Gravity, LineForce, LineMoment, SurfaceForce

DEAD = (SurfaceForce, EdgeForce, LineForce, Gravity)
MOMENTS = (EdgeMoment, LineMoment)

# when terms are looked at, as shares of the run: unevenly, so that no wave is zero at all of them
TIMES = (0.0, 0.04, 0.11, 0.23, 0.37, 0.53, 0.71, 0.89, 1.0)
# directions in which a load has less than this share of its forces are none
NO_FORCE = 1e-12


# nodal forces of a load at rest, or their derivative along a field
type Work = Callable[[Floats | None], Floats]
# a part of a load that keeps its direction: time of the load, the direction, shape (3,), and nodal
# forces in it, along x
type Dead = tuple[TimeFunction | None, Floats, Floats]
# one that turns with the body, or a moment's component along it: time, and `along` of `ModalForces`
type Follower = tuple[TimeFunction | None, Floats | None, Work]


class SpreadLoads:
    """Distributed loads on a body.

    Args:
        isolated: The body by itself.
        loads: The loads, each with the name of its body; collective.
    """

    def __init__(self, isolated: IsolatedBody, loads: Sequence[Any]) -> None:
        self._isolated = isolated
        dead = [load for load in loads if isinstance(load, DEAD)]
        self._dead = [found for load in dead for found in self._directions(load)]
        others = [load for load in loads if not isinstance(load, DEAD)]
        self._followers = [found for load in others for found in self._turned_by(load)]

    def vectors(self) -> list[Floats]:
        """Nodal forces of all loads, of dead ones along each axis: as the body may be turned."""
        isolated, found = self._isolated, []
        for _, _, profile in self._dead:
            found += [isolated.moved(profile, 0, axis) for axis in range(3)]
        forces = [work(None) for _, _, work in self._followers]
        # no moment is about the director of a shell
        return found + [one for one in forces if isolated.work(one, one) > 0]

    def points(self, modes: Floats, center: Floats, length: float) -> tuple[ModalPoint, ...]:
        """Dead loads on the modes, as forces at points; collective.

        Args:
            modes: The modes.
            center: Centre of mass, where the frame is, shape (3,), m.
            length: Size of the body, m.
        """
        if not self._dead:
            return ()
        isolated, found = self._isolated, []
        arms = [isolated.arm(a, center) for a in range(3)]
        shapes = [isolated.moved(modes, a) for a in range(3)]
        fields = np.column_stack([isolated.motion(0, center), *arms, *shapes])
        for time, direction, profile in self._dead:
            sums = isolated.work(profile, fields)
            # forces and moments in one unit: nothing of the arms is large
            size = float(np.linalg.norm([sums[0], *sums[1:4] / length, *sums[4:]]))
            share, arm, shape = sums[0] / size, sums[1:4] / size, sums[4:] / size
            force = size * direction
            found.append(ModalPoint(time, force, float(share), arm, shape.reshape(3, -1)))
        return tuple(found)

    def forces(self, modes: Floats, center: Floats) -> tuple[ModalForces, ...]:
        """All others, as forces on frame and amplitudes; collective."""
        return tuple(
            ModalForces(time, along, self._table(work, modes, center))
            for time, along, work in self._followers
        )

    def _directions(self, load: Any) -> Iterator[Dead]:
        """Directions in space that a load has independently."""
        isolated = self._isolated
        forces = _acting(isolated, load)(None)
        parts = np.column_stack([isolated.moved(forces, i) for i in range(3)])
        sizes, directions = np.linalg.eigh([isolated.work(part, parts) for part in parts.T])
        for size, direction in zip(sizes, directions.T, strict=True):
            if size > NO_FORCE * sizes[-1]:
                yield load.time, direction, parts @ direction

    def _turned_by(self, load: Any) -> Iterator[Follower]:
        """List what turns with the body; of a moment each component along its axes."""

        def follower(item: Any, along: Floats | None) -> Follower:
            return load.time, along, _acting(self._isolated, item)

        if not isinstance(load, MOMENTS):
            yield follower(load, None)
            return
        given: Any = load.moment
        described: Any = load
        for a, unit in enumerate(np.eye(3)):
            if not callable(given):
                turned = replace(described, moment=tuple(map(float, unit)))
                yield follower(turned, np.outer(unit, given).ravel())
                continue
            for i in range(3):
                turned = replace(described, moment=partial(_component, given, a, i))
                yield follower(turned, np.outer(unit, np.eye(3)[i]).ravel())

    def _table(self, work: Work, modes: Floats, center: Floats) -> Floats:
        """Force and moment along the axes of the frame, and forces on the amplitudes.

        Returns:
            Of the body at rest, and per amplitude, shape (6 + K, 1 + K).
        """
        isolated, still = self._isolated, work(None)
        rigid = [isolated.motion(axis, center) for axis in range(6)]
        fields = np.column_stack([*rigid, modes])
        changed = [still, *(work(mode) for mode in modes.T)]
        found = np.stack([isolated.work(forces, fields) for forces in changed], axis=1)
        for column, mode in enumerate(modes.T, start=1):
            # forces at rest on what the mode has moved
            turned = np.column_stack([isolated.turned(mode, axis) for axis in range(3)])
            found[3:6, column] += isolated.work(still, turned)
        return found


class TermsAtRest:
    """The user's terms on a body that is at rest, at several times of the run.

    Args:
        isolated: The body by itself, in its supports.
        t_end: Time at the end of the run, s.
        static: Whether there are no velocities.
    """

    def __init__(self, isolated: IsolatedBody, t_end: float, static: bool) -> None:
        self._isolated, self._times = isolated, [share * t_end for share in TIMES]
        self._forms: list[tuple[str, Any, fem.Function, fem.Function, Any]] = []
        for body in isolated.model.meshed.values():
            space = body.mixed.space
            q, v = fem.Function(space), fem.Function(space)
            time: Any = fem.Constant(space.mesh, 0.0)
            rates = None if static else Rates(v, v)
            work = body.users(q, rates, ufl.TestFunction(space), time)
            if work is not None:
                self._forms.append((body.name, work, q, v, time))

    def _at(self, t: float) -> Floats:
        """Nodal forces at a time, and in the state that is set; collective."""
        for *_, time in self._forms:
            time.value = t
        own = [self._isolated.of_body(name, assembled(work)) for name, work, *_ in self._forms]
        return np.asarray(np.sum(own, axis=0))

    def acting(self, t: float, nodes: Mapping[str, Any], d: Floats) -> Floats:
        """Nodal forces along the axes of a frame that has moved with the body; collective.

        Args:
            t: Time, s.
            nodes: Values at the nodes of each part of the body.
            d: Directors of the frame as rows, shape (3, 3).
        """
        for name, _, q, v, _ in self._forms:
            dofs, now = self._isolated.bodies[name].mixed.dofs, nodes[name]
            turned = now.directors - now.reference_directors
            for function, *parts in (
                (q, now.displacement, turned),
                (v, now.velocity, now.director_velocity),
            ):
                for where, values in zip((dofs["u"], dofs["w"]), parts, strict=True):
                    function.x.array[where] = values.reshape(where.shape)
        found, moved = self._at(t), self._isolated.moved
        return np.asarray(sum(d[a, i] * moved(found, i, a) for a, i in np.ndindex(3, 3)))

    def forces(self) -> list[Floats]:
        """Independent nodal forces; collective."""
        if not self._forms:
            return []
        found = [self._at(t) for t in self._times]
        forces = [self._isolated.force(one) for one in found]
        gram = np.array([[one.dot(other) for one in forces] for other in forces])
        if not np.all(np.isfinite(gram)) or not np.any(gram):
            return []
        sizes, directions = np.linalg.eigh(gram)
        return list(directions.T[sizes > NO_FORCE * sizes[-1]] @ np.array(found))

    def stiffness(self) -> PETSc.Mat | None:
        """Stiffness that holds the body, when it is largest; None without; collective."""
        numbers = {body.name: k for k, body in enumerate(self._isolated.model.bodies)}
        blocks: Blocks = {
            (numbers[name], numbers[name]): [derivative(-work, q)]
            for name, work, q, *_ in self._forms
            if q in work.coefficients()
        }
        largest, size = None, 0.0
        for t in self._times if blocks else ():
            for *_, time in self._forms:
                time.value = t
            found = self._isolated.system.symmetric_matrix(blocks, 0.0)
            # a length that is zero at rest has no slope there
            if np.isfinite(found.norm()) and found.norm() > size:
                largest, size = found, found.norm()
        return largest


def _acting(isolated: IsolatedBody, load: Any) -> Work:
    """Nodal forces of a load at rest, or their derivative along a field."""
    body = isolated.bodies[load.body]
    acting = body.loads_of([load])
    acting.update(lambda time: 1.0)
    q, change = fem.Function(body.mixed.space), fem.Function(body.mixed.space)
    work = acting.virtual_work(q, ufl.TestFunction(body.mixed.space))
    assert work is not None

    def along(direction: Floats | None) -> Floats:
        if direction is None:
            return isolated.of_body(load.body, assembled(work))
        change.x.array[:] = direction[isolated.own[load.body]]
        return isolated.of_body(load.body, assembled(ufl.derivative(work, q, change)))

    return along


def _component(moment: Callable[[Any], Any], a: int, i: int, x: Any) -> Floats:
    """One component of a moment at positions, about another axis, shape (3, n)."""
    values = np.asarray(moment(x), dtype=float)
    found = np.zeros_like(values)
    found[a] = values[i]
    return found
