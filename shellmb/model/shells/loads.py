"""Loads on a shell, bound to measures and constants; each stage has its own time factors."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence

import numpy as np
import ufl
from dolfinx import fem, mesh
from ufl import Form
from ufl.core.expr import Expr

from shellmb.forms import loads as load_forms
from shellmb.forms.surface import Surface
from shellmb.model.body import TimeFunction
from shellmb.model.sections.natural import Distributed, NaturalStress
from shellmb.model.shells.discrete_shell import DiscreteShell
from shellmb.model.shells.positions import interpolated
from shellmb.scene.loads.loads import (
    EdgeForce,
    EdgeMoment,
    FollowerEdgeForce,
    FollowerSurfaceForce,
    Gravity,
    Load,
    Pressure,
    SurfaceForce,
)


class DistributedLoads(ABC):
    """The loads of one shell or beam, each multiplied by a factor that the scheme sets.

    Args:
        domain: Mesh of the body.
        loads: Its loads, and its natural strain.
        natural: What the natural strain acts by; None without one.
    """

    def __init__(
        self,
        domain: mesh.Mesh,
        loads: Sequence[Distributed],
        natural: NaturalStress | None = None,
    ) -> None:
        self._loads, self._natural = loads, natural
        self._factors = [fem.Constant(domain, 0.0) for _ in loads]

    def update(self, average: Callable[[TimeFunction | None], float]) -> None:
        """Set the factors from the loads' time functions."""
        for load, factor in zip(self._loads, self._factors, strict=True):
            factor.value = average(load.time)  # type: ignore[assignment]

    def virtual_work(self, mid: Expr, dq: Expr) -> Form | None:
        """Virtual work of all loads at the configuration `mid` in the direction `dq`."""
        forms = [
            self._work(load, factor, mid, dq)
            for load, factor in zip(self._loads, self._factors, strict=True)
        ]
        return sum(forms[1:], forms[0]) if forms else None

    def _work(self, load: Distributed, factor: fem.Constant, mid: Expr, dq: Expr) -> Form:
        if isinstance(load, Load):
            density, measure = self._density(load, mid, dq)
            return factor * density * measure
        assert self._natural is not None
        return factor * self._natural.work(mid, dq)

    @abstractmethod
    def _density(self, load: Load, mid: Expr, dq: Expr) -> tuple[Expr, ufl.Measure]:
        """Density of the virtual work of a load, and the measure that integrates it."""


class ShellLoads(DistributedLoads):
    """The loads of one shell.

    Args:
        body: The shell.
        loads: Its loads.
    """

    def __init__(self, body: DiscreteShell, loads: Sequence[Distributed]) -> None:
        super().__init__(body.mixed.space.mesh, loads, body.natural)
        self._body = body

    def _density(self, load: Load, mid: Expr, dq: Expr) -> tuple[Expr, ufl.Measure]:
        body, domain = self._body, self._body.mixed.space.mesh
        u, w = body.velocities(mid)
        du, dw = body.velocities(dq)

        def constant(value: object) -> fem.Constant:
            return fem.Constant(domain, np.asarray(value, dtype=float))

        match load:
            case SurfaceForce():
                return load_forms.dead_force(self._field(load, "force"), du), body.rules.full
            case FollowerSurfaceForce():
                components = constant(load.components)
                force = load_forms.follower_force(components, u, w, body.surface, du)
                return force, body.rules.full
            case Pressure():
                return (
                    load_forms.pressure(self._field(load, "p", 1), u, body.surface, du),
                    body.rules.full,
                )
            case Gravity():
                assert body.mass_of_section is not None
                acceleration = constant(load.acceleration)
                return (
                    load_forms.gravity(acceleration, body.mass_of_section, du, dw),
                    body.rules.full,
                )
            case EdgeForce():
                force = load_forms.dead_force(self._field(load, "force"), du)
                return force, body.ds(load.at, "edge force")
            case FollowerEdgeForce():
                components = constant(load.components)
                basis = self._edge_basis()
                return (
                    load_forms.follower_force(components, u, w, basis, du),
                    body.ds(load.at, "follower edge force"),
                )
            case EdgeMoment():
                d, given = body.surface.D + w, self._field(load, "moment")
                moment = load_forms.director_moment(given, d, dw)
                return moment, body.ds(load.at, "edge moment")
        raise NotImplementedError(f"no form for {type(load).__name__}")

    def _field(self, load: Load, name: str, size: int = 3) -> Expr:
        """A constant, or a function of the position interpolated once."""
        value = getattr(load, name)
        if callable(value):
            return interpolated(value, self._body.mixed, size, f"{load.label}: {name}")
        return fem.Constant(self._body.mixed.space.mesh, np.asarray(value, dtype=float))

    def _edge_basis(self) -> Surface:
        """Outward, along the edge, and normal: the basis of follower forces on edges."""
        surf = self._body.surface
        normal = ufl.cross(surf.e1, surf.e2)
        outward = ufl.FacetNormal(self._body.mixed.space.mesh)
        return Surface(outward, ufl.cross(normal, outward), surf.D)
