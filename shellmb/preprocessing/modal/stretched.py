"""Stiffening of a constrained body by squares of displacements.

What bends draws its edges together, by the square of its slopes. Where these cannot follow it is
stretched instead, and stiffer; a surface that bends two ways is stretched in itself. How far edges
can follow is a matter of all that holds them: supports, joints, springs, other bodies and the mass
of these. So the whole scene is asked, with exact bodies and as it is at rest, what the forces that
bend the body so do to it, beside what they do to small displacements. Those are the forces in the
bent body, and where springs act on it what bends these with it.
"""

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from shellmb.preprocessing.modal.isolated import STATIC, IsolatedBody
from shellmb.scene import Scene

# Newton's method from the displacements of the linear body: most bodies take four iterations, and
# what does not converge is asked for less, which is stiffened less
ITERATIONS, SHARES = 12, (1.0, 0.5, 0.25, 0.125)
# work of the last correction, as a share of the energy: what is said is 1e-2 of it, or more
CONVERGED = 1e-6

# what is left of the shape, and how often it is corrected at most
BALANCED, CORRECTIONS = 1e-2, 40
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

    isolated = IsolatedBody(
        replace(scene, shells=exact(scene.shells), beams=exact(scene.beams), redundant="drop"), comm
    )
    # what is joined to the bodies moves with them
    shape = np.full(isolated.size, np.nan)
    for name, values in parts.items():
        own, dofs = shape[isolated.own[name]], isolated.bodies[name].mixed.dofs
        own[:] = 0.0
        for part in dofs.keys() & values.keys():
            own[dofs[part]] = values[part]
    # they do no work on what moves freely
    force, linear = _bending(isolated, isolated.vector(shape), parts)
    for share in SHARES:
        # what forces along the body do has opposite signs in both, and a caution of its own
        moved = [_moved(isolated, sign * share * force, sign * share * linear) for sign in (1, -1)]
        if moved[0] is not None and moved[1] is not None:
            return float(2 * share * force.dot(linear) / force.dot(moved[0] - moved[1])) - 1
    return 0.0


def _bending(
    isolated: IsolatedBody, shape: PETSc.Vec, names: Collection[str]
) -> tuple[PETSc.Vec, PETSc.Vec]:
    """Forces in balance that give bodies a shape, up to a rigid motion, and what they do; linear.

    They are elastic forces `K_b g` of the bodies with `K_b K^-1 K_b g = K_b shape`: by conjugate
    gradients, preconditioned by `K^-1`. Without springs `g` is the shape itself.

    Args:
        isolated: The scene.
        shape: Small states of bodies.
        names: Names of these.
    """
    at_rest = isolated.solver(isolated.K, isolated.M, STATIC * isolated.scale)
    elastic = isolated.stiffness_of(names)

    def solved(force: PETSc.Vec) -> PETSc.Vec:
        moved = force.duplicate()
        at_rest.solve(force, moved)
        return moved

    force = elastic * shape
    linear = solved(force)
    left = force - elastic * linear
    search = better = solved(left)
    work = left.dot(better)
    least = BALANCED**2 * force.dot(linear)
    for _ in range(CORRECTIONS):
        if work <= least:
            break
        along = elastic * search
        answer = solved(along)
        image = elastic * answer
        step = work / search.dot(image)
        force.axpy(step, along)
        linear.axpy(step, answer)
        left.axpy(-step, image)
        better, before = solved(left), work
        work = left.dot(better)
        search = better + work / before * search
    return force, linear


def _moved(isolated: IsolatedBody, force: PETSc.Vec, linear: PETSc.Vec) -> PETSc.Vec | None:
    """Solve for what exact bodies do under a force; None without convergence.

    Args:
        isolated: The scene.
        force: The force.
        linear: What it does to small displacements.
    """
    energy, inertia = (float(isolated.gram(A, [linear])[0, 0]) for A in (isolated.K, isolated.M))
    omega2 = SLOW * energy / inertia if inertia > 0 else 0.0
    moved, part, change = linear.copy(), force.duplicate(), force.duplicate()
    for _ in range(ITERATIONS):
        half, K = isolated.tangent_at(0.5 * moved), isolated.tangent_at(moved)
        left = force.copy()
        # forces by stiffness along the way, exact for polynomials of the third degree
        for A, weight, along in (
            (isolated.K, 1 / 6, moved),
            (half, 2 / 3, moved),
            (K, 1 / 6, moved),
            (isolated.M, omega2, moved - linear),
        ):
            A.mult(along, part)
            left.axpy(-weight, part)
        isolated.solver(K, isolated.M, omega2).solve(left, change)
        moved += change
        if abs(change.dot(left)) < CONVERGED * energy:
            return moved
    return None
