"""Linear scenes: one factorisation, which serves every load step."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field

from shellmb.system.assembly import BlockSystem
from shellmb.system.iteration import Iteration, MakeLinear, NewtonSettings

# what the system is before anything is factorised: no key is equal to it
NOTHING: Hashable = object()


@dataclass
class Once:
    """A factorisation for as long as the system is the same one."""

    lags: bool = True
    _key: Hashable = field(default=NOTHING, init=False)
    _wanted: bool = field(default=True, init=False)
    _updates: int = field(default=0, init=False)

    def begin(self, key: Hashable) -> None:
        """Keep the factorisation unless the system is another one."""
        self._wanted = key != self._key
        self._key, self._updates = key, 0

    def forget(self) -> None:
        """The next solution begins with a factorisation."""
        self._key = NOTHING

    def wanted(self) -> bool:
        """Whether the system changed."""
        return self._wanted

    def factorised(self) -> None:
        """It serves from now on."""
        self._wanted = False

    def converged(self, update: float, moved: float, tolerance: float) -> bool:
        """By the second update, which only takes out round-off: if not, nothing was linear."""
        self._updates += 1
        return update == 0.0 or (self._updates > 1 and update <= tolerance)


class LinearIteration(Iteration):
    """An iteration that factorises once, before the first step.

    Args:
        system: The block system.
        settings: Tolerances.
        prefix: PETSc options prefix.
        linear: Makes what solves the linear systems.
        key: What the system depends on, now.
    """

    def __init__(
        self,
        system: BlockSystem,
        settings: NewtonSettings,
        prefix: str,
        linear: MakeLinear | None,
        key: Callable[[], Hashable],
    ) -> None:
        super().__init__(system, settings, prefix, linear)
        self._refresh = self.refresh = Once()
        self.lags, self._system_key = True, key

    def begin(self, key: Hashable, full: bool) -> None:
        """Before the first iteration; the length of a load step changes nothing."""
        super().begin(self._system_key(), full)

    def warm_up(self) -> None:
        """Assemble and factorise for good."""
        self.begin(None, False)
        self.system.scatter(self.system.x)
        if self.linear.factorise(once=False) is None:
            self.refresh.factorised()
