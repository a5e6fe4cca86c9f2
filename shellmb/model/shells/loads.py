"""Loads on a shell, bound to measures and constants."""

from __future__ import annotations

import ufl
from ufl import Form
from ufl.core.expr import Expr

from shellmb.forms import loads as forms
from shellmb.forms.surface import Surface
from shellmb.model.sections.natural import Distributed
from shellmb.model.shells.discrete_shell import DiscreteShell
from shellmb.model.shells.positions import field_of
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


def load_work(body: DiscreteShell, load: Distributed, mid: Expr, dq: Expr) -> Form:
    """Virtual work of a load on a shell.

    Args:
        body: The shell.
        load: The load, or its natural strain.
        mid: Configuration.
        dq: Direction.
    """
    if not isinstance(load, Load):
        assert body.natural is not None
        return body.natural.work(mid, dq)
    (u, w), (du, dw) = body.velocities(mid), body.velocities(dq)

    def given(name: str, size: int = 3) -> Expr:
        """A constant, or a function of the position interpolated once."""
        return field_of(getattr(load, name), body.mixed, size, f"{load.label}: {name}")

    match load:
        case SurfaceForce():
            return forms.dead_force(given("force"), du) * body.rules.full
        case FollowerSurfaceForce():
            force = forms.follower_force(given("components"), u, w, body.surface, du)
            return force * body.rules.full
        case Pressure():
            return forms.pressure(given("p", 1), u, body.surface, du) * body.rules.full
        case Gravity():
            assert body.mass_of_section is not None
            weight = forms.gravity(given("acceleration"), body.mass_of_section, du, dw)
            return weight * body.rules.full
        case EdgeForce():
            return forms.dead_force(given("force"), du) * body.ds(load.at, "edge force")
        case FollowerEdgeForce():
            force = forms.follower_force(given("components"), u, w, _edge_basis(body), du)
            return force * body.ds(load.at, "follower edge force")
        case EdgeMoment():
            moment = forms.director_moment(given("moment"), body.surface.D + w, dw)
            return moment * body.ds(load.at, "edge moment")
    raise NotImplementedError(f"no form for {type(load).__name__}")


def _edge_basis(body: DiscreteShell) -> Surface:
    """Outward, along the edge, and normal: the basis of follower forces on edges."""
    surf = body.surface
    outward = ufl.FacetNormal(body.mixed.space.mesh)
    return Surface(outward, ufl.cross(ufl.cross(surf.e1, surf.e2), outward), surf.D)
