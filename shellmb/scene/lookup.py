"""Kinds of bodies on which parts of a scene act."""

from collections.abc import Iterable, Mapping
from typing import Any

from shellmb.errors import SceneError
from shellmb.scene.beams.beam import Beam
from shellmb.scene.initial import InitialVelocity
from shellmb.scene.loads import contacts, loads, supports
from shellmb.scene.multibody.rigid import RigidBody
from shellmb.scene.probes import Probe
from shellmb.scene.shells.shell import Shell
from shellmb.scene.values.bodies import UserBody
from shellmb.scene.values.validate import listed as listed
from shellmb.scene.values.validate import said as said

OURS = (Shell, Beam, RigidBody)
ANY = (*OURS, UserBody)
# what does not stand here acts on shells
ACTS_ON: dict[tuple[type, ...], tuple[type, ...]] = {
    (loads.Gravity, loads.PointForce, InitialVelocity, Probe): ANY,
    (loads.LineForce, loads.FollowerLineForce, loads.LineMoment): (Beam,),
    (loads.PointMoment, contacts.Potential, contacts.Contact): OURS,
    (loads.FollowerForce, loads.FollowerMoment): (Beam, RigidBody),
    (supports.Clamped, supports.Hinged, supports.Fixed): (Shell, Beam, UserBody),
    (supports.SymmetryPlane, supports.Driven): (Shell, UserBody),
}


def small_strains(body: Any) -> str:
    """Say of a body, by its name, that its strains are small; empty where they are not."""
    if body.modes:
        return f"{said(body)} is reduced to modes"
    return f"{said(body)} has linear strains" if body.linear else ""


def kinds_of(item: Any) -> tuple[type, ...]:
    """Kinds of bodies that a support, load, initial velocity or probe can act on."""
    for kinds, accepted in ACTS_ON.items():
        if isinstance(item, kinds):
            return accepted
    # a load or support that a user derived acts wherever it says
    return (Shell,) if type(item).__module__.startswith("shellmb.") else OURS


def by_kind[T](table: Mapping[type, T], item: Any) -> T | None:
    """Entry of a table for a part of a scene: that of its class, or of what a user derived it from.

    Args:
        table: The entries by class.
        item: The part.
    """
    return next((table[kind] for kind in type(item).__mro__ if kind in table), None)


def of_kind[T](table: Mapping[type, T], item: Any) -> T:
    """Entry of a table as by `by_kind`, which must have one.

    Raises:
        SceneError: If there is none: a user derived the part from no bundled kind.
    """
    if (found := by_kind(table, item)) is None:
        kinds = listed(kind.__name__ for kind in table)
        name = f"{said(item)}: {type(item).__name__}"
        raise SceneError(f"{name} has no equations; it must be one of {kinds}, or derived from one")
    return found


def connected[T](names: Iterable[T], pairs: Iterable[tuple[T, T]]) -> list[set[T]]:
    """Groups of names, or of other things, that pairs connect.

    Args:
        names: Names that may be in no pair.
        pairs: The pairs.
    """
    groups = [{name} for name in names]
    for pair in pairs:
        joined = [group for group in groups if not group.isdisjoint(pair)]
        groups = [group for group in groups if group.isdisjoint(pair)]
        groups.append(set(pair).union(*joined))
    return groups


def with_places(body: Any, who: str) -> Any:
    """The body, which must have places.

    Raises:
        SceneError: If it is one of the user's own whose field is no displacement.
    """
    if not body.placed:
        raise SceneError(
            f"{who}: {said(body)} has no places; its field must be a vector of three displacements "
            "on a Lagrange space"
        )
    return body
