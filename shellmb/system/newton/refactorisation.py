"""Decisions to factorise anew: full, modified and automatic Newton, and once where all is linear.

With a Jacobian `J` of an earlier state the iteration `x <- x - J^-1 r(x)` converges to the same
solution, linearly, each update being `rho` times the one before. It is continued as long as that
costs less than a new factorisation. Of plates every other `rho` is 0.1 and those between are 0.001,
as errors of forces become errors of positions and those forces again: two updates in a row tell.
"""

import math
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field

from shellmb.system.direct.solver import Purpose

# iterations that a new factorisation needs, where convergence is quadratic
AFRESH = 3.0
# iterations that any solution takes
LEAST = 2.0
# contraction beyond which an old factorisation is not worth another iteration
SLOW = 0.5
# cost of a factorisation beyond which it does not keep an iteration from one: small systems whose
# forces jump took up to 28 of the 30 iterations that a solution may take, 16 with this, as quickly
PATIENCE = 12.0
# motion in one update, relative to the size of bodies, after which the Jacobian is another one: in
# motion and in statics. With the second one large steps of chains, balls and tapes take up to twice
# the factors; with the first one load steps of a vault fail
FAR, STATIC_FAR = 0.1, 0.02
# choices between two ways to begin a solution before the other one is tried: twice as many after
# each trial that does not pay, up to so many
RESTS = 32
# price of a solution with a new factorisation, relative to one that begins with an old one, up to
# which it is the better one: of large systems both have their factorisation, and little else
CHEAPER = 0.9
# error left behind relative to the tolerance for updates, were the next contraction as the last
# one: with a new factorisation each time the error is of the square of the last update, and this is
# to be as good. Where contractions alternate the next update may be a hundred times that (plates
# after 200 steps are within 1e-12 of full Newton's); an estimate that knows it ends after as many
# iterations, but of the other kind, which leave three times (EP, 6x2) the error in the energy
ERROR = 1e-6
# size of updates relative to the tolerance up to which those that round-off makes are remembered,
# and those that are as small, but for so much, taken for the last ones of a solution
FLOOR, ALIKE = 1e-3, 2.0

# what the second update of a linear system may be of the first, for one to be enough: of a thin
# plate it is 1e-6 in statics, and 1e-11 where inertia counts
LEFT = 1e-9

# what the system is before anything is factorised: no key is equal to it
NOTHING: Hashable = object()


class Refresh:
    """Decides when to factorise, and when an iteration has converged: here in each iteration.

    Attributes:
        purpose: What factorisations are for: those of one exact solution are not kept.
        lasts: Whether the one made before the first solution is used in it.
        exact: Whether one update is known to be the solution.
    """

    purpose = Purpose.ONE
    lasts = False
    exact = False

    def begin(self, key: Hashable) -> None:
        """A new solution; another `key` than before means that the system is another one."""

    def forget(self) -> None:
        """The factorisation is of no use any more."""

    def wanted(self) -> bool:
        """Decide whether to factorise before the next update."""
        return True

    def factorised(self, cost: float) -> None:
        """The Jacobian of the current state was factorised.

        Args:
            cost: What that costs, in iterations with an old factorisation.
        """

    def converged(self, update: float, moved: float, weighted: float, tolerance: float) -> bool:
        """Record an update; whether the iteration may end: convergence is quadratic.

        Args:
            update: Its size, relative to those of the parts.
            moved: How far it moved bodies, relative to their sizes.
            weighted: Its size if parts count by their weights.
            tolerance: Size at which the iteration ends where convergence is quadratic.
        """
        return update <= tolerance

    def settled(self) -> None:
        """The iteration ends for another reason: its updates are round-off."""


@dataclass
class _Beginning:
    """Choice between the factorisation of the solution before and a new one, by what both cost.

    Short steps of small systems need a factorisation each. If it is the one that was made for the
    step before, two more updates find that out: steps of 1 ms of three links (EP) take 2.3
    iterations by this choice, and 4.0 if each tries the old one first.
    """

    # prices of the last solutions of both kinds, in iterations; of what is unknown, the best
    _new: float = math.inf
    _old: float = 0.0
    # choices until the other kind is tried, and those after the next trial that does not pay
    _left: int = 1
    _rests: int = 1
    _trial: bool = False

    @property
    def _prefers_old(self) -> bool:
        return CHEAPER * self._old <= self._new

    def takes_old(self, least: float) -> bool:
        """Decide whether to begin with the old one.

        Args:
            least: Least price of a solution with a new one.
        """
        pays = not self._prefers_old or CHEAPER * self._old > least
        self._trial = self._left == 0 and pays
        self._left = max(0, self._left - 1)
        return self._prefers_old is not self._trial

    def add(self, old: bool, price: float) -> None:
        """Take the price of a solution of one kind."""
        if old:
            self._old = price
        else:
            self._new = price
        if self._trial:
            self._rests = 1 if self._prefers_old is old else min(2 * self._rests, RESTS)
            self._left, self._trial = self._rests, False


@dataclass
class Modified(Refresh):
    """One factorisation in each solution, and more where that one does not contract.

    Args:
        keep: Whether the last one begins the next solution.
        far: Motion in one update after which it is of no use, relative to the size of bodies.
    """

    purpose = Purpose.LAGGED
    keep: bool = False
    far: float = FAR
    _key: Hashable = field(default=None, init=False)
    _exists: bool = field(default=False, init=False)
    _updates: list[float] = field(default_factory=list, init=False)
    _count: int = field(default=0, init=False)
    _wanted: bool = field(default=True, init=False)
    _cost: float = field(default=0.0, init=False)
    # far from the solution not even a new factorisation lasts for two iterations
    _far: bool = field(default=False, init=False)
    # whether the first update of the last solution went far: so will that of the next one, which an
    # old factorisation leads astray
    _first_far: bool = field(default=False, init=False)
    # solutions with the factorisation, their iterations, those of the last one and its contraction
    _solutions: int = field(default=0, init=False)
    _iterations: int = field(default=0, init=False)
    _last: int = field(default=0, init=False)
    _usual: float | None = field(default=None, init=False)
    # update that round-off made at the end of a solution: of static plates it is 1e-12, and only
    # the third one of that size tells that it is nothing else
    _floor: float = field(default=0.0, init=False)
    # size of the last update with its parts by their weights
    _weighted: float = field(default=0.0, init=False)
    # the last update if it came from a factorisation at its own state, and whether the next does
    _exact: float | None = field(default=None, init=False)
    _fresh: bool = field(default=False, init=False)
    # whether the solution began with the old factorisation of the one before; None: of one before
    # that. And the factorisations in it
    _old: bool | None = field(default=False, init=False)
    _made: int = field(default=0, init=False)
    _beginning: _Beginning = field(default_factory=_Beginning, init=False)

    def begin(self, key: Hashable) -> None:
        """Forget the factorisation, that of another system, or one that costs more with age."""
        kept = self._exists and self.keep and key == self._key
        if key != self._key:
            self._floor, self._beginning = 0.0, _Beginning()
        self._wanted = not kept or self._aged() or self._first_far
        self._old = False if self._wanted else None
        if self._old is None and self._solutions == 1:
            self._old = self._beginning.takes_old(self._cost + LEAST)
            self._wanted = not self._old
        self._first_far, self._made = False, 0
        self._key = key
        self._updates, self._count, self._far = [], 0, False
        self._exact, self._fresh, self._weighted = None, False, 0.0

    def _aged(self) -> bool:
        """Decide whether the last solution took more iterations than the mean with factorisation.

        From there on each solution makes that mean larger.
        """
        return self._last * self._solutions > self._cost + self._iterations

    def forget(self) -> None:
        """The next solution begins with a factorisation."""
        self._exists = False

    def wanted(self) -> bool:
        """Decide whether the one there is does not pay any more."""
        return self._wanted

    def factorised(self, cost: float) -> None:
        """Note a factorisation, at the state before the next update."""
        self._cost = cost
        self._made += 1
        self._solutions, self._iterations, self._last, self._usual = 0, 0, 0, None
        self._wanted, self._exists = self._far, True
        self._fresh = True
        self._updates = self._updates[-1:] if self._far else []

    def converged(self, update: float, moved: float, weighted: float, tolerance: float) -> bool:
        """Test by the remaining error, estimated from the contraction."""
        self._updates.append(update)
        self._count += 1
        exact, self._exact, self._fresh = self._exact, update if self._fresh else None, False
        last, self._weighted = self._weighted, weighted
        if update == 0.0:
            return True
        squared = update <= tolerance and update**3 <= ERROR * tolerance * (exact or 0.0) ** 2
        if self._exact and squared:
            # with factorisations at both states errors are squared; larger updates may be round-off
            self._serve(False)
            return True
        if moved > self.far:
            self._wanted = True
            self._first_far = self._first_far or self._count == 1
            return False
        if len(self._updates) < 2:
            return False
        before = self._updates[-2]
        rho = update / before if before > 0 else math.inf
        mean, small = self._contraction(), update <= tolerance
        stalled = small and mean >= SLOW
        if stalled and update <= FLOOR * tolerance:
            self._floor = update
        roundoff = stalled or update <= ALIKE * self._floor
        # of motions, which count most, contraction may be another one
        next_rho = max(rho, self._weighted / last) if last > 0 else rho
        error = self._weighted * next_rho / (1 - next_rho) if next_rho < SLOW else math.inf
        if roundoff or (small and error <= ERROR * tolerance):
            # as small as round-off lets it be, or small enough
            self._serve(roundoff)
            return True
        # also of what is no number. Later on a single update may be as large as the one before
        if not mean < SLOW or (rho >= 1.0 and not small and len(self._updates) == 2):
            self._far = self._far or len(self._updates) == 2
            self._wanted = True
            return False
        left = math.log(ERROR * tolerance / update) / math.log(mean)
        self._wanted = left > min(self._cost, PATIENCE) + AFRESH
        return False

    def settled(self) -> None:
        """A solution was found."""
        self._serve(True)

    def _contraction(self) -> float:
        """Mean of the last two; of the first one and what it usually is."""
        updates = self._updates
        if len(updates) > 2:
            return math.sqrt(updates[-1] / updates[-3])
        rho = updates[1] / updates[0] if updates[0] > 0 else math.inf
        return rho if self._usual is None else math.sqrt(rho * self._usual)

    def _serve(self, roundoff: bool) -> None:
        """A solution was found; `roundoff`: its last update is nothing else."""
        updates = self._updates[:-1] if roundoff else self._updates
        if self._solutions and len(updates) > 1:
            self._usual = (updates[-1] / updates[0]) ** (1 / (len(updates) - 1))
        self._last = len(self._updates)
        if self._old is not None:
            self._beginning.add(self._old, self._count + self._cost * self._made)
        self._solutions += 1
        self._iterations += self._last


@dataclass
class Once(Refresh):
    """A factorisation for as long as the system is the same one: all are linear.

    Args:
        trusting: Whether one update is enough once a second one has found next to nothing. It
            leaves round-off as large as the stiffest forces make it; a second one takes that out,
            and costs as much as the first.
    """

    purpose = Purpose.EXACT
    lasts = True
    trusting: bool = False
    _key: Hashable = field(default=NOTHING, init=False)
    _wanted: bool = field(default=True, init=False)
    _updates: int = field(default=0, init=False)
    _first: float = field(default=0.0, init=False)

    def begin(self, key: Hashable) -> None:
        """Keep the factorisation, if there is one, unless the system is another one."""
        self._wanted = self._wanted or key != self._key
        self.exact = self.exact and not self._wanted
        self._key, self._updates = key, 0

    def forget(self) -> None:
        """The next solution begins with a factorisation."""
        self._key = NOTHING

    def wanted(self) -> bool:
        """Decide whether the system changed."""
        return self._wanted

    def factorised(self, cost: float) -> None:
        """Note a factorisation, which serves from now on."""
        self._wanted = False

    def converged(self, update: float, moved: float, weighted: float, tolerance: float) -> bool:
        """Test by the second update, which is round-off in a linear problem."""
        self._updates += 1
        if self._updates == 1:
            self._first = update
        done = self.exact or update == 0.0 or (self._updates > 1 and update <= tolerance)
        found = self._updates == 2 and update <= LEFT * self._first
        self.exact = self.trusting and done and (self.exact or found)
        return done


def automatic() -> Modified:
    """A factorisation is kept over iterations and steps as long as it pays."""
    return Modified(keep=True)


def trusting() -> Once:
    """One update for each right-hand side."""
    return Once(trusting=True)


REFRESH: dict[str, Callable[[], Refresh]] = {
    "full": Refresh,
    "modified": Modified,
    "auto": automatic,
    "static full": Refresh,
    "static modified": lambda: Modified(far=STATIC_FAR),
    "static auto": lambda: Modified(keep=True, far=STATIC_FAR),
    "linear full": Once,
    "linear modified": Once,
    "linear auto": trusting,
}
