"""Loads of shells and beams, and strains that these have without stress, which act as loads do.

With `e - theta e*` in place of the strain `e` of a linear section the forces are those of `e` less
`theta S*`, `S* = C e*`: a stress that is given, and that acts on the same strains, at the same
points. So it is a load, of which the schemes take means and work as of any other, and the mixed
form stays what it is. What is reported is of `e - theta e*`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.errors import SceneError, alike, warn
from shellmb.forms.measure import Measure
from shellmb.model.body import LoadFactors, MassiveBody, Rates, TimeFunction
from shellmb.model.massless import timed_loads
from shellmb.model.user_forms import virtual_work
from shellmb.scene import BeamNaturalStrain, NaturalStrain
from shellmb.scene.loads.loads import Load
from shellmb.scene.lookup import said
from shellmb.scene.values.user_functions import given_at, on_trial

# what a set of loads of a body may have
Distributed = Load | NaturalStrain | BeamNaturalStrain


@dataclass(frozen=True)
class NaturalStress:
    """The stress `C e*` of a natural strain `e*`.

    Args:
        strain: `e*`.
        stresses: `S*` for each quadrature rule.
        resultants: What of it is reported, for a factor of one.
        measure: Strains of the body.
        integrate: Integral of densities, one for each rule.
        time: Factor `theta` over time.
        now: That factor at the state which was accepted last.
        mean: Its mean over the step that was solved last.
    """

    strain: Expr
    stresses: tuple[Expr, ...]
    resultants: Expr
    measure: Measure
    integrate: Callable[[Sequence[Expr]], Form]
    time: TimeFunction | None = field(compare=False)
    now: fem.Constant
    mean: fem.Constant

    def work(self, mid: Expr, dq: Expr) -> Form:
        """Virtual work of the stress at a state, for a factor of one."""
        change = self.measure.change(mid, dq)
        return self.integrate([ufl.dot(stress, change) for stress in self.stresses])

    def energy(self, q: Expr) -> Form:
        """Elastic energy of `e - theta e*` less that of `e`."""
        e = self.measure.value(q)
        shift = self.now * self.strain / 2 - e
        return self.integrate([self.now * ufl.dot(stress, shift) for stress in self.stresses])


class LoadedBody(MassiveBody):
    """A shell or beam on its mesh, with distributed loads, a natural strain and terms of the user.

    Attributes:
        described: Its description.
        section: Its section, bound to the mesh.
        rules: Rules of its integrals.
        integrate: Integral of densities, one for each rule.
        natural_stress: Gives the first four of what `NaturalStress` has, of a natural strain.
        load_work: Gives the virtual work of a load for a factor of one.
        point: Gives what terms of the user depend on; arguments as of `applied`.
        rigid_axes: Axes of a rigid body in its place, in columns: those of the scene.
    """

    rigid_axes = np.eye(3)

    described: Any
    section: Any
    rules: Any
    integrate: Callable[[Sequence[Expr]], Form]
    natural_stress: Callable[[Any], tuple[Expr, tuple[Expr, ...], Expr, Measure]]
    load_work: Callable[[Any, Expr, Expr], Form]
    point: Callable[..., Any]
    _loads: Sequence[Distributed]

    @property
    def force_size(self) -> float:
        """Size of its resultants, N."""
        return float(self.section.force.value)

    @cached_property
    def natural(self) -> NaturalStress | None:
        """The stress of its natural strain; None without one."""
        given, domain = self.described.natural, self.mixed.space.mesh
        if given is None:
            return None
        now, mean = fem.Constant(domain, 0.0), fem.Constant(domain, 0.0)
        return NaturalStress(*self.natural_stress(given), self.integrate, given.time, now, mean)

    def loads(self) -> LoadFactors | None:
        """A set of its loads with time factors of their own."""
        return self.loads_of(self._loads) if self._loads else None

    def loads_of(self, loads: Sequence[Distributed]) -> LoadFactors:
        """Some loads on it with time factors of their own."""
        timed = [(load.time, load) for load in loads]
        return timed_loads(self.mixed.space.mesh, timed, self._work)

    def _work(self, load: Any, mid: Expr, dq: Expr) -> Form:
        if self.natural is not None and load is self.described.natural:
            return self.natural.work(mid, dq)
        return self.load_work(load, mid, dq)

    def users(self, mid: Expr, rates: Rates | None, dq: Expr, time: fem.Constant) -> Form | None:
        """Terms that the user added; None without any."""
        terms = self.described.terms
        if not terms:
            return None
        point = self.point(mid, rates, dq, time)
        return virtual_work(terms, point, dq, said(self.described)) * self.rules.full


# Green's strain of a length that vanishes, and of one that grows by 1.73; beyond 5 % sections
# whose stress is linear are doubtful, and most strains are slips of units
LEAST, MOST, LARGE = -0.5, 1.0, 0.05
RATIO = "a strain is a ratio (1 % is 0.01), so check the units"
# instants at which factors over time are taken
INSTANTS = np.linspace(0.0, 1.0, 65)


def doubt_natural(comm: MPI.Comm, t_end: float, bodies: Mapping[str, Any]) -> None:
    """Refuse natural strains below -0.5 or above 1, warn of those beyond 5 %; collective.

    Args:
        comm: Communicator.
        t_end: End of the run, s.
        bodies: Shells and beams by name.

    Raises:
        SceneError: Names the body and the strain.
    """
    for model in bodies.values():
        body = model.described
        if body.natural is None:
            continue
        with alike(comm):
            extremes = [_principal(*face) for face in model.natural_faces()]
        found = np.concatenate([np.concatenate(each) for each in comm.allgather(extremes)])
        factors = _factors(body.natural.time, t_end, f"natural strain of {said(body)}: time")
        low, high = (f(np.outer(factors, found), initial=0.0) for f in (np.min, np.max))
        curved = np.any(body.natural.curvature) or callable(body.natural.curvature)
        who = f"{said(body)}: its natural strain{' at the faces' * bool(curved)} reaches"
        if low < LEAST or high > MOST:
            wrong = low if low < LEAST else high
            raise SceneError(
                f"{who} {wrong:.4g}; it must be between {LEAST:g}, where no length is left, and "
                f"{MOST:g}: {RATIO}"
            )
        largest = max(low, high, key=abs)
        if abs(largest) > LARGE:
            advice = "smaller natural strains, or smaller load steps"
            model.parts = tuple(replace(p, advice=advice) for p in model.parts)
            if comm.rank == 0:
                warn(
                    f"{who} {largest:.4g}, more than {LARGE:g}: stresses that are linear in such "
                    f"strains are unreliable; {RATIO}"
                )


def _principal(a: Floats | float, b: Floats | float, c: Floats | float) -> Floats:
    """Both principal strains of 11, 22 and 2*12."""
    middle, radius = (np.add(a, b)) / 2, np.hypot(np.subtract(a, b), c) / 2
    return np.ravel([middle - radius, middle + radius])


def _factors(time: object, t_end: float, who: str) -> Floats:
    """Factors over time at many instants, those of corners among them."""
    if not callable(time):
        return np.ones(1)
    corners = [t for t in getattr(time, "corners", ()) if 0 <= t <= t_end]
    time = on_trial(time)
    return np.array([given_at(time, float(t), who, 1) for t in (*(t_end * INSTANTS), *corners)])
