"""Bodies, joints and coordinates to which parts of a scene refer."""

from typing import Any

from shellmb.errors import SceneError
from shellmb.scene.beams.beam import Beam
from shellmb.scene.description import Body, Description
from shellmb.scene.initial import InitialVelocity
from shellmb.scene.loads import contacts, loads, supports
from shellmb.scene.multibody.elements import Coordinate, Driver, JointElement
from shellmb.scene.multibody.joints import GROUND, Joint
from shellmb.scene.multibody.own_bodies import UserBody
from shellmb.scene.multibody.rigid import RigidBody
from shellmb.scene.probes import Probe
from shellmb.scene.shells.shell import Shell
from shellmb.scene.values.models import Modal
from shellmb.scene.values.validate import kind_of as kind_of
from shellmb.scene.values.validate import listed as listed
from shellmb.scene.values.validate import said as said

OURS = (Shell, Beam, RigidBody)
FRAMES = (Beam, RigidBody)
ANY = (*OURS, UserBody)
# what does not stand here acts on shells
ACTS_ON: dict[type, tuple[type, ...]] = {
    loads.Gravity: ANY,
    loads.PointForce: ANY,
    loads.LineForce: (Beam,),
    loads.FollowerLineForce: (Beam,),
    loads.LineMoment: (Beam,),
    loads.PointMoment: OURS,
    loads.FollowerForce: FRAMES,
    loads.FollowerMoment: FRAMES,
    supports.Clamped: (Shell, Beam, UserBody),
    supports.Hinged: (Shell, Beam, UserBody),
    supports.Fixed: (Shell, Beam, UserBody),
    supports.SymmetryPlane: (Shell, UserBody),
    supports.Driven: (Shell, UserBody),
    contacts.Potential: OURS,
    contacts.Contact: OURS,
    InitialVelocity: ANY,
    Probe: ANY,
}


def small_strains(body: Any) -> str:
    """Say of a body, by its name, that its strains are small; empty where they are not."""
    if isinstance(body.model, Modal):
        return f"{said(body)} is reduced to modes"
    return f"{said(body)} has linear strains" if body.linear else ""


def model_of(scene: Description, body: Any) -> Any:
    """Model of a shell or beam; of a beam that is glued to a shell in modes, or a rigid one, its.

    Args:
        scene: The scene.
        body: The shell or beam.
    """
    names = [glue.shell for glue in scene.glues if glue.beam == body.name]
    shells = [s for s in scene.shells if s.name in names]
    led = [s.model for s in shells if s.rigid or isinstance(s.model, Modal)]
    return led[0] if led else body.model


def kinds_of(item: Any) -> tuple[type, ...]:
    """Kinds of bodies that a support, load, initial velocity or probe can act on."""
    for kind, accepted in ACTS_ON.items():
        if isinstance(item, kind):
            return accepted
    # a load or support that a user derived acts wherever it says
    return (Shell,) if type(item).__module__.startswith("shellmb.") else OURS


def find_body(
    scene: Description, name: str | None, who: str, kinds: tuple[type, ...] = ANY, wanted: str = ""
) -> Any:
    """The body named ``name``, or the only one of the given kinds where that is None.

    Args:
        scene: The scene.
        name: A name or None.
        who: Who asks, for the error.
        kinds: Classes of bodies that will do.
        wanted: What they are called in the error; made from ``kinds`` if empty.

    Raises:
        SceneError: If there is no such body, it is of another kind, or the choice is open.
    """
    wanted = wanted or " or ".join(k.label for k in kinds)  # type: ignore[attr-defined]
    fitting = [b for b in scene.bodies if isinstance(b, kinds)]
    if name is None:
        if not fitting:
            raise SceneError(f"{who}: it acts on a {wanted}; the scene has none")
        if len(fitting) > 1:
            known = listed(b.name for b in fitting)
            raise SceneError(f"{who}: body is missing; it must be one of {known}")
        return fitting[0]
    for body in scene.bodies:
        if body.name == name:
            if isinstance(body, kinds):
                return body
            raise SceneError(f"{who}: '{name}' is a {kind_of(body)}; it must be a {wanted}")
    what = kind_of(fitting[0]) if len({type(b) for b in fitting}) == 1 else "body"
    known = listed(b.name for b in fitting) or "none"
    raise SceneError(f"{who}: there is no {what} '{name}'; the scene has {known}")


def with_places(body: Any, who: str) -> Any:
    """The body, which must have places.

    Raises:
        SceneError: If it is one of the user's own whose field is no displacement.
    """
    if not getattr(body, "placed", True):
        raise SceneError(
            f"{who}: {said(body)} has no places; its field must be a vector of three displacements "
            "on a Lagrange space"
        )
    return body


def find_shell(scene: Description, name: str | None, who: str) -> Shell:
    """The shell named ``name``, or the only one where that is None; see :func:`find_body`."""
    shell: Shell = find_body(scene, name, who, (Shell,))
    return shell


def find_end(scene: Description, name: str, who: str) -> Body | None:
    """The body at an end of a joint or element, None for the ground.

    Raises:
        SceneError: If there is no such body.
    """
    if name == GROUND:
        return None
    body: Body = with_places(find_body(scene, name, who), who)
    return body


def find_joint(scene: Description, name: str, who: str) -> Joint:
    """The joint named ``name``.

    Raises:
        SceneError: If there is none.
    """
    for joint in scene.joints:
        if joint.name == name:
            return joint
    known = listed(j.name for j in scene.joints) or "none"
    raise SceneError(f"{who}: there is no joint '{name}'; the scene has {known}")


def bodies_of(scene: Description, item: Any) -> tuple[Body, ...]:
    """The bodies that a support, load, initial velocity or probe acts on.

    Raises:
        SceneError: If there is no such body, it is of another kind, or the choice is open.
    """
    if item.body is None and isinstance(item, loads.Gravity | InitialVelocity):
        return tuple(body for body in scene.bodies if getattr(body, "placed", True))
    body = find_body(scene, item.body, said(item), kinds_of(item))
    return (with_places(body, said(item)),)


def coordinates_of(scene: Description, item: Any) -> tuple[Coordinate, ...]:
    """Coordinates of its joint on which a driver, lock or joint element acts.

    Raises:
        SceneError: If the joint has no such coordinate, or the choice is open.
    """
    lock = not hasattr(item, "name")
    who = f"lock of joint '{item.joint}'" if lock else said(item)
    joint = find_joint(scene, item.joint, who)
    chosen: tuple[Coordinate, ...]
    if isinstance(item, Driver):
        chosen = item.coordinates
    elif item.coordinate is not None:
        chosen = (item.coordinate,)
    else:
        chosen = joint.freedoms  # type: ignore[assignment]
        if isinstance(item, JointElement) and len(chosen) > 1:
            raise SceneError(
                f"{who}: coordinate is missing; {joint.said} has both 'rotation' and 'translation'"
            )
    if not joint.freedoms:
        raise SceneError(
            f"{who}: {joint.said} has no coordinate to act on; it must be a revolute, prismatic, "
            "cylindrical or screw joint"
        )
    for name in chosen:
        if name not in joint.freedoms:
            raise SceneError(
                f"{who}: {joint.said} has no {name}; it must be {listed(joint.freedoms)}"
            )
    return chosen
