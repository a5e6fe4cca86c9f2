"""Linear buckling: load factors at which the stiffness of a linear solution becomes singular.

The stiffness is `K + lambda G`: that of the reference, and the geometric stiffness of the
resultants and constraint forces of the linear static solution, with the load stiffness of forces
that follow. Displacements before buckling do not count, as in the classical theory.
"""

from typing import NamedTuple

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import SceneError, TooFewModesError, UnheldError
from shellmb.model.model import Model
from shellmb.preprocessing.bodyfields import kinematic_dofs
from shellmb.preprocessing.checked_model import checked_model
from shellmb.preprocessing.modal.tangent import tangent
from shellmb.scene import Scene
from shellmb.scene.lookup import small_strains
from shellmb.simulate.simulation import Simulation
from shellmb.system.assembly.blocks import BlockSystem
from shellmb.system.eigenvalues import nearest_to_zero

# imaginary parts beyond this of a factor are no round-off
COMPLEX = 1e-6
# so many more numbers are looked for where too few of them are positive, so many times
MORE, TRIES = 2, 4
# times the smallest number: larger ones are infinite, and known by round-off
INFINITE = 1e8


class BucklingFactors(NamedTuple):
    """Load factors of linear buckling.

    Args:
        factors: The lowest positive factors, ascending.
        negative: The negative factor nearest to zero; None if none was found: the load would have
            to act in the opposite direction.
        vectors: Vector of each positive factor, all unknowns of the system.
        energies: Strain energies of the vectors, of whatever size these are.
        system: The block system.
        model: The model.
    """

    factors: Floats
    negative: float | None
    vectors: list[PETSc.Vec]
    energies: list[float]
    system: BlockSystem
    model: Model


def linear_buckling(scene: Scene, comm: MPI.Comm, count: int) -> BucklingFactors:
    """Find the lowest load factors at which a scene buckles; collective.

    Args:
        scene: The scene with its loads; its scheme does not matter.
        comm: Communicator.
        count: Number of factors.

    Raises:
        SceneError: If the scene has no load, cannot be solved with small displacements, or has
            bodies that forces do not soften.
        ConvergenceError: If there are fewer factors.
    """
    if count < 1:
        raise SceneError(f"buckling: count is {count}; it must be at least 1")
    try:
        still = scene.with_options(scheme="linear-statics")
    except SceneError as error:
        # nobody has chosen the scheme that this names
        raise SceneError(
            "buckling: factors multiply a linear static solution, which this scene cannot have; "
            f"follow its path instead, path=PathFollowing() ({error})"
        ) from None
    if not scene.loads and not any(body.natural for body in scene.meshed):
        raise SceneError("buckling: the scene has no load; it must have the one that is multiplied")
    for body in scene.meshed:
        if what := small_strains(body):
            raise SceneError(
                f"buckling: {what}, which forces do not soften; its model must be 'exact'"
            )
    for own in scene.own_bodies:
        if own.has_strains:
            raise SceneError(
                f"buckling: own body '{own.name}' has strains of its own, of whose forces there is "
                "no stiffness here; follow its path instead, path=PathFollowing()"
            )
    try:
        state = Simulation(still, comm)
    except UnheldError as error:
        # a load may hold them, and has none of its stiffness in a linear solution
        motions = str(error).removeprefix("statics: ").partition("; add ")[0]
        raise UnheldError(
            f"buckling: factors multiply a linear solution, where {motions}; hold them by "
            "supports, by joints that leave less free (Universal, not Spherical), or by springs so "
            "weak that they do not change the factors"
        ) from None
    model, _ = checked_model(still, comm, state.model.force)
    state.run()
    # resultants and multipliers, in the reference configuration
    arrays = state.arrays()
    for each in model.bodies:
        arrays[f"{each.name}/q"][kinematic_dofs(each)] = 0.0
    end, t = state.problem.start_factor, state.t
    system, stiffness, _ = tangent(model)
    K = system.symmetric_matrix(stiffness, 1.0)
    loaded, at_load, _ = tangent(model, arrays, lambda function: end(t, function))
    G = loaded.symmetric_matrix(at_load, 1.0)
    G.axpy(-1.0, K, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
    if not G.norm() > 0:
        raise SceneError("buckling: the loads strain nothing; give loads that do")
    wanted = count
    for _ in range(TRIES):
        wanted = min(MORE * wanted, system.size)
        values, vectors = nearest_to_zero(K, G, wanted)
        sizes = np.abs(values)
        real = (np.abs(values.imag) <= COMPLEX * sizes) & (sizes < INFINITE * sizes.min())
        positive = [k for k in range(len(values)) if real[k] and values[k].real > 0]
        if len(positive) >= count:
            break
    else:
        raise TooFewModesError(
            f"buckling: {len(positive)} of {count} positive load factors were found among "
            f"{len(values)}; ask for fewer, or turn the load round",
            there=len(positive),
        )
    order = sorted(positive, key=lambda k: values[k].real)[:count]
    negative = [float(v.real) for v, r in zip(values, real, strict=True) if r and v.real < 0]
    return BucklingFactors(
        np.array([values[k].real for k in order]),
        max(negative, default=None),
        [vectors[k] for k in order],
        [float(np.real(vectors[k].dot(K * vectors[k]))) / 2 for k in order],
        system,
        model,
    )
