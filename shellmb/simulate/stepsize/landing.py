"""Times on which steps land exactly: locks, corners of loads and motions, what a user names."""

from __future__ import annotations

from collections.abc import Iterable

from shellmb.scene import Scene
from shellmb.scene.checks.control import corners
from shellmb.simulate.stepsize.control import StepSize
from shellmb.simulate.stepsize.tolerance import ErrorSize

# a remaining time below this fraction of a step is round-off, not a step
ROUND_OFF = 1e-9


class Landing:
    """The times of a run.

    Corners count where steps follow their error: long ones could pass a whole load. Fixed steps are
    the user's, and so is what they do at a corner.

    Args:
        scene: The scene.
        events: Times at which something begins or ends to act, s.

    Attributes:
        times: All of them in their order, s.
    """

    def __init__(self, scene: Scene, events: Iterable[float]) -> None:
        self._corners = frozenset(
            corners(scene) if scene.step_control.step_error is not None else ()
        )
        self.times = tuple(sorted({*events, *scene.step_control.times, *self._corners}))

    def after(self, t: float, t_end: float) -> float:
        """The next one, s.

        Args:
            t: Time, s.
            t_end: End of the run, s.
        """
        return next((time for time in self.times if t < time < t_end), t_end)

    def corner(self, t: float) -> bool:
        """Decide whether forces or motions have a corner at a time [s] that steps landed on."""
        return t in self._corners


def step_to(end: float, t: float, size: StepSize) -> float:
    """Length of the next step, s.

    Args:
        end: Time that it must not pass, s.
        t: Its start, s.
        size: The step size.
    """
    remaining = end - t
    if remaining <= size.dt * (1 + ROUND_OFF):
        return remaining
    # two steps of the same length in place of a long one and what is left
    if isinstance(size, ErrorSize) and remaining < 2 * size.dt:
        return remaining / 2
    return size.dt
