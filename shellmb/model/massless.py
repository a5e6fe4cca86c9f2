"""Base of bodies without mass and elasticity, and loads with the time factors of one stage."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
import ufl
from dolfinx import fem, mesh
from ufl import Form
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.meshes.nodes import NodeMesh, constant_vector, set_constants
from shellmb.meshes.spaces import MixedSpace
from shellmb.model.body import (
    Constraint,
    Damped,
    Elastic,
    FixedDofs,
    LoadFactors,
    Manifold,
    NodeLink,
    PartScale,
    Rates,
    TimeFunction,
    added,
)

Average = Callable[[TimeFunction | None], float]


class TimedLoads[T]:
    """Loads of a body, each multiplied by a factor that the scheme sets.

    Args:
        domain: Mesh of the body.
        loads: The loads, each with its function of time.
        work: Virtual work of a load for a factor of one, at a configuration in a direction.
    """

    def __init__(
        self,
        domain: mesh.Mesh,
        loads: Sequence[tuple[TimeFunction | None, T]],
        work: Callable[[T, Expr, Expr], Form],
    ) -> None:
        self._loads, self._work = loads, work
        self._factors = [fem.Constant(domain, 0.0) for _ in loads]

    def update(self, average: Average) -> None:
        """Set the factors from the loads' time functions."""
        for (time, _), factor in zip(self._loads, self._factors, strict=True):
            factor.value = average(time)  # type: ignore[assignment]

    def virtual_work(self, mid: Expr, dq: Expr) -> Form | None:
        """Virtual work of all loads at the configuration `mid` in the direction `dq`."""
        pairs = zip(self._loads, self._factors, strict=True)
        return added(factor * self._work(load, mid, dq) for (_, load), factor in pairs)


class NodeLoads:
    """Loads at a node each, multiplied by factors that the scheme sets.

    Args:
        nodes: Their node mesh.
        values: The loads, shape (n, size).
        times: Their functions of time.
        work: Virtual work of loads at a configuration in a direction.
    """

    def __init__(
        self,
        nodes: NodeMesh,
        values: Floats,
        times: Sequence[TimeFunction | None],
        work: Callable[[Expr, Expr, Expr], Expr],
    ) -> None:
        self._nodes, self._values, self._times, self._work = nodes, values, times, work
        self._loads = constant_vector(nodes, 0 * values, "loads")

    def update(self, average: Average) -> None:
        """Set the loads from their time functions."""
        factors = np.array([average(time) for time in self._times])
        set_constants(self._loads, self._nodes, factors[:, None] * self._values)

    def virtual_work(self, mid: Expr, dq: Expr) -> Form | None:
        """Virtual work of the loads at the configuration `mid`."""
        return self._work(self._loads, mid, dq) * ufl.dx(self._nodes.mesh)


@dataclass
class Massless:
    """Base of bodies without mass and elasticity."""

    name: str
    mixed: MixedSpace
    parts: tuple[PartScale, ...]
    links: tuple[NodeLink, ...]
    fixed: list[FixedDofs] = field(default_factory=list)
    kinematic: frozenset[str] = frozenset()
    slenderness: float = 1.0
    jump_parts: frozenset[str] = frozenset()
    damping: Damped | None = None
    manifold: Manifold = Manifold()  # noqa: RUF009 (frozen)

    @property
    def elastic(self) -> Sequence[Elastic]:
        """No elastic parts."""
        return ()

    @property
    def constraints(self) -> Sequence[Constraint]:
        """No constraints."""
        return ()

    def inertia(self, rate: Expr, dq: Expr) -> Form | None:
        """No inertia."""
        return None

    def loads(self) -> LoadFactors | None:
        """No loads."""
        return None

    def applied(self, mid: Expr, rates: Rates | None, dq: Expr, time: fem.Constant) -> Form | None:
        """No added terms."""
        return None
