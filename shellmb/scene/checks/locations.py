"""Names of edges, areas and points that a scene speaks of, tried against what there is."""

from typing import Any

from shellmb.errors import SceneError
from shellmb.scene.beams.beam import Beam
from shellmb.scene.description import Body
from shellmb.scene.multibody.offsets import Offset
from shellmb.scene.multibody.own_bodies import UserBody
from shellmb.scene.multibody.rigid import RigidBody
from shellmb.scene.shells.shell import Shell
from shellmb.scene.values.validate import edge_names, listed, said, show


def edges_of(body: Body) -> tuple[str, ...] | None:
    """Names of the edges of a body, of a beam its ends; None where only the mesh knows them."""
    if isinstance(body, Shell):
        return body.surface.edges
    if isinstance(body, Beam):
        return body.curve.point_names
    return body.region_names if isinstance(body, UserBody) else ()


def points_of(body: Body) -> tuple[str, ...] | None:
    """Names of the points of a body; None where only the mesh knows them."""
    if isinstance(body, Shell):
        return body.surface.points
    return body.curve.point_names if isinstance(body, Beam) else body.point_names


def areas_of(body: Body) -> tuple[str, ...]:
    """Names of the areas that a shell was given."""
    return tuple(body.areas) if isinstance(body, Shell) else ()


def check_edges(
    body: Body, edge: str | tuple[str, ...], who: str, areas: tuple[str, ...] = ()
) -> None:
    """Refuse edges that the body does not have.

    Args:
        body: The body.
        edge: Name or names.
        who: Who asks, for the error.
        areas: Names of areas that will do, too.

    Raises:
        SceneError: If there is one.
    """
    known = edges_of(body)
    for name in edge_names(edge):
        if known is not None and name not in (*known, *areas):
            more = f", its areas {listed(areas)}" if areas else ""
            raise SceneError(
                f"{who}: {said(body)} has no edge '{name}'; its edges are {listed(known)}{more}"
            )


def check_point(body: Body, point: Any, who: str) -> None:
    """Refuse a point that the body does not have.

    Raises:
        SceneError: If there is none of that name, or an offset from it has no direction.
    """
    known = points_of(body)
    if isinstance(point, Offset):
        if isinstance(body, RigidBody | UserBody):
            raise SceneError(
                f"{who}: an offset is from a node of a shell or beam and {said(body)} has none; "
                "give the coordinates of the point"
            )
        if not (isinstance(point.by, tuple) or isinstance(body, Shell)):
            raise SceneError(
                f"{who}: the offset is {show(point.by)} and {said(body)} has no single director; "
                "it must be a vector"
            )
        point = point.at
    if known is not None and isinstance(point, str) and point not in known:
        raise SceneError(
            f"{who}: {said(body)} has no point '{point}'; its points are "
            f"{listed(known) or 'none'}, or give coordinates"
        )
