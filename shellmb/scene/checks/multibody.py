"""Checks of what connects bodies, moves joints, and holds or loads the whole."""

import math
from collections.abc import Callable, Mapping
from typing import Any

from shellmb.errors import SceneError
from shellmb.scene.beams.beam import Beam, Glue
from shellmb.scene.beams.curves import AlongEdge, AlongLine
from shellmb.scene.checks.names import EDGES, check_place
from shellmb.scene.control.signals import Signal
from shellmb.scene.description import Description
from shellmb.scene.lookup import connected
from shellmb.scene.multibody.couplings import Relation
from shellmb.scene.multibody.elements import Driver, Lock, PointElement
from shellmb.scene.multibody.joints import GROUND, Joint, Rolling
from shellmb.scene.multibody.offsets import Offset
from shellmb.scene.probes import MOTIONS
from shellmb.scene.shells.shell import Shell
from shellmb.scene.values.bodies import SceneBody
from shellmb.scene.values.user_functions import finite_in_time
from shellmb.scene.values.validate import Sentences, error_of, listed, said, show


def joint_rules(scene: Description, joint: Joint) -> Sentences:
    """Refuse bodies that a joint cannot have, ends that are nowhere, and times outside of the run.

    Args:
        scene: The scene.
        joint: The joint.
    """
    first = scene.end(joint.first, joint.said)
    second = scene.end(joint.second, joint.said)
    if joint.along_edges:
        yield from _edge_hinge(joint, {"first": first, "second": second})
        return
    pairs = zip((first, second), joint.shells, ("first", "second"), strict=True)
    for body, allowed, which in pairs:
        if not (body.framed or allowed):
            yield (
                f"{which} is {said(body)}, whose nodes have no frame; it must be the ground, a "
                "rigid body or a beam, connected to it by a Weld (it is the second) or, to a "
                "shell, a ShellRevolute joint or an EdgeHinge along its edge"
            )
    along = second.region_names if joint.of_regions else ()
    if joint.of_regions and not second.directors and joint.second_at not in along:
        known = f"a region of {said(second)}: {listed(along) or 'none'}"
        yield "second_at", f"it must be {known}, because its nodes carry no moment"
    if joint.about_director and second.directors != 1:
        yield f"second is {said(second)}; it must be a shell, or use Weld"
    if joint.at is not None:
        _end(scene, joint.first, joint.at, joint.said)
    elif joint.first == GROUND or not first.single:
        yield f"at is missing; it must be given where the first body is {said(first)}"
    if joint.second_at is not None and joint.second_at not in along:
        _end(scene, joint.second, joint.second_at, joint.said)
    elif isinstance(joint, Rolling) and not second.single:
        centre = f"the centre of the wheel where the second body is {said(second)}"
        yield f"second_at is missing; it must be {centre}"
    for start, end in joint.active or ():
        if start < 0 or start >= scene.t_end:
            yield (
                f"active has the window ({start:g}, {end:g}); it must begin between 0 and the "
                f"scene's end {scene.t_end:g}"
            )
    if joint.rolls and scene.static:
        yield (
            f"the scheme is '{scene.scheme_name}'; it must be a dynamic one, because a contact "
            "holds velocities; in statics use an InPlane joint"
        )


def _edge_hinge(joint: Joint, bodies: Mapping[str, SceneBody]) -> Sentences:
    """Refuse ends of a hinge along edges."""
    first, second = bodies.values()
    if not any(body.directors == 1 for body in (first, second)):
        yield (
            f"neither {said(first)} nor {said(second)} is a shell; one of them must be, or use "
            "Revolute"
        )
    for where, at in (("first", "at"), ("second", "second_at")):
        body, name = bodies[where], getattr(joint, at)
        if body.directors != 1 and not body.single:
            yield f"{where} is {said(body)}; it must be a shell, a rigid body or the ground"
        if not body.single and name is None:
            known = listed(body.edge_names or ()) or "those of its mesh"
            yield f"{at} is missing; it must be an edge of {said(body)}: {known}"
        if not body.single:
            check_place(body, name, joint.said, EDGES)
        elif name is not None:
            yield (
                f"{at} is {show(name)} and {where} {said(body)}; it must be left out, as the edge "
                "of the shell says where the hinge is"
            )


def _end(scene: Description, name: str, at: Any, who: str) -> None:
    """Refuse one end of a joint or element."""
    body = scene.end(name, who)
    if name != GROUND:
        check_place(body, at, who)
    elif not isinstance(at, tuple):
        raise SceneError(
            f"{who}: the ground has no point {show(at)}; it must be given by coordinates (x, y, z)"
        )


def coordinate_rules(scene: Description, item: Any) -> Sentences:
    """Refuse what acts on no coordinate, on one that is given already, or on many by a law.

    Args:
        scene: The scene.
        item: A driver, a lock, an element of a joint, or a coordinate of a coupling.
    """
    scene.coordinates_of(item)
    joint: Any = scene.joint(item.joint)
    if isinstance(item, Lock) or not joint.along_edges or joint.rigid_angle:
        return
    if not (getattr(item, "stiffness", None) or getattr(item, "damping", None) is not None):
        yield (
            f"it acts on {joint.said}, which has an angle at each node, by a law or a given "
            "motion; the hinge must have rigid_angle=True, or the element a stiffness or damping, "
            "which are distributed along the edge"
        )


def check_ends(scene: Description, element: PointElement) -> None:
    """Check both ends of an element between points.

    Args:
        scene: The scene.
        element: The element.

    Raises:
        SceneError: If one is nowhere.
    """
    for body, at in ((element.first, element.at), (element.second, element.second_at)):
        _end(scene, body, at, said(element))


def check_prescribed(scene: Description, _: Any) -> None:
    """Check that coordinates are prescribed once.

    Args:
        scene: The scene.

    Raises:
        SceneError: Names who does it, too.
    """
    owners: dict[tuple[str, str], str] = {}
    items: tuple[Driver | Lock, ...] = (*scene.drivers, *scene.locks)
    for item in items:
        who = said(item)
        for coordinate in scene.coordinates_of(item):
            other = owners.setdefault((item.joint, coordinate), who)
            if other is not who:
                what = f"the {coordinate} of joint '{item.joint}' is already prescribed by {other}"
                raise error_of(item, f"{what}; it must be prescribed once")


def lock_rules(scene: Description, lock: Lock) -> Sentences:
    """Refuse windows before the run; one that begins after its end, if that is cut, is just gone.

    Args:
        scene: The scene.
        lock: The lock.
    """
    for start, end in lock.active or ():
        if start < 0:
            yield f"active has the window ({start:g}, {end:g}); it must begin at 0 or later"


def relation_rules(scene: Description, relation: Any) -> Sentences:
    """Refuse values over time that are none.

    Args:
        scene: The scene.
        relation: A joint or coupling.
    """
    for function in relation.given:
        if isinstance(function, Signal):
            yield (
                f"{show(function)} is no value over time; it must be a function of time, or a "
                "joint with a driver whose acceleration is commanded"
            )
        who = f"{relation.said}: value over time"
        finite_in_time(function, scene.given_until, who, 1, relation.above)


def coupling_rules(scene: Description, coupling: Relation) -> Sentences:
    """Refuse couplings of too few coordinates, of one to itself, and of others than rotations.

    Args:
        scene: The scene.
        coupling: The coupling.
    """
    terms = coupling.terms
    # a joint's name alone, and with its only coordinate, are one
    coupled = {(term.joint, scene.coordinates_of(term)[0]) for term in terms}
    if len(coupled) < max(len(terms), 2):
        names = show([term.joint for term in terms])
        yield f"its coordinates are {names}; it must have two or more, each once"
    for joint, coordinate in sorted(coupled) if coupling.turns else ():
        if coordinate != "rotation":
            yield (
                f"it turns, and the coordinate of joint '{joint}' is a {coordinate}; it must be a "
                "rotation, or the coupling a Gear, whose ratio may have a length"
            )


def glue_rules(scene: Description, glue: Glue) -> Sentences:
    """Refuse beams that are glued to what they do not follow.

    Args:
        scene: The scene.
        glue: The glue.
    """
    beam: Any = scene.body(glue.beam, "glue", (Beam,))
    shell = scene.shell(glue.shell, "glue")
    who, model = f"beam '{beam.name}'", scene.model_of(beam)
    if beam.along != shell.name:
        yield (
            f"{who} does not run along shell '{shell.name}'; its curve must be AlongEdge or "
            "AlongLine of that shell"
        )
    if beam.degree != shell.degree:
        yield f"{who} has degree {beam.degree}; it must be {shell.degree}, that of {said(shell)}"
    if sum(other.beam == beam.name for other in scene.glues) > 1:
        yield f"{who} is glued twice; it must be glued once"
    if beam.natural is not None and model != beam.model:
        yield (
            f"{who} has natural strains, and the model of shell '{shell.name}', which it follows, "
            f"is {show(model)}; natural must be left out, or the model of the shell be 'exact'"
        )


def beam_rules(scene: Description, beam: Beam) -> Sentences:
    """Refuse beams along shells that they are not glued to, and edges and points of no shell.

    Args:
        scene: The scene.
        beam: The beam.
    """
    curve = beam.curve
    if beam.along is None:
        return
    shell = scene.shell(beam.along, said(beam))
    if beam.name not in (glue.beam for glue in scene.glues):
        yield (
            f"it runs along shell '{shell.name}' and is not glued to it; the scene must have "
            f"Glue('{beam.name}', '{shell.name}')"
        )
    if isinstance(curve, AlongEdge):
        check_place(shell, curve.edge, said(beam), EDGES)
    elif isinstance(curve, AlongLine):
        for point in (curve.start, curve.end):
            check_place(shell, point, said(beam))


def probe_rules(scene: Description, probe: Any) -> Sentences:
    """Refuse quantities that the probe's body has not, and frames that cannot see it.

    Args:
        scene: The scene.
        probe: The probe.
    """
    (body,) = scene.bodies_of(probe)
    q = probe.quantity
    if probe.frame is not None:
        seeing = scene.body(probe.frame, f"{said(probe)}: frame")
        if not seeing.framed:
            yield (
                f"frame is {said(seeing)}, whose nodes have a director only; it must be a rigid "
                "body, or a beam with frame_at"
            )
        if probe.frame_at is not None:
            check_place(seeing, probe.frame_at, f"{said(probe)}: frame_at")
        elif seeing.nodal:
            yield f"frame_at is missing; it must be the node of {said(seeing)} whose frame it is"
    if q == "director" and not body.directors:
        yield f"quantity is 'director'; {said(body)} has none"
    if isinstance(probe.at, Offset) and q not in MOTIONS:
        yield f"quantity is {show(q)} and at an Offset; at must be a node"
    who = f"quantity is {show(q)} and the body {said(body)}; it must be"
    if q in Shell.quantities and q not in body.quantities:
        yield f"{who} a shell; of a beam record force and moment"
    if q == "shear" and probe.component == 2:
        yield "component is 2; it must be 0 (13), 1 (23) or 'norm' for the shear"
    if q in ("rotation", "angular_velocity") and not body.framed:
        yield f"{who} a beam or a rigid body; of a shell record the director"
    if q in Beam.quantities and q not in body.quantities:
        yield f"{who} a beam; of a shell record membrane, bending and shear"


def check_supported(scene: Description, _: Any) -> None:
    """Check that bodies are supported in equilibrium, and have mass in motion.

    Args:
        scene: The scene.

    Raises:
        SceneError: Names the first that is not, or has none.
    """
    if scene.static or "equilibrium" in scene.starts:
        what = "a static scene" if scene.static else "a scene that starts in equilibrium"
        supported = _supported(scene)
        for body in scene.bodies:
            if body.name not in supported:
                one = len(scene.shells) == len(scene.bodies)
                how = f"every {'shell or join' if one else 'body or connect'} it to one that is"
                moves = "nothing supports it, so it can move rigidly"
                raise error_of(body, f"{moves}; {what} must support {how} supported")
    if scene.static:
        return
    carried = _carried(scene)
    for body in scene.bodies:
        m, free = body.mass_given, body.single and (body.name in carried or body.of)
        if not (free or (m > 0 and math.isfinite(m))):
            right = f"greater than 0 with scheme '{scene.scheme_name}'{body.mass_remedy}"
            raise error_of(body, f"its {body.mass_word} is {m:g}; it must be {right}")


def _supported(scene: Description) -> set[str]:
    """Find which bodies are connected to the ground: by supports, joints, and other bodies."""
    pairs = [*scene.tied, *((joint.first, joint.second) for joint in scene.joints)]
    pairs += [(e.first, e.second) for e in scene.point_elements]
    pairs += [(body.name, GROUND) for s in scene.supports for body in scene.bodies_of(s)]
    pairs += [(body.name, body.of) for body in scene.bodies if body.of]
    # an elastic foundation, say; whether terms hold all motions is found out later
    pairs += [(body.name, GROUND) for body in scene.bodies if body.terms]
    # energies of the user's own may hold their bodies, too
    pairs += [(body.name, GROUND) for body in scene.own_bodies]
    pairs += [(b.name, GROUND) for p in scene.potentials for b in scene.bodies_of(p)]
    pairs += [
        (b.name, c.obstacle_body or GROUND) for c in scene.contacts for b in scene.bodies_of(c)
    ]
    return next(group for group in connected((GROUND,), pairs) if GROUND in group)


def _carried(scene: Description) -> set[str]:
    """Massless bodies that others carry along: welded to them, or driven in all that is free.

    What carries has mass, is the ground, or is carried itself.
    """
    driven = {(d.joint, c) for d in scene.drivers for c in d.coordinates}
    found: set[str] = set()
    ties = []
    for joint in scene.joints:
        held = [(joint.name, freedom) in driven for freedom in joint.freedoms]
        given = bool(held) and all(held) and not joint.along_edges
        if joint.active is None and (joint.of_regions or given):
            ties += [(joint, joint.first, joint.second), (joint, joint.second, joint.first)]
    for _ in ties:
        for joint, end, name in ties:
            other: Any = scene.end(name, joint.said)
            if name == GROUND:
                carries = not joint.of_regions
            elif other.single:
                carries = other.mass_given > 0 or name in found
            else:
                carries = other.directors == 3 or joint.second_at in other.region_names
            if carries:
                found.add(end)
    return found


# what the parts of a scene, by the names of its fields, are looked at for, in this order
RULES: tuple[tuple[str, Callable[[Description, Any], Sentences | None]], ...] = (
    ("joints", joint_rules),
    ("drivers locks", coordinate_rules),
    ("scene", check_prescribed),
    ("locks", lock_rules),
    ("joint_elements coupled", coordinate_rules),
    ("joints couplings", relation_rules),
    ("couplings", coupling_rules),
    ("point_elements", check_ends),
    ("glues", glue_rules),
    ("beams", beam_rules),
    ("probes", probe_rules),
)
