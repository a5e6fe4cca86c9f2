"""Limit points and bifurcations of a path, distinguished by inertia and load rate.

The number of negative eigenvalues of the stiffness matrix changes by one where one of them passes
zero. If the load turns round there, it is a limit point; if the load goes on, another path crosses
this one. Two of a kind within one step cancel in the load rate and look like one of the other; the
step control by curvature makes that rare, and nothing here proves it away.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from shellmb.arrays import Floats
from shellmb.errors import ConvergenceError
from shellmb.restart import Restartable, constant
from shellmb.scene import PathFollowing
from shellmb.simulate.eigenmodes import Stability
from shellmb.simulate.problem import Problem
from shellmb.system.newton.bordered import Bordered

# a bifurcation is located when the eigenvalue has fallen to this part of what it was; the last
# digits of its load follow by interpolation. Closer to it, round-off of the residual, over the
# eigenvalue, would keep Newton's method from converging
CLOSE = 1e-4
# where a branch comes back, the load rate has to fall to this part of what it was
NEAR = 3e-2
# solutions at most to get there, and the least part that one takes off the interval's ends
TRIALS, MARGIN = 30, 0.02
# cosine of the angle between a path and a null vector beyond which they are the same direction
PARALLEL = 0.9
# the load stands still where it changes by less than this part in a step: Newton's method knows it
# to 1e-9 to 1e-8
FLAT = 1e-7
# inverse iteration: at most so many, until the eigenvalue changes by less than this part
POWER, SETTLED = 60, 1e-8


@dataclass(frozen=True)
class PathState:
    """Properties of a state on the path.

    Args:
        t: Its arc length.
        factor: Its load factor.
        tangent: Derivative of the unknowns by the arc length, of those that this rank owns.
        rate: Derivative of the load factor.
        negative: Number of unstable directions; None if not known.
        sense: Whether the load grows (1) or falls (-1) there; where it stands still up to
            round-off, as it did before; zero of branches that have just been taken.
    """

    t: float
    factor: float
    tangent: Floats
    rate: float
    negative: int | None
    sense: int = 0

    def __post_init__(self) -> None:
        """Keep the tangent as it is."""
        constant(self.tangent)


# solves for the state at another arc length behind the start of a step
type Trial = Callable[[float], PathState]


@dataclass(frozen=True)
class PointOnPath:
    """A limit point or bifurcation.

    Args:
        kind: Which of them.
        t: Its arc length.
        load_factor: Its load factor.
        before: Number of unstable directions before it.
        after: The same behind it.
        switched: Whether the path leaves it on another branch.
    """

    kind: Literal["limit point", "bifurcation"]
    t: float
    load_factor: float
    before: int | None
    after: int | None
    switched: bool = False


class Branches(Restartable):
    """Watches a path.

    Args:
        problem: The system.
        bordered: Solves with its Jacobian.
        moving: Weights of displacements among owned unknowns.
        path: Settings of the scene.

    Attributes:
        points: What was passed so far.
        apply_inverse: What forces move the state last looked at by, of owned unknowns.
    """

    remembered = ("points",)

    def __init__(
        self, problem: Problem, bordered: Bordered, moving: Floats, path: PathFollowing
    ) -> None:
        self._bordered, self._moving, self._path = bordered, moving, path
        self.points: list[PointOnPath] = []
        # a bifurcation in the step not yet accepted, and null vector of the stiffness matrix there
        self._found: tuple[PointOnPath, Floats] | None = None
        self.apply_inverse = bordered.apply_inverse
        self._stability: Stability | None = None
        if path.branches != "ignore":
            self._stability = Stability(problem.model, problem.system)

    def negative(self) -> int | None:
        """Unstable directions of the state that the functions hold; None if not asked or known."""
        found = None if self._stability is None else self._stability.look()
        known = found is not None and found.symmetric and found.unstable is not None
        self.apply_inverse = self._bordered.apply_inverse
        if known and self._stability is not None:
            # thin bodies leave the reduced matrix with few digits
            self.apply_inverse = self._stability.apply_inverse
        return found.unstable if found is not None and known else None

    def sure(self, a: PathState, b: PathState) -> PathState:
        """The end of a step, with the count of its start where round-off may have changed it.

        Args:
            a: The start.
            b: The end, the state last looked at.
        """
        if a.negative is None or b.negative in (None, a.negative) or self._stability is None:
            return b
        value, vector = self._smallest(None)
        near = abs(value) <= self._round_off(vector)
        return replace(b, negative=a.negative) if near else b

    def passed(self, a: PathState, b: PathState) -> bool:
        """Decide whether there is a bifurcation between two states, limit points apart."""
        self._found = None
        if a.negative is None or b.negative is None:
            return False
        change = abs(b.negative - a.negative)
        return change > 1 or change != int(turned(a, b))

    def locate(self, a: PathState, b: PathState, shorter: Trial) -> None:
        """Shorten the step until it ends at the first bifurcation.

        The smallest eigenvalue is brought to zero by false position, safeguarded by bisection on
        the number of negative ones; where that number is the same at both ends, the load rate.

        Args:
            a: Its start.
            b: Its end, behind the bifurcation; its Jacobian is factorised.
            shorter: Solves for the state at another arc length behind `a`.

        Raises:
            ConvergenceError: If a state between does not converge, or the search does not end.
        """
        if a.negative == b.negative:
            self._locate_return(a, b, shorter)
            return
        low, high, before, after = 0.0, b.t - a.t, a.negative, b.negative
        value_high, vector = self._smallest(None)
        value_low: float | None = None
        reference = abs(value_high)
        seen = [(high, value_high)]
        for _ in range(TRIALS):
            share = 0.5
            if value_low is not None and value_low * value_high < 0:
                share = value_low / (value_low - value_high)
                share = min(max(share, MARGIN), 1.0 - MARGIN)
            length = low + share * (high - low)
            state = shorter(length)
            value, vector = self._smallest(vector)
            seen.append((length, value))
            if state.negative == before:
                low, value_low = length, value
            else:
                high, value_high, after = length, value, state.negative
            if abs(value) < CLOSE * reference or abs(value) <= self._round_off(vector):
                break
            reference = max(reference, abs(value))
        else:
            raise _not_located(b)
        # the line through the two nearest ones; of several eigenvalues they may be different ones
        (s, v), (s_other, v_other) = sorted(seen, key=lambda pair: abs(pair[1]))[:2]
        zero = s - v * (s_other - s) / (v_other - v) if v_other != v else s
        zero = min(max(zero, low), high)
        factor = float(state.factor + state.rate * (zero - length))
        point = PointOnPath("bifurcation", float(state.t + zero - length), factor, before, after)
        self._found = point, self._signed(self._other(state, vector))

    def _locate_return(self, a: PathState, b: PathState, shorter: Trial) -> None:
        """Locate where a branch comes back to the path that it left, and the load turns there.

        An eigenvalue touches zero without a change of sign. Arguments as of `locate`.
        """
        low, high, rate_low, rate_high = 0.0, b.t - a.t, a.rate, b.rate
        reference = max(abs(a.rate), abs(b.rate))
        state, length = b, high
        for _ in range(TRIALS):
            share = rate_low / (rate_low - rate_high)
            length = low + min(max(share, MARGIN), 1.0 - MARGIN) * (high - low)
            state = shorter(length)
            if state.rate * rate_low > 0:
                low, rate_low = length, state.rate
            else:
                high, rate_high = length, state.rate
            if abs(state.rate) < NEAR * reference:
                break
        else:
            raise _not_located(b)
        zero = low + (high - low) * rate_low / (rate_low - rate_high)
        # the load is a parabola there
        factor = float(state.factor + state.rate * (zero - length) / 2)
        t = float(state.t + zero - length)
        point = PointOnPath("bifurcation", t, factor, a.negative, b.negative)
        vector = self._smallest(None)[1]
        self._found = point, self._signed(self._other(state, vector))

    def _other(self, state: PathState, vector: Floats) -> Floats:
        """Direction of the path that crosses at a bifurcation: along the null vector.

        Where a branch comes back to the path that it left, its own tangent is the null vector, and
        the other path goes where the load moves the rest.
        """
        size = self.size_of(state.tangent)
        share = self._bordered.dot(self._moving * vector, state.tangent) / size
        if abs(share) < PARALLEL:
            return vector
        rest = state.tangent - share * size * vector
        return np.asarray(rest / self.size_of(rest))

    def _smallest(self, guess: Floats | None) -> tuple[float, Floats]:
        """Eigenvalue next to zero of the stiffness, with the metric of displacements, and vector.

        Inverse iteration with the stiffness matrix of the state last looked at.
        """
        n = self._bordered.system.numbering
        if guess is None:
            # the same on any number of ranks, and with a part in every direction
            every = np.random.default_rng(0).uniform(-1.0, 1.0, self._bordered.system.size)
            guess = every[n.start : n.start + n.owned]
        vector, last = guess / self.size_of(guess), np.inf
        for _ in range(POWER):
            new = self.apply_inverse(self._moving * vector)
            inverse, size = self._bordered.dot(self._moving * vector, new), self.size_of(new)
            if size == 0:
                # all that moves is prescribed
                return np.inf, new
            vector = new / size
            if abs(inverse - last) <= SETTLED * abs(inverse):
                break
            last = inverse
        return 1.0 / inverse, vector

    def _round_off(self, vector: Floats) -> float:
        """Size of an eigenvalue with a vector of `_smallest` that is round-off."""
        return 0.0 if self._stability is None else self._stability.round_off(vector)

    @property
    def found(self) -> PointOnPath | None:
        """The bifurcation at the end of the step not yet accepted, if there is one."""
        return None if self._found is None else self._found[0]

    def null_vector(self) -> Floats:
        """Eigenvector next to zero of the state last looked at, of unit displacement."""
        return self._smallest(None)[1]

    def size_of(self, vector: Floats) -> float:
        """Size of a change of the unknowns: its displacements, root mean square over nodes, m."""
        return float(np.sqrt(self._bordered.dot(self._moving * vector, vector)))

    def _signed(self, vector: Floats) -> Floats:
        """The vector with its largest displacement on the side that the scene asks for."""
        shown = np.where(self._moving > 0, vector, 0.0)
        k = int(np.argmax(np.abs(shown))) if len(shown) else 0
        mine = (float(abs(shown[k])), float(shown[k])) if len(shown) else (0.0, 0.0)
        # equal ones, by symmetry, in the order of ranks
        value = max(self._bordered.system.comm.allgather(mine), key=lambda pair: pair[0])[1]
        return np.asarray(vector * (self._path.side if value >= 0 else -self._path.side))

    def accept(
        self, a: PathState, b: PathState, limit: float | None = None
    ) -> tuple[PathState, Floats | None]:
        """Take down what the accepted step passed.

        Args:
            a: Its start.
            b: Its end.
            limit: Load factor of a limit point between; None: the cubic between them tells it.

        Returns:
            The end, and the direction of the branch that the path takes from there, if it does.
        """
        found, self._found = self._found, None
        if found is None:
            if turned(a, b):
                point = limit_point(a, b)
                known = point.load_factor if limit is None else limit
                self.points.append(replace(point, load_factor=known))
            return b, None
        point, direction = found
        switches = sum(p.switched for p in self.points)
        if self._path.branches == "switch" and switches < self._path.switches:
            self.points.append(replace(point, switched=True))
            return b, direction
        self.points.append(point)
        # counted as behind it, wherever the search ended: it must not be found again
        return replace(b, negative=point.after), None

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take up the points so far."""
        self.points[:] = [PointOnPath(**p) for p in state["points"]]


def _not_located(b: PathState) -> ConvergenceError:
    return ConvergenceError(
        f"the bifurcation near the load factor {b.factor:g} could not be located; try smaller "
        "steps, or branches='ignore'"
    )


def turned(a: PathState, b: PathState) -> bool:
    """Decide whether the load reverses between two states; where it stands still nobody knows."""
    return a.sense * b.sense < 0


def sense(factor: float, rate: float, dt: float, before: int) -> int:
    """Decide whether the load grows or falls, as of `PathState`.

    Args:
        factor: Load factor of the state.
        rate: Its derivative by the arc length.
        dt: Arc length of the step that leads there.
        before: The sense before that step.
    """
    return before if abs(rate) * dt <= FLAT * abs(factor) else int(np.sign(rate))


def limit_point(a: PathState, b: PathState) -> PointOnPath:
    """The limit point between two states, by the cubic that has their values and rates."""
    cubic = load_cubic(a, b)
    inside = roots(np.polyder(cubic))
    s = inside[0] if inside else a.rate / (a.rate - b.rate)
    t = float(a.t + s * (b.t - a.t))
    factor = float(np.polyval(cubic, s))
    return PointOnPath("limit point", t, factor, a.negative, b.negative)


def load_cubic(a: PathState, b: PathState) -> Floats:
    """The load factor between two states as a cubic of the part of the step, highest power first.

    It has their load factors and rates.
    """
    h = b.t - a.t
    return cubic((a.factor, b.factor), (h * a.rate, h * b.rate))


def cubic(values: tuple[Any, Any], slopes: tuple[Any, Any]) -> Floats:
    """Cubic of the part of the distance between two ends, highest power first.

    Args:
        values: Its values at the ends, numbers or arrays.
        slopes: Its derivatives there, by the part of the way.
    """
    (first, last), (begin, end) = values, slopes
    rise = last - first
    return np.array([begin + end - 2 * rise, 3 * rise - 2 * begin - end, begin, first])


def roots(polynomial: npt.ArrayLike) -> list[float]:
    """Real roots of a polynomial between zero and one, in their order."""
    roots = np.roots(np.asarray(polynomial))
    return sorted(float(r.real) for r in roots if abs(r.imag) < 1e-9 and 0 <= r.real <= 1)
