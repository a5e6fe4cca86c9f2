"""Modes about a steady rotation: complex eigenvalues, damping, whirl, stability, shapes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shellmb.arrays import Complex, Floats
from shellmb.diagnostics.base import Motion
from shellmb.diagnostics.modes import stiffened_modes
from shellmb.errors import TooFewModesError, petsc_in_words
from shellmb.model.model import Model
from shellmb.native.assembler import assembled_as
from shellmb.running.natural_modes.shapes import Shape, nodal_shape, parts_of, scaled
from shellmb.running.rotating.linearised import Linearised
from shellmb.running.rotating.quadratic import NEUTRAL, STILL, Pair, motions, product, turned
from shellmb.running.rotating.rigid import FreeMotions

# real parts above this part of the shift and of the eigenvalue are no round-off
UNSTABLE = 1e-5

# modes that whirl by less than this have no direction: planar ones, and those across the axis
WHIRLS = 0.05

# so many more modes than wanted are found: branches that cross the last one are not lost
SPARE = 4


@dataclass(frozen=True)
class RotatingModes:
    """Modes of a system that turns with a steady rate, seen from a frame that turns along.

    They are `exp(s t) v` with `s = -zeta omega +- i omega_d`; of each complex pair one is listed,
    by size, and of real eigenvalues all.

    Args:
        rate: Rate of rotation, rad/s.
        values: Eigenvalues, 1/s.
        whirl: How much each of them whirls about the axis, from -1 (a backward circle of all
            points) to 1 (a forward one).
        shapes: Real and imaginary part of each mode, as those of `vibration.Modes`; the real part
            is the larger one.
        model: The model, with the nodes' positions.
        unknowns: Number of unknowns of the eigenproblem.
        rigid: Number of modes with the eigenvalue zero, which are the first ones.
        threshold: Real part above which a mode is unstable, 1/s.
        neutral: Eigenvalues below this are zero where only round-off resists, 1/s.
        pairs: Eigenvalues with their vectors.
        doubtful: Warnings about bodies that forces do not stiffen, as their strains are small, and
            on modes that elements hardly resist.
    """

    rate: float
    values: Complex
    whirl: Floats
    shapes: list[tuple[Shape, Shape]]
    model: Model
    unknowns: int
    rigid: int
    threshold: float
    neutral: float
    pairs: tuple[Pair, ...]
    doubtful: tuple[str, ...]

    @property
    def omega(self) -> Floats:
        """Damped angular frequencies, rad/s."""
        return np.asarray(self.values.imag)

    @property
    def frequencies(self) -> Floats:
        """Damped frequencies, Hz."""
        return self.omega / (2 * np.pi)

    @property
    def damping(self) -> Floats:
        """Damping ratios `-Re s/|s|`; negative ones are unstable, those of rigid modes zero."""
        size = np.abs(self.values)
        some = np.arange(len(size)) >= self.rigid
        return np.where(some, -self.values.real / np.where(some, size, 1.0), 0.0) + 0.0

    @property
    def unstable(self) -> tuple[int, ...]:
        """Numbers of the unstable modes, from 1."""
        bound = np.maximum(self.threshold, UNSTABLE * np.abs(self.values))
        grows = self.values.real > bound
        return tuple(int(k) + 1 for k in np.flatnonzero(grows) if k >= self.rigid)

    @property
    def fields(self) -> list[dict[str, Shape]]:
        """Real and imaginary part of each mode, as files have them."""
        return [
            {"displacement": real, "displacement_imaginary": imaginary}
            for real, imaginary in self.shapes
        ]

    @property
    def directions(self) -> tuple[str, ...]:
        """Direction of each mode: "forward", "backward", or "" where it has none."""
        return tuple(
            ("forward" if w > 0 else "backward") if abs(w) > WHIRLS and s.imag > 0 else ""
            for w, s in zip(self.whirl, self.values, strict=True)
        )


@petsc_in_words()
@assembled_as(lambda rotating, *_, **__: rotating.model.scene.solver)
def modes_of(rotating: Linearised, count: int, spare: int = 0) -> RotatingModes:
    """Modes about the state that a system has, in the frame as it turns.

    Args:
        rotating: The system.
        count: Number of modes.
        spare: Number of more of them that are found if there are so many.

    Raises:
        ConvergenceError: If there are fewer modes, or they do not converge.
    """
    K, C, M = rotating.matrices()
    free = FreeMotions(rotating, (K, C, M))
    branches, wanted = rotating.branches(), count + spare
    neutral, grows = (STILL, STILL) if branches else (NEUTRAL, UNSTABLE)
    zero, above = motions((K, C, M), branches, wanted, rotating.shift, free.exact)
    rigid, kept = len(zero), [*zero, *above][: count + spare]
    if len(kept) < count:
        raise TooFewModesError(count=count, there=len(kept))
    pairs = tuple(_upright(pair, rotating) for pair in kept)
    whirl = [(product(rotating.transport, p, p) / product(rotating.mass, p, p)).imag for p in pairs]
    system, model = rotating.system, rotating.model
    shapes = [
        scaled(model, *(nodal_shape(system, model, v) for v in (p.real, p.imaginary)))
        for p in pairs
    ]
    return RotatingModes(
        rotating.rate,
        np.array([p.value for p in pairs]),
        np.array(whirl),
        [(a, b) for a, b in shapes],
        model,
        system.size,
        min(rigid, len(kept)),
        grows * rotating.shift,
        neutral * rotating.shift,
        pairs,
        tuple(_doubtful(rotating, pairs[:count], rigid)),
    )


def _doubtful(rotating: Linearised, pairs: Sequence[Pair], rigid: int) -> list[str]:
    """Sentences on bodies that forces do not stiffen, and that are too soft; collective."""
    modes: list[Motion] = []
    for number, pair in enumerate(pairs, start=1):
        if number > rigid:
            energy = abs(pair.value) ** 2 * product(rotating.mass, pair, pair).real / 2
            parts = tuple(parts_of(rotating.system, vector) for vector in pair[1:])
            modes.append(Motion(number, energy, parts))
    state = {name: levels.q.x.array for name, levels in rotating.levels.items()}.__getitem__
    return list(stiffened_modes(rotating.model, state, modes))


def _upright(pair: Pair, rotating: Linearised) -> Pair:
    """The pair with the phase at which the real part is as large as it can be."""
    mirrored = pair._replace(imaginary=-1.0 * pair.imaginary)
    square = product(rotating.mass, mirrored, pair)
    return turned(pair, -float(np.angle(square)) / 2)
