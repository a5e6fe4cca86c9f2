"""Warnings if a model is hardly what is meant: sizes, shapes, and where probes are."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from mpi4py import MPI

import basix
import numpy as np
import ufl
from dolfinx import fem

from shellmb.errors import SceneError, warn
from shellmb.forms import frame as frame_forms
from shellmb.forms.surface import along
from shellmb.model.locations.nodes import local_point, said_point
from shellmb.model.locations.surrounding import is_point, surrounding
from shellmb.native.expressions import compiled_expression
from shellmb.scene.lookup import said

if TYPE_CHECKING:
    from shellmb.model.frames.beam import BeamModel
    from shellmb.model.shells.shell import ShellModel
    from shellmb.scene import Scene


# part of an area or length by which an element has collapsed
COLLAPSED = 1e-3
# edges that are nearer than this part of the shell's length lie on one another
SAME = 1e-6


def doubt_thickness(
    comm: MPI.Comm, shells: Mapping[str, ShellModel], beams: Mapping[str, BeamModel]
) -> None:
    """Warn of shells thicker and beams wider than they are long: mostly mistakes of units.

    Args:
        comm: Communicator.
        shells: Shells by name.
        beams: Beams by name.
    """
    if comm.rank != 0:
        return
    sizes = [
        (shell.shell, "thickness", shell.section.sizes.thickness, shell.surface_mesh.length)
        for shell in shells.values()
    ]
    sizes += [
        (beam.beam, "size of its section", beam.beam.section.size, beam.domain.length)  # type: ignore[misc]
        for beam in beams.values()
    ]
    for body, what, size, length in sizes:
        if size > length:
            warn(
                f"{said(body)}: the {what} is {size:.4g} m and it is {length:.4g} m long; the "
                "theory is for thin bodies, so check the units",
            )


# places along an edge that are compared
ALONG = np.linspace(0.0, 1.0, 9)


def doubt_slits(comm: MPI.Comm, shells: Mapping[str, ShellModel]) -> None:
    """Warn of shells whose opposite edges lie on one another and are not joined.

    Args:
        comm: Communicator.
        shells: Shells by name.
    """
    if comm.rank != 0:
        return
    zero, one = np.zeros_like(ALONG), np.ones_like(ALONG)
    opposite = {
        ("left", "right"): ((zero, ALONG), (one, ALONG)),
        ("bottom", "top"): ((ALONG, zero), (ALONG, one)),
    }
    for shell in shells.values():
        surface, length = shell.shell.surface, shell.surface_mesh.length
        for (first, second), places in opposite.items():
            if surface.slit or not {first, second} <= set(surface.edges or ()):
                continue
            a, b = (surface.position(*place) for place in places)
            if np.ptp(a, axis=1).max() < SAME * length or np.abs(a - b).max() > SAME * length:
                # an edge that is a point is a pole, and no slit
                continue
            warn(
                f"{said(shell.shell)}: its edges '{first}' and '{second}' lie on one another and "
                "are not joined: the shell is slit there; use Cylinder, Sphere or Disc with 360 "
                "degrees to close it, or Parametric(..., slit=True) if the slit is meant",
            )


def check_probes(scene: Scene, meshed: Mapping[str, Any]) -> None:
    """Points of probes are found before anything is read off forms; collective.

    Raises:
        SceneError: If one is not on its body.
    """
    for probe in scene.probes:
        (target,) = scene.bodies_of(probe)
        if target.name in meshed:
            body, who = meshed[target.name], f"probe '{probe.name}'"
            places: Any = [probe.at]
            if is_point(probe.at):
                places, _ = surrounding(body, probe.at, who)
            for place in places:
                local_point(body, place, who)
        if probe.frame is not None and probe.frame in meshed:
            local_point(meshed[probe.frame], probe.frame_at, f"probe '{probe.name}'")


def refuse_folded(body: ShellModel | BeamModel, q: fem.Function, who: str) -> None:
    """Refuse a state in which a surface or line has collapsed, or is turned over; collective.

    What is left of the area of an element (of the length, of a beam) is taken along the directors.

    Args:
        body: The shell or beam.
        q: The state.
        who: Where the state comes from, for the error.

    Raises:
        SceneError: Says where, and what is left there.
    """
    domain, u, w = body.domain.mesh, *body.layout.moved(q)
    if hasattr(body, "surface"):
        surf = body.surface
        sides = (e + along(u, e) for e in (surf.e1, surf.e2))
        left, what = ufl.dot(ufl.cross(*sides), surf.D + w), "area"
    else:
        t, first = body.line.t, frame_forms.vectors(body.line.D + w)[0]
        left, what = ufl.dot(t + along(u, t), first), "length"
    points, _ = basix.make_quadrature(domain.basix_cell(), 4)
    cells = np.arange(domain.topology.index_map(domain.topology.dim).size_local, dtype=np.int32)
    value = ufl.as_vector([left, *ufl.SpatialCoordinate(domain)])
    found = compiled_expression(value, np.asarray(points)).eval(domain, cells).reshape(-1, 4)
    worst = min(map(tuple, found), default=(np.inf,))
    least, *x = min(domain.comm.allgather(worst))
    if least < COLLAPSED:
        place, share = said_point(np.array(x), body.domain.length), round(least, 3) + 0.0
        raise SceneError(
            f"{who}: at {place} {share:g} of the {what} is left, along the directors; it "
            "must be greater than 0 everywhere: the shape must not map to a point or line, fold, "
            "or turn over without rotation="
        )
