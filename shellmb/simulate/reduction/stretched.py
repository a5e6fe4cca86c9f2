"""By how much squares of displacements stiffen a body in what holds it.

What bends draws its edges together, by the square of its slopes. Where these cannot follow it is
stretched instead, and stiffer; a surface that bends two ways is stretched in itself. How far edges
can follow is a matter of all that holds them: supports, joints, other bodies and the mass of these.
So the whole scene is asked, with exact bodies and as it is at rest, what the forces in the bent
body do to it, beside what they do to small displacements.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

from shellmb.scene import Scene
from shellmb.simulate.reduction.alone import STATIC, Alone

# Newton's method from the displacements of the linear body: most bodies take four iterations, and
# what does not converge is asked for less, which is stiffened less
ITERATIONS, SHARES = 12, (1.0, 0.5, 0.25, 0.125)
# work of the last correction, as a share of the energy: what is said is 1e-2 of it, or more
CONVERGED = 1e-6

# square of the rate, relative to that of the bent body, at which what moves freely follows
SLOW = 1e-2

# local values by body and part of its state
Parts = Mapping[str, Mapping[str, Any]]


def stiffening(scene: Scene, comm: MPI.Comm, parts: Parts) -> float:
    """The stiffness that displacements add, as a share of that without; collective.

    Args:
        scene: The scene.
        comm: Communicator.
        parts: The displacements and resultants of a linear body relative to its frame, local
            arrays: they tell the forces in it, and these how it is bent in what holds it.
    """

    def exact(bodies: Any) -> Any:
        return tuple(b if b.model == "rigid" else replace(b, model="exact") for b in bodies)

    alone = Alone(
        replace(scene, shells=exact(scene.shells), beams=exact(scene.beams), redundant="drop"), comm
    )
    given = alone.zeros()
    for name, values in parts.items():
        dofs = alone.bodies[name].mixed.dofs
        for part in dofs.keys() & values.keys():
            given[name][dofs[part]] = values[part]
    force = alone.elastic({name: given[name] for name in parts})
    # it does no work on what moves freely
    linear = _solved(alone, alone.K, force, STATIC * alone.scale)
    for share in SHARES:
        # what forces along the body do has opposite signs in both, and a caution of its own
        moved = [_moved(alone, sign * share * force, sign * share * linear) for sign in (1, -1)]
        if moved[0] is not None and moved[1] is not None:
            return float(2 * share * force.dot(linear) / force.dot(moved[0] - moved[1])) - 1
    return 0.0


def _moved(alone: Alone, force: PETSc.Vec, linear: PETSc.Vec) -> PETSc.Vec | None:
    """What exact bodies do under a force; None without convergence.

    Args:
        alone: The scene.
        force: The force.
        linear: What it does to small displacements.
    """
    energy, inertia = (float(alone.gram(A, [linear])[0, 0]) for A in (alone.K, alone.M))
    omega2 = SLOW * energy / inertia if inertia > 0 else 0.0
    moved, part = linear.copy(), force.duplicate()
    for _ in range(ITERATIONS):
        half, K = alone.tangent_at(0.5 * moved), alone.tangent_at(moved)
        left = force.copy()
        # forces by stiffness along the way, exact for polynomials of the third degree
        for A, weight, along in (
            (alone.K, 1 / 6, moved),
            (half, 2 / 3, moved),
            (K, 1 / 6, moved),
            (alone.M, omega2, moved - linear),
        ):
            A.mult(along, part)
            left.axpy(-weight, part)
        change = _solved(alone, K, left, omega2)
        moved += change
        if abs(change.dot(left)) < CONVERGED * energy:
            return moved
    return None


def _solved(alone: Alone, K: PETSc.Mat, force: PETSc.Vec, omega2: float) -> PETSc.Vec:
    """What a force does to a stiffness and the mass at a square of a rate."""
    A, found = K.copy(), K.createVecRight()
    A.axpy(omega2, alone.M)
    alone.solver(A).solve(force, found)
    return found
