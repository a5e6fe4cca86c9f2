"""Colours: a field and its component over all bodies that have it, with one scale."""

from dataclasses import dataclass

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.observers.files.described import Described
from shellmb.scene.fields import FIELDS
from shellmb.scene.lookup import listed
from shellmb.show.fields import Fields
from shellmb.show.space.shapes import Shape, State, deformation, read_state

# displacements without the motion of the body as a whole
DEFORMATION = "deformation"
# what shows that a body of a mechanism is strained, the first one that there is
STRAINED = ("N", "M", "Q", "force", "moment", "energy_density")
# parts that are marks and no bodies with values of their own
MARKS = ("rigid bodies", "joints", "solids", "obstacles")
# of these nothing has a colour by its value
PLAIN = ("joints", "solids", "obstacles")


@dataclass(frozen=True)
class Colouring:
    """Field and scale that the colours show.

    Args:
        field: Name of the field, or `DEFORMATION`.
        component: Number of the component; None: the magnitude.
        label: What stands at the scale.
    """

    field: str
    component: int | None
    label: str


def colouring(
    fields: Fields,
    described: Described,
    field: str | None = None,
    component: str | int | None = None,
) -> Colouring:
    """Field and scale that the colours show.

    Args:
        fields: The fields.
        described: The scene.
        field: As requested; None: in mechanisms resultants, or what is left of displacements
            without the motion of each body as a whole; elsewhere the displacement.
        component: Name or number of a component; None: the magnitude.

    Raises:
        SceneError: If nothing has such a field or component.
    """
    known: dict[str, tuple[str, ...]] = {}
    for name in fields:
        if name not in PLAIN:
            file, t = next(iter(fields.states(name).items()))
            known = read_state(file, t).components | known
    if field is None:
        moves = described.dynamic and bool(described.joints) and any(n not in MARKS for n in fields)
        strained = next((f for f in STRAINED if f in known), DEFORMATION)
        field = strained if moves else "displacement"
    if field not in known and field != DEFORMATION:
        raise SceneError(
            f"picture: field is '{field}'; the run has {listed([*known, DEFORMATION])}: name it in "
            "Output(fields=...) of the scene"
        )
    named = known.get(field, ())
    number = _component(field, named, component)
    kind = FIELDS.get(field)
    text = kind.what if kind is not None else field.replace("_", " ")
    if named:
        text += "" if number is None else f", {named[number]}"
    one = named[number] if named and number is not None else None
    unit = described.labels.of("length" if kind is None else kind.quantity_of(one))
    # VTK takes strokes for the borders of columns
    sized = f"size of {text}" if named and number is None and field != "displacement" else text
    return Colouring(field, number, f"{sized} [{unit}]" if unit else sized)


def _component(field: str, named: tuple[str, ...], component: str | int | None) -> int | None:
    if component is None or (component == "norm"):
        return None
    axes = dict(zip(("x", "y", "z"), range(3), strict=True)) if len(named) == 3 else {}
    numbers = axes | {n: k for k, n in enumerate(named)}
    if isinstance(component, int) and 0 <= component < len(named):
        return component
    if component in numbers:
        return numbers[str(component)]
    there = listed(named) if named else "none, it is a scalar"
    raise SceneError(
        f"picture: component is {component!r}; '{field}' has {there}, and 'norm', its magnitude"
    )


def values(shape: Shape, state: State, shown: Colouring) -> Floats | None:
    """Values at the nodes of a body, shape (n,); None where it has none.

    Args:
        shape: The body.
        state: Its state.
        shown: What the colours show.
    """
    if shown.field == DEFORMATION:
        return None if shape.name in MARKS else deformation(shape.reference, state.position)
    found = state.arrays.get(shown.field)
    if found is None or shape.name in PLAIN:
        return None
    if found.ndim == 1:
        return found
    if shown.component is not None:
        return np.asarray(found[:, shown.component])
    return np.asarray(np.linalg.norm(found, axis=1))
