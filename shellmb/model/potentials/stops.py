"""Stops on coordinates of joints: contact of a coordinate with its limits."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.forms import contact as forms
from shellmb.meshes.nodes import NodeMesh, constant_vector
from shellmb.model.body import Elastic, Rates
from shellmb.model.potentials.exact import FAR, ExactEnergy
from shellmb.scene.multibody.elements import JointStop

# what is not limited: no coordinate comes there
NEVER = 1e30


class StopForces:
    """Forces of stops; what a group of them has at the nodes of coordinates.

    Attributes:
        size: Characteristic magnitude of each coordinate.
        damped: Whether one of them has damping.
    """

    size: fem.Function
    damped: bool

    def x(self, q: Expr) -> Expr:
        """The coordinate at a state."""
        raise NotImplementedError

    def take(self, nodes: NodeMesh, stops: Sequence[JointStop]) -> None:
        """Take the parameters of the stops, one for each node."""

        def some(name: str, nothing: float = 0.0) -> fem.Function:
            given = [getattr(stop, name) for stop in stops]
            rows = [[nothing if value is None else float(value)] for value in given]
            return constant_vector(nodes, np.array(rows), name)

        self._limits = (some("lower", -NEVER), -1), (some("upper", NEVER), 1)
        self._law = some("stiffness"), some("smoothing")
        self._damping = some("relative_damping")
        self.damped = any(stop.relative_damping > 0 for stop in stops)
        self.weight = constant_vector(nodes, np.ones((len(stops), 1)), "weight")
        self.dx, self.always = ufl.dx(nodes.mesh), fem.Constant(nodes.mesh, 0.0)

    @cached_property
    def elastic(self) -> tuple[Elastic, ...]:
        """Energy of what is beyond the limits."""
        return (ExactEnergy(self.measure, self.potential, self.weight, self.dx),)

    def measure(self, q: Expr) -> Expr:
        """The coordinate over its size."""
        return ufl.as_vector([self.x(q) / self.size])

    def potential(self, e: Expr) -> Expr:
        """Energy of what is beyond either limit."""
        x = self.size * e[0]
        first, second = (
            forms.energy(self._beyond(x, limit, sign), *self._law) for limit, sign in self._limits
        )
        return first + second

    def _beyond(self, x: Expr, limit: Expr, sign: int) -> Expr:
        return sign * (x - limit) + FAR * self.always

    def applied(self, mid: Expr, rates: Rates | None, dq: Expr, time: fem.Constant) -> Form | None:
        """Work of the damping, with the rate and the middle of the whole step."""
        if rates is None or not self.damped:
            return None
        x, rate = self.x(mid if rates.middle is None else rates.middle), self.x(rates.chord)
        return -self.resistance(x, rate) * self.x(dq) * self.dx

    def resistance(self, x: Expr, rate: Expr) -> Expr:
        """Contribution of the damping to the force that holds the coordinate."""
        found: Any = 0
        for limit, sign in self._limits:
            pressing = forms.force(self._beyond(x, limit, sign), *self._law)
            into = sign * rate + FAR * self.always
            found += sign * forms.resisted(pressing, into, self._damping)
        return found
