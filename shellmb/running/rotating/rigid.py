"""Rigid motions: that in the motion of a state, and those of free bodies among modes.

A body that nothing holds goes on moving uniformly, wherever it was and with whatever velocity. Seen
from a frame that turns with `Omega` both are `exp(i Omega t)`: a double eigenvalue with one
vector, which round-off splits by its own square root, so that one half of it seems to grow. The
same eigenvalue belongs to a rotation that is tilted. Where a mode has the shape of rigid motions,
body by body, and these motions satisfy the equations with `i Omega`, that is its eigenvalue.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import NamedTuple

from petsc4py import PETSc

import numpy as np
import ufl
from dolfinx import fem

from shellmb.arrays import Floats, Int32s
from shellmb.model.body import rigid_rate
from shellmb.model.frames.frame import FrameBody
from shellmb.model.model import Model
from shellmb.observers.account.energy import scalar
from shellmb.observers.fields.nodal import NodalBody, nodal_bodies
from shellmb.running.rotating.axis import Axis
from shellmb.running.rotating.linearised import Linearised
from shellmb.running.rotating.quadratic import Pair, product
from shellmb.scene import GROUND, Planar, Scene

Functions = Mapping[str, fem.Function]

# directions that hold less than this part of the largest inertia turn nothing
TURNS = 1e-10
# directions that joints hold by less than this square of a cosine are free: axes are parallel to
# the digits that are given
SLIDES = 1e-12


class Affine(NamedTuple):
    """A field of velocities `A y + c`; directors have `A d`.

    Args:
        matrix: `A`, shape (3, 3), 1/s.
        shift: `c`, shape (3,), m/s.
    """

    matrix: Floats
    shift: Floats


def spinning(omega: Floats, about: Floats) -> Affine:
    """Velocities of a rotation about a point.

    Args:
        omega: Angular velocity, rad/s.
        about: The point, m.
    """
    # columns are the velocities of unit vectors
    matrix = np.cross(omega, np.eye(3)).T
    return Affine(matrix, -matrix @ about)


NOTHING = Affine(np.zeros((3, 3)), np.zeros(3))


class Products:
    """Products `M v.w` of motions of all bodies at a state, each a function and an affine field.

    Args:
        model: The bodies.
        q: Their states.
    """

    def __init__(self, model: Model, q: Functions) -> None:
        self.model, self.q = model, q
        # by body: its function, and the constants of its field
        self._ends: list[dict[str, tuple[fem.Function, fem.Constant, fem.Constant]]] = [{}, {}]
        forms = []
        for body in model.bodies:
            mesh, sides = body.mixed.space.mesh, []
            for end in self._ends:
                matrix = fem.Constant(mesh, np.zeros((3, 3)))
                function, shift = fem.Function(body.mixed.space), fem.Constant(mesh, np.zeros(3))
                end[body.name] = function, matrix, shift
                field = rigid_rate(body, q[body.name], partial(ufl.dot, matrix), shift)
                sides.append(function + field)
            forms.append(body.inertia(*sides))
        self._sum = scalar(forms, model.comm)

    def __call__(
        self, first: tuple[Functions | None, Affine], second: tuple[Functions | None, Affine]
    ) -> float:
        """The product of two motions."""
        for end, (given, field) in zip(self._ends, (first, second), strict=True):
            for name, (function, A, c) in end.items():
                some = (given or {}).get(name)
                function.x.array[:] = 0.0 if some is None else some.x.array
                A.value[:], c.value[:] = field
        return 0.0 if self._sum is None else self._sum()

    def square(self, motion: Functions | None, field: Affine = NOTHING) -> float:
        """The product of a motion with itself; not negative."""
        return max(self((motion, field), (motion, field)), 0.0)


class WholeMotion:
    """Mass, centre, and the mean translation and rotation of a motion, nearest in the mass.

    Args:
        products: Of the state.
        length: Length of the scene, m.

    Attributes:
        mass: Mass, kg.
        centre: Centre of mass, m.
    """

    def __init__(self, products: Products, length: float) -> None:
        self._products, self.length = products, length
        self._along = [Affine(np.zeros((3, 3)), e) for e in np.eye(3)]
        self.mass = products.square(None, self._along[0])
        place = Affine(np.eye(3), np.zeros(3))
        first = [products((None, e), (None, place)) for e in self._along]
        self.centre = np.array(first) / self.mass if self.mass > 0 else np.zeros(3)

    def translation(self, motion: Functions) -> Floats:
        """Mean of the velocities or accelerations of all mass."""
        if self.mass == 0:
            return np.zeros(3)
        return np.array(
            [self._products((motion, NOTHING), (None, e)) / self.mass for e in self._along]
        )

    def rotation(self, velocity: Functions, axis: Floats | None = None) -> Floats:
        """Angular velocity of the rigid motion that is nearest: `J^-1 L` about the centre, rad/s.

        Args:
            velocity: Velocities.
            axis: Unit vector of the axis; None: any.
        """
        units = np.eye(3) if axis is None else axis[None]
        turns = [spinning(e, self.centre) for e in units]
        inertia = np.array([[self._products((None, a), (None, b)) for b in turns] for a in turns])
        momentum = [self._products((velocity, NOTHING), (None, e)) for e in turns]
        found = np.linalg.lstsq(inertia, np.array(momentum), rcond=TURNS)[0]
        return np.asarray(found @ units)


class Unsteady:
    """Distance of a state from a steady rotation: what moves relative to a frame.

    Spins of triples of directors do not count: small motions are those of their axes.

    Args:
        scene: The scene.
        products: Products of motions at the state.
        whole: Of the state.
        motion: Velocities and accelerations.
        line: Axis of the frame.
        rate: Its rate, rad/s.

    Attributes:
        velocity: Velocities relative to the frame, root mean square over the mass, m/s.
        acceleration: Accelerations beyond those of a steady rotation, m/s^2.
        turning: Change of the inertia of what spins and is not the same all around, over that of
            the whole, 1/s.
        energy_share: Part of the kinetic energy that is not the rotation of the frame.
        acceleration_share: Part of all accelerations that are not those of that rotation.
        length: Length of the scene, m.
    """

    def __init__(
        self,
        scene: Scene,
        products: Products,
        whole: WholeMotion,
        motion: tuple[Functions, Functions],
        line: Axis,
        rate: float,
    ) -> None:
        turn = spinning(rate * line.unit, np.asarray(line.about))
        inward = Affine(turn.matrix @ turn.matrix, turn.matrix @ turn.shift)
        spins = Spins(products, motion, turn.matrix)
        squares, free = [], _free(scene)
        for of, rest, frame in zip(motion, spins.rest, (turn, inward), strict=True):
            # a uniform motion, or fall, of all that is free to go on changes nothing
            mean = whole.translation(of) - frame.matrix @ whole.centre - frame.shift
            left = Affine(-frame.matrix, -frame.shift - free @ mean)
            squares.append((products.square(rest, left), products.square(of, left)))
        (moving, relative), (pushing, pushed) = squares
        moved, pulled = (products.square(of) for of in motion)
        mass = max(whole.mass, 1e-300)
        self.velocity, self.acceleration = (math.sqrt(of / mass) for of in (moving, pushing))
        self.turning, self.length = spins.turning(whole), whole.length
        self.energy_share = relative / moved if moved > 0 else 0.0
        self.acceleration_share = math.sqrt(pushed / pulled) if pulled > 0 else 0.0

    def drift(self, scale: float) -> float:
        """Distance that the state moves in the time `1/scale`, in lengths of the scene.

        And the part by which its inertia changes.

        Args:
            scale: Of an eigenvalue, 1/s.
        """
        moved = (self.velocity / scale + self.acceleration / scale**2) / self.length
        return moved + self.turning / scale


class Spins:
    """Spins of triples of directors relative to a frame, each about its own axes.

    Args:
        products: Of the state.
        motion: Velocities and accelerations of all bodies.
        turn: Velocities of vectors that turn with the frame, shape (3, 3).

    Attributes:
        rest: Velocities and accelerations without those of steady spins, by body.
    """

    def __init__(
        self, products: Products, motion: tuple[Functions, Functions], turn: Floats
    ) -> None:
        self._products = products
        self.rest = tuple({name: f.copy() for name, f in of.items()} for of in motion)
        # of each body the dofs of its directors, these, and the matrix that mixes them
        self._bodies: list[tuple[FrameBody, Int32s, Floats, Floats]] = []
        rigid = [] if products.model.rigid is None else [products.model.rigid]
        for body in (*products.model.beams.values(), *rigid):
            w = body.mixed.dofs["w"].reshape(-1, 3, 3)
            d = body.frames_at(products.q[body.name].x.array)
            velocity, acceleration = (of[body.name].x.array for of in self.rest)
            carried = d @ turn.T
            mixing = d @ (velocity[w] - carried).swapaxes(1, 2)
            # d_k' and d_k'' of a steady spin in the frame that turns: columns are those of d_k
            rates = mixing.swapaxes(1, 2) @ d
            acceleration[w] -= 2 * rates @ turn.T + (mixing @ mixing).swapaxes(1, 2) @ d
            velocity[w] = carried
            self._bodies.append((body, w, d, mixing))

    def turning(self, whole: WholeMotion) -> float:
        """Change of the inertia of what spins and is not the same all around; collective, 1/s.

        Args:
            whole: Of the state.
        """
        changes = 0.0
        for body, w, d, mixing in self._bodies:
            for here in body.pieces():
                turned = [np.where(here, np.cross(e, d), 0.0) for e in np.eye(3)]
                mixed = [mixing.swapaxes(1, 2) @ part for part in turned]
                rows, columns = (
                    [({body.name: _directed(body, w, part)}, NOTHING) for part in parts]
                    for parts in (mixed, turned)
                )
                found = np.array([[self._products(a, b) for b in columns] for a in rows])
                changes += float(np.linalg.norm(found + found.T))
        about = [spinning(e, whole.centre) for e in np.eye(3)]
        inertia = sum(self._products.square(None, turn) for turn in about) / 2
        return changes / inertia if inertia > 0 else 0.0


def _directed(body: FrameBody, w: Int32s, values: Floats) -> fem.Function:
    """A function of a body with values of its directors alone."""
    function = fem.Function(body.mixed.space)
    function.x.array[w] = values
    return function


def _free(scene: Scene) -> Floats:
    """Projection on the directions in which all can go on without resistance, shape (3, 3)."""
    in_space = any(GROUND in (e.first, e.second) for e in scene.point_elements)
    in_space = in_space or any(c.in_space for c in scene.contacts)
    if scene.supports or scene.potentials or in_space:
        return np.zeros((3, 3))
    acts = [e.joint for e in scene.joint_elements]
    acts += [part.joint for parts in (scene.drivers, scene.locks) for part in parts]
    held = np.zeros((3, 3))
    for joint in scene.joints:
        if GROUND not in (joint.first, joint.second):
            continue
        slides, planar = np.zeros((3, 3)), isinstance(joint, Planar)
        if joint.name not in acts and (planar or "translation" in joint.freedoms):
            along = np.asarray(joint.lines[0], float)
            slides = np.outer(along, along) / (along @ along)
            if planar:
                slides = np.eye(3) - slides
        held += np.eye(3) - slides
    values, vectors = np.linalg.eigh(held)
    directions = vectors[:, values < SLIDES]
    return np.asarray(directions @ directions.T)


# Eigenvalues nearer to `i Omega` than this part of it are looked at. Of a rigid shape all but
# this part of the mass moves so, and its equation is satisfied to this part of its inertia forces:
# equilibria are as exact. A spring as soft as that changes the frequency by 1.6e-5 at most
NEAR, SHAPE, FREE = 1e-2, 1e-6, 1e-9


class FreeMotions:
    """Tells rigid motions of free bodies by their shapes.

    Args:
        rotating: The system, in the frame as it turns.
        matrices: Its stiffness, damping with Coriolis' forces, and mass.
    """

    def __init__(self, rotating: Linearised, matrices: Sequence[PETSc.Mat]) -> None:
        self._rotating, self._system, self._matrices = rotating, rotating.system, matrices

    def exact(self, pair: Pair) -> Pair:
        """A mode with its exact eigenvalue, if it is a rigid motion of free bodies."""
        own = 1j * abs(self._rotating.rate)
        if own == 0 or abs(pair.value - own) > NEAR * abs(own):
            return pair
        parts = []
        for vector in (pair.real, pair.imaginary):
            rigid = vector.duplicate()
            rigid.array[:] = self._rigid(self._system.local_values(vector))
            parts.append(rigid)
        rigid_pair = Pair(own, *parts)
        rest = Pair(own, pair.real - parts[0], pair.imaginary - parts[1])
        K, C, M = self._matrices
        whole = product(M, pair, pair).real
        if product(M, rest, rest).real > SHAPE * whole:
            return pair
        terms = [own**n * product(A, rigid_pair, rigid_pair) for n, A in enumerate((K, C, M))]
        return pair._replace(value=own) if abs(sum(terms)) <= FREE * abs(terms[2]) else pair

    def _rigid(self, values: Floats) -> Floats:
        """The rigid motion of each body that is nearest to some values of all local unknowns."""
        system, model = self._system, self._rotating.model
        found = []
        bodies = nodal_bodies(model)
        for k, (body, field) in enumerate(zip(model.bodies, system.fields, strict=True)):
            own = np.full(field.size_all, np.nan)
            if body.name in bodies:
                self._fit(bodies[body.name], values[system.numbering.slice(k)], own)
            found.append(own[: field.size_local])
        return system.global_values(found, known=True)

    def _fit(self, body: NodalBody, part: Floats, own: Floats) -> None:
        """Put the rigid motion of a body that is nearest to a part of a mode in its place."""
        q = self._rotating.levels[body.name].q.x.array
        X, D = body.node_positions(), body.node_directors()
        u, w = body.mixed.dofs["u"].reshape(-1, 3), body.mixed.dofs["w"].reshape(D.shape)
        x, d = X + q[u], D + q[w]
        # displacements by a translation and a rotation, and directors by the rotation, as lengths
        length = self._rotating.model.length
        rows = np.concatenate([_turned(x[:, None]), length * _turned(d)], axis=1)
        rows[:, 0, :, :3] = np.eye(3)
        given = np.concatenate([part[u][:, None], length * part[w]], axis=1)
        normal = np.einsum("nmik,nmil->nkl", rows, rows)
        right = np.einsum("nmik,nmi->nk", rows, given)
        if body is not self._rotating.model.rigid:
            comm = self._rotating.model.comm
            normal, right = (
                np.broadcast_to(comm.allreduce(a.sum(axis=0)), a.shape) for a in (normal, right)
            )
        motion = np.einsum("nkl,nl->nk", np.linalg.pinv(normal, hermitian=True), right)
        moved = np.einsum("nmik,nk->nmi", rows, motion)
        own[u], own[w] = moved[:, 0], moved[:, 1:] / length


def _turned(vectors: Floats) -> Floats:
    """Rotate vectors about the axes, shape (n, m, 3, 6), the last three of six."""
    found = np.zeros((*vectors.shape, 6))
    for axis in range(3):
        found[..., 3 + axis] = np.cross(np.eye(3)[axis], vectors)
    return found
