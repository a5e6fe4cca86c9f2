"""Estimate of the error of a step from the positions and directors at its end and before it.

A scheme of order p is off in a step by `C h^(p+1) q^(p+1)` (`schemes.base.LocalError`). That
derivative is a divided difference of the last p + 2 states, the new one among them: what the
polynomial through the states before misses the new state by, up to a factor. A motion as large as
the body with this derivative turns by the *equivalent angle*

    theta = (h^(p+1) |q^(p+1)| / L)^(1/(p+1))

in the step, and has gathered the error `C theta^p` when it has turned by one radian. This is what
is reported and controlled: all steps of a run with the same one are off by the same amount, and the
error of the run is proportional to it.

Only positions and directors enter. Velocities of stiff bodies, and of EP along constraints,
alternate; times the step they would count as errors that positions do not have. Directors count as
the positions of material points across the thickness.
"""

from __future__ import annotations

import math

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats, Int32s
from shellmb.restart import Restartable, constant
from shellmb.schemes.base import LocalError
from shellmb.simulate.predictor import hermite_weights
from shellmb.simulate.problem import Problem

# parts of a body that tell where it is
PLACES = ("u", "w")


class StepErrors(Restartable):
    """Estimates the error of each step, relative to the size of bodies.

    After a start, or a jump of velocities, there are no states before. Then the velocity there is
    known, and derivatives of lower degree k tell the angle, `(h^k q^(k) / L)^(1/k)`.

    Args:
        problem: The functions of all bodies.
    """

    remembered = ("_states", "_times", "_velocity")

    def __init__(self, problem: Problem) -> None:
        self._problem, self._comm = problem, problem.model.comm
        self._law: LocalError = problem.scheme.local_error
        self._where: list[tuple[str, Int32s]] = []
        scales: list[Floats] = []
        for body in problem.model.bodies:
            for part in body.parts:
                if part.name in PLACES and part.name in body.kinematic:
                    dofs = body.mixed.dofs[part.name]
                    self._where.append((body.name, dofs))
                    thin = body.slenderness if part.name == "w" else 1.0
                    scales.append(np.full(len(dofs), part.scale / thin))
        self._scales = np.concatenate([*scales, np.zeros(0)])
        self.forget()

    def forget(self) -> None:
        """Begin anew at the accepted state: velocities jumped, or forces."""
        # states before the next one, shape (k, n), and their times from it [s], the newest first
        self._states = constant(np.zeros((0, len(self._scales))))
        self._times: list[float] = []
        self._velocity: Floats | None = None

    def _taken(self, kind: str) -> Floats:
        """Entries of "q" or a rate at the accepted state, or of an unknown state."""
        found = []
        for name, dofs in self._where:
            levels = self._problem.levels[name]
            known = {"q": levels.q, **levels.rates}
            function = known[kind] if kind in known else levels.unknown[kind]
            found.append(function.x.array[dofs])
        return np.concatenate([*found, np.zeros(0)])

    def _begin(self) -> None:
        """Take the accepted state as the first one."""
        self._states, self._times = constant(self._taken("q")[None]), [0.0]
        self._velocity = constant(self._taken("v")) if "v" in self._problem.scheme.rates else None

    def estimate(self, dt: float) -> float:
        """Error of the step just solved; collective.

        Args:
            dt: Its length, s.

        Returns:
            `C theta^p` of the node that moves worst.
        """
        if not self._times:
            self._begin()
        data = np.stack([self._taken(self._problem.last), *self._states])
        times = np.array([0.0, *(t - dt for t in self._times)]) / dt
        confluent = self._velocity is not None and len(data) <= self._law.degree
        degree = min(len(data) - 1 + confluent, self._law.degree)
        if degree < 1:
            return 0.0
        weights = difference(times, degree, confluent)
        change = weights[: len(data)] @ data
        if confluent:
            change += weights[-1] * dt * self._velocity
        here = float(np.max(np.abs(change) / self._scales, initial=0.0))
        largest = float(self._comm.allreduce(here, op=MPI.MAX)) if self._comm.size > 1 else here
        return self._law.per_radian(largest ** (1 / degree))

    def accept(self, dt: float) -> None:
        """Keep the accepted state; the functions hold it."""
        if not self._times:
            return
        kept = self._law.degree
        self._times = [0.0, *(t - dt for t in self._times)][:kept]
        self._states = constant(np.stack([self._taken("q"), *self._states][:kept]))
        if len(self._states) == kept:
            self._velocity = None


def difference(times: Floats, degree: int, confluent: bool) -> Floats:
    """Weights of a derivative of the polynomial through values at some times.

    Args:
        times: The times, the newest first, shape (n,).
        degree: Of the derivative, which is constant: as many data as it has coefficients.
        confluent: Whether the last datum is the rate at the oldest time.

    Returns:
        Shape (n,), or (n + 1,) with the rate; zero where there are more values than it takes.
    """
    used = degree + 1 - confluent
    # the last coefficient, times the factorial, is the derivative
    unit = np.zeros(degree + 1)
    unit[-1] = math.factorial(degree)
    weights = hermite_weights(times[:used], times[used - confluent : used], unit)
    full = np.zeros(len(times) + confluent)
    full[:used] = weights[:used]
    if confluent:
        full[-1] = weights[-1]
    return full
