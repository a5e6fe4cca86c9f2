"""Names of fields, edges, areas and points that a scene speaks of, tried against what there is."""

from typing import Any

from shellmb.errors import SceneError
from shellmb.scene.description import Description
from shellmb.scene.fields import DEFAULT, FIELDS, JUDGED
from shellmb.scene.multibody.offsets import Offset
from shellmb.scene.probes import Reserve
from shellmb.scene.shells.strength import CRITERIA
from shellmb.scene.values.bodies import SceneBody
from shellmb.scene.values.validate import Sentences, listed, said, show

# what there has to be for a field, in words
OWNERS = {
    "shell": "shell that deforms",
    "beam": "beam that deforms",
    "joint": "joint",
    "laminate": "shell with plies (a Laminate)",
    "linear": "shell with a linear section",
    "relaxing": "shell whose section relaxes",
    "held": "shell whose plies have natural strains",
}

# what a name may be of
EDGES, PARTS, ANY = ("edge",), ("edge", "area"), ("edge", "area", "point")


def wanted_fields(scene: Description, kinds: set[str]) -> tuple[str, ...]:
    """Names of the fields that a body of some kinds gets.

    Args:
        scene: The scene.
        kinds: Kinds of `FieldKind.bodies`.
    """
    requested = scene.output.fields
    return tuple(
        name
        for name, field in FIELDS.items()
        if (name in requested or "all" in requested) and field.bodies & kinds
    )


def has_field(name: str, kinds: set[str]) -> bool:
    """Decide whether bodies of some kinds may have a field.

    Args:
        name: Its name.
        kinds: Kinds of `FieldKind.bodies`.
    """
    return name in (*DEFAULT, "all") or bool(FIELDS[name].bodies & kinds)


def field_rules(scene: Description, _: Any) -> Sentences:
    """Refuse fields that nothing in the scene has; those of the state may be without owner."""
    there = set[str]().union(*(body.field_kinds for body in scene.bodies))
    if scene.joints:
        there.add("joint")
    for name in scene.output.fields:
        if name in JUDGED and not scene.reserves:
            yield f"output: fields has '{name}'; the scene must have a Reserve"
        if not has_field(name, there):
            owners = " or ".join(OWNERS[kind] for kind in OWNERS if kind in FIELDS[name].bodies)
            yield f"output: fields has '{name}'; it must be left out, as there is no {owners}"


def reserve_rules(scene: Description, reserve: Reserve) -> Sentences:
    """Refuse reserve factors of shells that have no stresses, plies or strengths for them."""
    shell = scene.shell(reserve.body, said(reserve))
    who = said(shell)
    if "linear" not in shell.field_kinds:
        yield f"{who} has no stresses of plies; it must be a {OWNERS['linear']}"
    criterion, layers = CRITERIA[reserve.criterion], shell.section.generic.layers
    if max(reserve.plies, default=1) > len(layers):
        yield (
            f"{who} has {len(layers)} plies, and plies has {max(reserve.plies)}; numbers must be "
            f"from 1 to {len(layers)}"
        )
    for number in reserve.plies or range(1, len(layers) + 1):
        strength = layers[number - 1].strength
        material = f"{who}: the material of ply {number}"
        missing = [n for n in criterion.needs if getattr(strength, n, None) is None]
        if missing:
            needed = f"Strength({', '.join(f'{n}=...' for n in criterion.needs)})"
            yield (
                f"{material} has no {listed(missing)}; '{reserve.criterion}' needs {needed}, or "
                "plies must leave it out"
            )
        elif wrong := criterion.wrong(strength):
            yield (
                f"{material} {wrong}, of which '{reserve.criterion}' is no closed envelope; "
                "another criterion must be used"
            )


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
