"""Events: conditions that are found true, to a tolerance, within a step."""

from __future__ import annotations

from typing import Annotated

from pydantic import InstanceOf

from shellmb.scene.control.sensors import Condition
from shellmb.scene.values.validate import Name, Positive, described

# true at the start
ALWAYS = Condition(">=", (0.0, 0.0))


@described("event")
class Event:
    """An event that goes on when a condition becomes true, and off when another one does.

    A condition that is true at the start counts at once. Later only one that has been false does:
    what goes off does not go on again before ``when`` has been false. The step in which a condition
    becomes true is repeated, shorter, until it ends there.

    Args:
        name: What locks, loads and results call it.
        when: The condition at which it goes on, as ``Sensor("hinge.rotation") >= 1.5``.
        until: The condition at which it goes off; None: it stays on.
        ends: Whether the run ends when it goes on.
        tolerance: How much later than the condition the step may end [s]; None: 1e-6 of ``dt``. No
            step is shorter than 1e-3 of ``dt``: an event closer than this to another event, or to
            a fixed step end, is handled at that instant.
    """

    name: Name
    when: Annotated[Condition, InstanceOf[Condition]]
    until: Annotated[Condition, InstanceOf[Condition]] | None = None
    ends: bool = False
    tolerance: Positive | None = None
