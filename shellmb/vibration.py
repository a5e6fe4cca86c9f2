"""Natural frequencies and modes about the reference or a loaded state (SLEPc, shift and invert)."""

from dataclasses import dataclass

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import numpy.typing as npt

from shellmb.arrays import Floats
from shellmb.checked_model import checked_model
from shellmb.errors import ConvergenceError, SceneError, petsc_in_words
from shellmb.modal.tangent import Blocks, bending_scales, tangent
from shellmb.model.model import Model
from shellmb.observers.fields.modal import ModalNodes, modal_members
from shellmb.scene import Scene
from shellmb.scene.loads.loads import Gravity
from shellmb.simulate.simulation import Simulation
from shellmb.simulate.stability import Stability
from shellmb.system.assembly.blocks import BlockSystem
from shellmb.system.direct.symmetry import is_symmetric
from shellmb.system.eigenvalues import eigenpairs, quotients

# a mode below this fraction of the first elastic eigenvalue is a rigid-body motion
RIGID = 1e-5

# the shift lies this many times D/(m L^4) below zero: near the lowest modes, and never on one
SHIFT = 10.0

# Eigenvalues below this fraction of the shift are zero, where all modes are rigid, and so are those
# below this many times what round-off of the stiffness can make (six free plates and beams: 0.95 of
# it at most). Where the matrix is not symmetric, that is known to less
ZERO, ROUND_OFF, NEUTRAL = 1e-10, 10.0, 1e-6

# imaginary parts beyond this of the square are no round-off: where loads follow the bodies, both
# planes of a square column have the same square, which round-off splits by 1e-12
COMPLEX = 1e-6

# Where no count tells of what diverges, it is looked for at lower and lower shifts, down to so many
# times the first one and the lowest that is found, a few at each; two squares that are as near as
# the last number are one
FARTHEST, FARTHER, AT_ONCE, SAME = 1e4, 20.0, 4, 1e-6


@dataclass(frozen=True)
class Modes:
    """Natural modes, lowest first.

    Args:
        omega2: Squares of the angular frequencies, rad^2/s^2; negative ones are unstable. Of
            complex ones, which come in pairs where loads follow the bodies, the real parts.
        shapes: For each mode, by the body's name in the system, the displacement of a shell or a
            beam at this rank's nodes, shape (n, 3), and of the rigid bodies of this rank the
            displacement of the centre and the changes of the three directors, shape (n, 12).
        model: The model, with the nodes' positions.
        unknowns: Number of unknowns of the eigenproblem.
        rigid: Number of rigid-body modes, which are the first ones.
        imaginary: Imaginary parts of the squares, zero where these are real.
        unstable: Number of directions in which the state is unstable; None where it is not known.
    """

    omega2: Floats
    shapes: list[dict[str, Floats]]
    model: Model
    unknowns: int
    rigid: int
    imaginary: Floats
    unstable: int | None

    @property
    def omega(self) -> Floats:
        """Angular frequencies, rad/s; a mode that grows without swinging has a negative one."""
        root = np.sqrt(self.omega2 + 1j * self.imaginary)
        return np.where(self.imaginary == 0.0, np.sign(self.omega2) * np.abs(root), root.real)

    @property
    def growth(self) -> Floats:
        """Rates at which modes grow, `exp(growth t)`, 1/s; zero of those that do not."""
        root = np.sqrt(self.omega2 + 1j * self.imaginary)
        grows = np.arange(len(root)) >= self.rigid
        return np.where(grows, np.abs(root.imag), 0.0)

    @property
    def warnings(self) -> list[str]:
        """What says that the state is unstable."""
        said, growth = [], self.growth
        places = np.flatnonzero(growth > 0)
        if len(places):
            k = int(places[np.argmax(growth[places])])
            numbers = ", ".join(str(n + 1) for n in places)
            which = f"mode {numbers} grows" if len(places) == 1 else f"modes {numbers} grow"
            kind = "divergence" if self.imaginary[k] == 0.0 else "flutter"
            said.append(
                f"the state is unstable: {which}, the fastest by {growth[k]:.4g}/s (mode {k + 1}, "
                f"{kind})"
            )
        if self.unstable is not None and self.unstable > len(places):
            said.append(
                f"the state is unstable in {self.unstable} directions, {len(places)} of which are "
                "among the modes; ask for more modes"
            )
        return said

    @property
    def frequencies(self) -> Floats:
        """Frequencies, Hz; a mode that grows without swinging has a negative one."""
        return self.omega / (2 * np.pi)


@petsc_in_words()
def natural_modes(
    scene: Scene, comm: MPI.Comm = MPI.COMM_WORLD, count: int = 6, loaded: bool = False
) -> Modes:
    """Natural modes of a scene.

    Args:
        scene: The scene; its scheme does not matter.
        comm: Communicator.
        count: Number of modes wanted, rigid-body modes included.
        loaded: Whether the modes are those of the static equilibrium under the scene's loads.

    Raises:
        SceneError: If a body has no mass, `count` is not positive, or constraints contradict one
            another.
        ConvergenceError: If the static state or the eigenproblem does not converge, or there are
            fewer modes than wanted.
    """
    if count < 1:
        raise SceneError(f"modes: count is {count}; it must be at least 1")
    moving = scene.with_options(scheme="ep", dt=scene.dt or 1.0, t_end=scene.t_end or 1.0)
    state = Simulation(scene.with_options(scheme="static"), comm) if loaded else None
    # forces of joints and supports are those of the equilibrium, in its unit
    model, _ = checked_model(moving, comm, None if state is None else state.model.force)
    if state is not None:
        state.run()
    system, stiffness, mass = _tangent_at(model, state)
    K = system.symmetric_matrix(stiffness, 1.0)
    M = system.symmetric_matrix(mass, 0.0)
    symmetric = is_symmetric(K)
    shift = shift_below(model, loaded)
    values, vectors = eigenpairs(K, M, count, shift, symmetric)
    unstable = _unstable(model, system, K, M, RIGID * abs(shift)) if symmetric else None
    missing = (unstable or 0) - int(np.sum(values.real < -RIGID * abs(shift)))
    if missing > 0:
        # far beyond a critical load the lowest ones are not those next to the shift
        values, vectors = eigenpairs(K, M, count + missing, shift, symmetric)
    if not symmetric:
        # nothing counts them there
        values, vectors = _with_far_ones(K, M, values, vectors, shift)
    values.imag *= np.abs(values.imag) > COMPLEX * np.abs(values)
    zero = np.full(len(values), NEUTRAL * abs(shift))
    if symmetric:
        quotient, round_off = quotients(K, M, vectors)
        values, zero = (
            quotient.astype(np.complex128),
            np.maximum(ZERO * abs(shift), ROUND_OFF * round_off),
        )
    elastic = float(np.max(np.abs(values)))
    # rigid modes are told from the elastic ones by the largest gap, not by the highest mode asked
    # for
    positive = np.sort(np.abs(values))
    scale = next((v for v in positive if v > 1e-8 * elastic), elastic)
    still = np.abs(values) < np.maximum(RIGID * scale, zero)
    order = np.lexsort((values.real, ~still))[:count]
    shapes = [mode_shape(system, model, vectors[k]) for k in order]
    return Modes(
        values[order].real,
        shapes,
        model,
        system.size,
        int(np.sum(still[order])),
        values[order].imag,
        unstable,
    )


def _with_far_ones(
    K: PETSc.Mat,
    M: PETSc.Mat,
    values: npt.NDArray[np.complex128],
    vectors: list[PETSc.Vec],
    shift: float,
) -> tuple[npt.NDArray[np.complex128], list[PETSc.Vec]]:
    """Add pairs that diverge far beyond the shift, next to lower and lower ones.

    What diverges is nearer to a shift that is twice as low than all that swings.
    """
    target, few = shift, min(len(values), AT_ONCE)
    while target > FARTHEST * shift or target > FARTHER * np.min(values.real):
        target = 10.0 * target
        try:
            found, there = eigenpairs(K, M, few, target, False)
        except ConvergenceError:
            # of few unknowns multipliers are all that is there
            break
        # of double ones, as of a square column, both
        known, lowest = values, float(np.min(values.real))
        for value, vector, own in zip(found, there, quotients(K, M, there)[0], strict=True):
            new = np.min(np.abs(known - value)) > SAME * abs(value)
            # of multipliers the quotient is another number
            diverges = value.imag == 0.0 and abs(own - value.real) < SAME * abs(value)
            if diverges and new and value.real < -RIGID * abs(shift):
                values, vectors = np.append(values, value), [*vectors, vector]
        if np.min(values.real) < lowest:
            # go on from there
            target = max(target, float(np.min(values.real)) / 5.0)
    return values, vectors


def _unstable(
    model: Model, system: BlockSystem, K: PETSc.Mat, M: PETSc.Mat, above: float
) -> int | None:
    """Number of squares below `-above`, which leaves out those that are zero up to round-off."""
    shifted = K.copy()
    shifted.axpy(above, M)
    return Stability(model, system, lambda: shifted).look().unstable


def _tangent_at(model: Model, state: Simulation | None) -> tuple[BlockSystem, Blocks, Blocks]:
    """Stiffness and mass at the end of a static simulation, or at the reference."""
    if state is None:
        return tangent(model)
    end, t = state.problem.start_factor, state.t
    return tangent(model, state.arrays(), lambda function: end(t, function))


def shift_below(model: Model, loaded: bool) -> float:
    """A negative shift of the size of the lowest eigenvalues, rad^2/s^2."""
    found = bending_scales(model)
    found += [float(np.min(data.omega2)) / SHIFT for data in model.modal]
    if not found:
        # rigid bodies swing by their weight, or by springs of whatever stiffness
        weights = [w for w in model.scene.loads if loaded and isinstance(w, Gravity)]
        found = [float(np.linalg.norm(w.acceleration)) / model.length for w in weights] or [1.0]
    return -SHIFT * min(found)


Shape = dict[str, Floats]


def mode_shape(system: BlockSystem, model: Model, vector: PETSc.Vec) -> Shape:
    """The mode, its largest displacement one unit of length."""
    (shape,) = scaled(model, nodal_shape(system, model, vector))
    return shape


def nodal_shape(system: BlockSystem, model: Model, vector: PETSc.Vec) -> Shape:
    """Values of a mode at the nodes of this rank, as of `Modes`, of whatever size."""
    values = system.local_values(vector)
    shapes = {}
    part_of = {f.name: values[system.numbering.slice(k)] for k, f in enumerate(system.fields)}
    for k, field in enumerate(system.fields):
        part = values[system.numbering.slice(k)]
        if field.name in model.meshed:
            shapes[field.name] = part[model.meshed[field.name].mixed.dofs["u"]].reshape(-1, 3)
        elif model.rigid is not None and field.name == model.rigid.name:
            dofs = model.rigid.mixed.dofs
            rows = [part[dofs["u"]].reshape(-1, 3), part[dofs["w"]].reshape(-1, 9)]
            shapes[field.name] = np.concatenate(rows, axis=1)
    for name in modal_members(model):
        state = ModalNodes(model, name)
        frame, eta = (part_of[n] for n in (state.state.rigid, state.state.modes.name))
        shapes[name] = state.shape(*state.state.read(frame, eta))
    return shapes


def scaled(model: Model, *shapes: Shape) -> tuple[Shape, ...]:
    """Shapes that belong together, the largest displacement in them one unit of length."""
    # of rigid bodies that turn about their centres, the directors times the length of the scene
    sizes = (_size(part, model.length) for shape in shapes for part in shape.values())
    largest = model.comm.allreduce(max(sizes, default=0.0), op=MPI.MAX)
    return tuple({name: part / largest for name, part in shape.items()} for shape in shapes)


def _size(shape: Floats, length: float) -> float:
    turned = float(np.max(np.abs(shape[:, 3:]), initial=0.0))
    return max(float(np.max(np.abs(shape[:, :3]), initial=0.0)), length * turned)
