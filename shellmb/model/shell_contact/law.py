"""The law of a contact with faces of a shell, that of `forms.contact`, by a distance."""

from __future__ import annotations

from typing import NamedTuple

from ufl.core.expr import Expr

from shellmb.arrays import Floats, Ints
from shellmb.forms import contact
from shellmb.scene.loads.contacts import Contact


class Law(NamedTuple):
    """Law of the penetrations of some points.

    Args:
        reach: Distance at which contact begins, m.
        stiffness: Stiffness of each point, shape (n,), N/m.
        item: Smoothing, damping and friction.
    """

    reach: float
    stiffness: Floats
    item: Contact

    def only(self, which: Ints) -> Law:
        """Law of some of the points."""
        return self._replace(stiffness=self.stiffness[which])


def energy(e: Expr, stiffness: Expr, reach: Expr, smoothing: Expr) -> Expr:
    """Energy at a distance, as a part of the reach, shape (1,)."""
    return contact.energy(reach * (1 - e[0]), stiffness, smoothing)
