"""Names of edges, areas and points that a scene speaks of, tried against what there is."""

from collections.abc import Callable
from typing import Any

from shellmb.errors import SceneError
from shellmb.scene.beams.beam import Beam
from shellmb.scene.description import Body
from shellmb.scene.multibody.offsets import Offset
from shellmb.scene.multibody.own_bodies import UserBody
from shellmb.scene.multibody.rigid import RigidBody
from shellmb.scene.shells.shell import Shell
from shellmb.scene.values.validate import listed, said, show


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


# what a name may be of
KINDS: dict[str, Callable[[Body], tuple[str, ...] | None]] = {
    "edge": edges_of,
    "area": areas_of,
    "point": points_of,
}
EDGES, FIELDS, ANY = ("edge",), ("edge", "area"), ("edge", "area", "point")


def check_place(body: Body, where: Any, who: str, kinds: tuple[str, ...] = ("point",)) -> None:
    """Refuse names that a body does not have, and offsets from nodes that it does not have.

    Coordinates, and what only the mesh knows, pass.

    Args:
        body: The body.
        where: A name or names, coordinates, an `Offset`, or None.
        who: Who asks, for the error.
        kinds: What a name may be of.

    Raises:
        SceneError: If there is one.
    """
    if isinstance(where, Offset):
        where = _node(body, where, who)
    names = (where,) if isinstance(where, str) else where or ()
    known = {kind: KINDS[kind](body) for kind in kinds}
    if None in known.values():
        return
    for name in names:
        if not isinstance(name, str) or any(name in some for some in known.values() if some):
            continue
        # areas are few, and are told of where there are some
        there = {k: some for k, some in known.items() if some} or {kinds[-1]: ()}
        parts = [f"{kind}s {listed(some or ()) or 'none'}" for kind, some in there.items()]
        has = f"{', its '.join(parts)}{', or give coordinates' if 'point' in there else ''}"
        raise SceneError(
            f"{who}: {said(body)} has no {' or '.join(k for k in there if k != 'area')} '{name}'; "
            f"its {has.replace('s ', 's are ', 1)}"
        )


def _node(body: Body, point: Offset, who: str) -> Any:
    """The node that an offset is from."""
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
    return point.at
