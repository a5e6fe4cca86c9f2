"""By how much squares of displacements stiffen a body between places that the ground holds.

What bends draws its edges together, by the square of its slopes. Where these cannot follow it is
stretched instead, and stiffer. Along `t h + t^2 v`, with `h` what a linear body does and `v` what
the exact one does beside that of second order, the force is `k t + a t^2 + b t^3`: b/k is wanted
(W. T. Koiter, On the Stability of Elastic Equilibrium, thesis, Delft 1945).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem, la

from shellmb.kernels import compiled
from shellmb.scene import Scene
from shellmb.scene.loads.supports import Fixed
from shellmb.scene.multibody.joints import GROUND
from shellmb.scene.multibody.rolling import Contact
from shellmb.schemes.base import at_state
from shellmb.simulate.reduction.alone import Alone, Arrays
from shellmb.simulate.reduction.basis import scene_of
from shellmb.simulate.reduction.supports import edges

# share of displacements whose squares are nothing
SMALL = 1e-4

# local values by body and part of its state
Parts = Mapping[str, Mapping[str, Any]]


def held_scene(scene: Scene, names: Sequence[str]) -> Scene | None:
    """Shells and beams alone, in what holds them to the ground; None unless that is at two places.

    Args:
        scene: The scene.
        names: Names of the shells and beams.
    """
    given: tuple[Any, ...] = scene.supports
    owners = [scene.bodies_of(support)[0].name for support in given]
    supports = [replace(s, body=n) for s, n in zip(given, owners, strict=True) if n in names]
    joints = [
        j
        for j in scene.joints
        if {j.first, j.second} - {GROUND} <= {*names} and not isinstance(j, Contact)
    ]
    places = sum(1 if isinstance(s, Fixed) else len(list(edges(s))) for s in supports)
    lines = {b.curve.shell for b in scene.beams if b.name in names} - {None, *names}
    # what runs along a shell that is no part of it is not there alone
    if places + len(joints) < 2 or lines:
        return None
    alone, scheme = scene_of(scene, names, (), ()), "static" if scene.static else "ep"
    return replace(alone, supports=tuple(supports), joints=tuple(joints), scheme=scheme)


def stiffening(scene: Scene, comm: MPI.Comm, parts: Parts) -> float:
    """The stiffness that small displacements add, as a share of that without; collective.

    Args:
        scene: As of `held_scene`.
        comm: Communicator.
        parts: The displacements and resultants of a linear body relative to its frame, local
            arrays: they tell the forces in it, and these how it is bent in what holds it.
    """
    alone = Alone(scene, comm)
    if scene.static and alone.free_motions(alone.middle).shape[1]:
        # what has no mass does not tell how it moves as a whole
        return 0.0
    small = alone.zeros()
    for name, values in parts.items():
        dofs = alone.bodies[name].mixed.dofs
        for part in dofs.keys() & values.keys():
            small[name][dofs[part]] = SMALL * values[part]
    forces = {name: _force(body) for name, body in alone.model.meshed.items()}

    def force(state: Arrays) -> Any:
        return alone.force({name: of(state[name]) for name, of in forces.items()})

    def moved(force: Any) -> Arrays:
        return alone.arrays(alone.given_way(alone.middle, [force])[0])

    linear = {n: h / SMALL for n, h in moved(force(small)).items()}

    def along(t: float) -> float:
        state = {n: t * h + t**2 * second[n] for n, h in linear.items()}
        direction = {n: h + 2 * t * second[n] for n, h in linear.items()}
        return float(force(state).dot(alone.vector(direction)))

    squares = force(linear)
    squares.axpy(1.0, force({n: -h for n, h in linear.items()}))
    squares.scale(-0.5)
    second = moved(squares)
    stiffness = float(alone.gram(alone.K, [alone.vector(linear)])[0, 0])
    return (along(1.0) - along(-1.0)) / 2 / stiffness - 1 if stiffness > 0 else 0.0


def _force(body: Any) -> Any:
    """Forces at the nodes of a body by its state, local arrays."""
    q, space = fem.Function(body.mixed.space), body.mixed.space
    form = compiled(body.internal(at_state(q), ufl.TestFunction(space)))

    def of(state: Any) -> Any:
        q.x.array[:] = state
        vector = fem.assemble_vector(form)
        vector.scatter_reverse(la.InsertMode.add)
        return np.array(vector.array)

    return of
