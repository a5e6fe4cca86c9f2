"""Check that the fields that a scene asks for are those of its bodies."""

from shellmb.errors import SceneError
from shellmb.scene.description import Description
from shellmb.scene.fields import DEFAULT, FIELDS, JUDGED
from shellmb.scene.shells.strength import CRITERIA
from shellmb.scene.values.validate import error_of, listed, said

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


def check_fields(scene: Description) -> None:
    """Refuse fields that nothing in the scene has.

    Raises:
        SceneError: If there is one; those of the state alone may be without owner.
    """
    there = set[str]().union(*(body.field_kinds for body in scene.bodies))
    if scene.joints:
        there.add("joint")
    for name in scene.output.fields:
        if name in JUDGED and not scene.reserves:
            raise error_of(scene, f"output: fields has '{name}'; the scene must have a Reserve")
        if has_field(name, there):
            continue
        owners = " or ".join(OWNERS[kind] for kind in OWNERS if kind in FIELDS[name].bodies)
        raise error_of(
            scene, f"output: fields has '{name}'; it must be left out, as there is no {owners}"
        )


def check_reserves(scene: Description) -> None:
    """Refuse reserve factors of shells that have no stresses, plies or strengths for them.

    Raises:
        SceneError: At the first.
    """
    for reserve in scene.reserves:
        shell = scene.shell(reserve.body, said(reserve))
        who = f"{said(reserve)}: {said(shell)}"
        if "linear" not in shell.field_kinds:
            raise SceneError(f"{who} has no stresses of plies; it must be a {OWNERS['linear']}")
        criterion, layers = CRITERIA[reserve.criterion], shell.section.generic.layers
        if max(reserve.plies, default=1) > len(layers):
            raise SceneError(
                f"{who} has {len(layers)} plies, and plies has {max(reserve.plies)}; numbers must "
                f"be from 1 to {len(layers)}"
            )
        for number in reserve.plies or range(1, len(layers) + 1):
            strength = layers[number - 1].strength
            material = f"{who}: the material of ply {number}"
            missing = [n for n in criterion.needs if getattr(strength, n, None) is None]
            if missing:
                raise SceneError(
                    f"{material} has no {listed(missing)}; '{reserve.criterion}' needs "
                    f"Strength({', '.join(f'{n}=...' for n in criterion.needs)}), or plies must "
                    "leave it out"
                )
            wrong = criterion.wrong(strength)
            if wrong:
                raise SceneError(
                    f"{material} {wrong}, of which '{reserve.criterion}' is no closed envelope; "
                    "another criterion must be used"
                )
