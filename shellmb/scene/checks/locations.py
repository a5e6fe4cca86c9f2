"""Names of edges, areas and points that a scene speaks of, tried against what there is."""

from typing import Any

from shellmb.errors import SceneError
from shellmb.scene.multibody.offsets import Offset
from shellmb.scene.values.bodies import SceneBody
from shellmb.scene.values.validate import listed, said, show

# what a name may be of
EDGES, FIELDS, ANY = ("edge",), ("edge", "area"), ("edge", "area", "point")


def check_place(body: SceneBody, where: Any, who: str, kinds: tuple[str, ...] = ("point",)) -> None:
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
    known = {kind: getattr(body, f"{kind}_names") for kind in kinds}
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


def _node(body: SceneBody, point: Offset, who: str) -> Any:
    """The node that an offset is from."""
    if body.single or not body.directors:
        raise SceneError(
            f"{who}: an offset is from a node of a shell or beam and {said(body)} has none; "
            "give the coordinates of the point"
        )
    if not (isinstance(point.by, tuple) or body.directors == 1):
        raise SceneError(
            f"{who}: the offset is {show(point.by)} and {said(body)} has no single director; "
            "it must be a vector"
        )
    return point.at
