"""Modes over the rate of rotation, and which belong together: what a Campbell diagram shows."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
from scipy.optimize import linear_sum_assignment

from shellmb.arrays import Complex, Floats, Ints, reals_or_nan
from shellmb.errors import SceneError, petsc_in_words
from shellmb.native.assembler import assembled_as
from shellmb.running.natural_modes.vibration import check_count
from shellmb.running.rotating.axis import Axis, check_steady, find_axis
from shellmb.running.rotating.linearised import SteadyRotation
from shellmb.running.rotating.modes import SPARE, RotatingModes, modes_of
from shellmb.running.rotating.quadratic import Pair, product
from shellmb.scene import Scene
from shellmb.scene.values.validate import show

# modes whose frequencies differ by less, relatively or of the largest one, may be mixed at will
EQUAL, NONE = 1e-4, 1e-6
# shapes with less in common than this are different modes; of a double eigenvalue that splits into
# a forward and a backward wave each has one half in common with both
SAME = 0.3

# an axis where nothing turns
UPWARD = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Campbell:
    """Modes of a scene that turns steadily, at several rates.

    Args:
        axis: The axis.
        rates: Rates of rotation, ascending, rad/s.
        modes: The modes at each rate.
        branches: Number of the mode at each rate, from 0, on each branch; -1 where it has none,
            shape (rates, branches).
    """

    axis: Axis
    rates: Floats
    modes: tuple[RotatingModes, ...]
    branches: Ints

    def along(self, values: str) -> Complex:
        """An array of the modes at each rate along the branches, NaN where one has no mode.

        Args:
            values: Name of an array of `RotatingModes`, as "omega", "damping", "values".

        Returns:
            Shape (rates, branches).
        """
        rows = [
            np.where(places >= 0, np.asarray(getattr(modes, values))[places], np.nan)
            for modes, places in zip(self.modes, self.branches, strict=True)
        ]
        return np.array(rows)

    @property
    def frequencies(self) -> Floats:
        """Damped frequencies along the branches, Hz, NaN where there is none."""
        return np.asarray(self.along("frequencies"))

    @property
    def unstable(self) -> tuple[tuple[float, int, complex], ...]:
        """Rate, number of the mode from 1, and eigenvalue of all unstable modes."""
        return tuple(
            (float(modes.rate), k, complex(modes.values[k - 1]))
            for modes in self.modes
            for k in modes.unstable
        )

    @property
    def verdict(self) -> str:
        """Say whether the rotation is stable, where that is not decided, and what is unreliable."""
        return "; ".join([self._stability + self._undecided, *self.warnings])

    @property
    def warnings(self) -> list[str]:
        """Warnings about unreliable results, each once."""
        return list(dict.fromkeys(said for modes in self.modes for said in modes.doubtful))

    @property
    def _undecided(self) -> str:
        """The rates where more eigenvalues than elsewhere are taken for zero."""
        # at rest a free system has more of them, which rotation holds
        rotating = [modes for modes in self.modes if modes.rate > 0]
        least = min((modes.rigid for modes in rotating), default=0)
        near = [modes for modes in rotating if modes.rigid > least]
        if not near:
            return ""
        at = ", ".join(f"{modes.rate:g}" for modes in near)
        bound = max(modes.neutral for modes in near)
        return (
            f"; at {at} rad/s more eigenvalues than at other rates are below {bound:.3g}/s and "
            "count as zero: a critical speed is near, where it is undecided whether they grow"
        )

    @property
    def _stability(self) -> str:
        if not self.unstable:
            return "no mode grows at any rate"
        rate, mode, value = self.unstable[0]
        kind = "divergence" if value.imag == 0 else "flutter"
        return (
            f"unstable at {rate:g} rad/s: mode {mode} grows by {value.real:.4g}/s ({kind}); "
            f"{len({r for r, _, _ in self.unstable})} of {len(self.rates)} rates are unstable"
        )


def assurance(first: Sequence[Pair], second: Sequence[Pair], mass: PETSc.Mat) -> Floats:
    """Modal assurance criterion `|v^H M w|^2/((v^H M v)(w^H M w))` of all pairs of modes.

    Where `w` turns in the opposite sense the larger one of `w` and its conjugate counts: a backward
    wave whose frequency passes zero is listed as a forward one.

    Args:
        first: Modes at one rate.
        second: Modes at another.
        mass: Mass matrix.

    Returns:
        Shape (first, second), from 0 to 1.
    """
    own, other = (np.array([product(mass, p, p).real for p in of]) for of in (first, second))
    v = np.array([p.real.array_r + 1j * p.imaginary.array_r for p in first])
    images = [((mass * p.real).array_r, (mass * p.imaginary).array_r) for p in second]
    y = np.array([real + 1j * imaginary for real, imaginary in images])
    both = mass.getComm().tompi4py().allreduce(np.array([v.conj() @ y.T, v @ y.T]))
    return np.asarray(np.abs(both).max(axis=0) ** 2 / np.outer(own, other))


def _mixed(alike: Floats, first: Floats, second: Floats) -> Floats:
    """Share of one group of equal frequencies in another, for all modes of both, from 0 to 1.

    Any mixture of modes with equal frequencies is a mode: each alone may have little in common with
    each of the same modes at the next rate.

    Args:
        alike: What single modes have in common, shape (first, second).
        first: Frequencies at one rate.
        second: Frequencies at another.
    """
    own, other = (_equal(omega) for omega in (first, second))
    sizes = np.minimum(own.sum(axis=1)[:, None], other.sum(axis=1)[None])
    return np.asarray(np.minimum(own @ alike @ other / sizes, 1.0))


def _equal(omega: Floats) -> Floats:
    """Pairs of equal frequencies: 1, of others 0, shape (n, n)."""
    size = np.abs(omega)
    gaps = np.abs(omega[:, None] - omega[None])
    bound = EQUAL * np.minimum(size[:, None], size[None]) + NONE * size.max(initial=0.0)
    return np.asarray(gaps <= bound, dtype=float)


def track(found: Sequence[RotatingModes], mass: PETSc.Mat) -> Ints:
    """Branches through modes at ascending rates.

    Args:
        found: Modes at each rate.
        mass: Mass matrix.

    Returns:
        Number of the mode from 0, or -1 where the branch has none, shape (rates, branches).
    """
    branches: list[list[int]] = [[k] for k in range(len(found[0].values))]
    for step, (before, after) in enumerate(pairwise(found), start=1):
        alike = assurance(before.pairs, after.pairs, mass)
        same = _mixed(alike, before.omega, after.omega)
        # of shapes that are equally like the nearest frequency decides
        gaps = np.abs(before.omega[:, None] - after.omega[None])
        cost = same + 1e-2 * alike - 1e-3 * gaps / max(float(gaps.max()), 1e-300)
        rows, columns = linear_sum_assignment(-cost)
        follows = {int(r): int(c) for r, c in zip(rows, columns, strict=True) if same[r, c] > SAME}
        for branch in branches:
            branch.append(follows.get(branch[-1], -1))
        new = set(range(len(after.values))) - set(follows.values())
        branches += [[-1] * step + [k] for k in sorted(new)]
    return np.array(branches).T


@petsc_in_words()
@assembled_as(lambda scene, *_, **__: scene.solver)
def campbell(
    scene: Scene,
    rates: Sequence[float],
    comm: MPI.Comm = MPI.COMM_WORLD,
    count: int = 6,
    loaded: bool = False,
    axis: Sequence[float] | None = None,
    about: Sequence[float] | None = None,
) -> Campbell:
    """Modes of a scene that turns about an axis at given rates.

    Args:
        scene: The scene; its scheme and initial velocities do not matter.
        rates: Rates, ascending, rad/s.
        comm: Communicator.
        count: Number of modes at each rate.
        loaded: Whether the loads act.
        axis: Direction of the axis; None: that about which the scene turns.
        about: A point of it, m.

    Raises:
        SceneError: If rates or count make no sense, or something does not turn along.
        ConvergenceError: If there is no relative equilibrium, or the modes do not converge.
    """
    check_count(count)
    given = _checked(rates)
    # at rest nothing has to turn along, and there need be no axis
    turns = given[-1] > 0
    line = find_axis(scene, axis, about) if turns or axis is not None else Axis(UPWARD)
    if turns:
        check_steady(scene, line, loaded)
    rotating = SteadyRotation(scene, line, comm, loaded)
    found = []
    for rate in given:
        rotating.go(rate)
        found.append(modes_of(rotating, count, SPARE))
    branches = track(found, rotating.mass)
    # those that the wanted modes are on, at whatever rate
    wanted = ((branches >= 0) & (branches < count)).any(axis=0)
    return Campbell(rotating.axis, np.array(given), tuple(found), branches[:, wanted])


def _checked(rates: Sequence[float]) -> list[float]:
    given = reals_or_nan(rates)
    rising = given.ndim == 1 and len(given) and given[0] >= 0 and np.all(np.diff(given) > 0)
    if not rising or not np.all(np.isfinite(given)):
        raise SceneError(
            f"modes: rates are {show(rates)}; they must be one or more numbers in rad/s, from 0 "
            "on, each larger than the one before"
        )
    return given.tolist()
