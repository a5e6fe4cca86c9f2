"""Checks of what connects bodies, moves joints, and holds or loads the whole."""

import math
from typing import Any

from shellmb.errors import SceneError
from shellmb.scene.beams.beam import Beam
from shellmb.scene.beams.curves import AlongEdge, AlongLine
from shellmb.scene.checks.locations import EDGES, check_place
from shellmb.scene.control.signals import Signal
from shellmb.scene.description import Description
from shellmb.scene.loads.supports import Fixed
from shellmb.scene.multibody.couplings import Coupled
from shellmb.scene.multibody.elements import Driver, Lock
from shellmb.scene.multibody.joints import (
    GROUND,
    Cylindrical,
    Distance,
    Joint,
    Prismatic,
    Revolute,
    Screw,
    ShellRevolute,
)
from shellmb.scene.multibody.offsets import Offset
from shellmb.scene.multibody.rolling import Rolling
from shellmb.scene.probes import MOTIONS
from shellmb.scene.shells.shell import Shell
from shellmb.scene.values.bodies import SceneBody
from shellmb.scene.values.user_functions import finite_in_time
from shellmb.scene.values.validate import error_of, listed, said, show

# joints whose second body has no motion of its own where all of their coordinates are driven
DRIVEN = (Revolute, Prismatic, Cylindrical, Screw)


def check(scene: Description) -> None:
    """Check joints, drivers, force elements, glues, probes, and that a solution is possible.

    Raises:
        SceneError: At the first thing that is impossible.
    """
    for joint in scene.joints:
        _joint(scene, joint)
    _coordinates(scene)
    for element in scene.point_elements:
        for body, at in ((element.first, element.at), (element.second, element.second_at)):
            _end(scene, body, at, said(element))
    _glues(scene)
    for probe in scene.probes:
        _quantity(scene, probe)
    for support in scene.supports:
        if isinstance(support, Fixed):
            _directors(scene, support)
    if scene.static or "equilibrium" in scene.starts:
        _supported(scene)
    if not scene.static:
        _massive(scene)


def _joint(scene: Description, joint: Joint) -> None:
    first = scene.end(joint.first, joint.said)
    second = scene.end(joint.second, joint.said)
    if joint.along_edges:
        _edge_hinge(scene, joint, (first, second))
        return
    for body, allowed, which in zip(
        (first, second), joint.shells, ("first", "second"), strict=True
    ):
        if not (body.framed or allowed):
            raise SceneError(
                f"{joint.said}: {which} is {said(body)}, whose nodes have no frame; it must "
                "be the ground, a rigid body or a beam, connected to it by a Weld or, to a shell, "
                "a ShellRevolute joint or an EdgeHinge along its edge"
            )
    if joint.of_regions and not second.directors:
        if joint.second_at not in second.region_names:
            known = listed(second.region_names) or "none"
            raise SceneError(
                f"{joint.said}: second_at is {show(joint.second_at)}; it must be a region of "
                f"{said(second)}: {known}, because its nodes carry no moment"
            )
    if isinstance(joint, ShellRevolute) and second.directors != 1:
        raise error_of(joint, f"second is {said(second)}; it must be a shell, or use Weld")
    if joint.at is None:
        if joint.first == GROUND or not first.single:
            raise error_of(
                joint, f"at is missing; it must be given where the first body is {said(first)}"
            )
    else:
        _end(scene, joint.first, joint.at, joint.said)
    along = second.region_names if joint.of_regions else ()
    if joint.second_at is not None and joint.second_at not in along:
        _end(scene, joint.second, joint.second_at, joint.said)
    elif isinstance(joint, Rolling) and not second.single:
        raise SceneError(
            f"{joint.said}: second_at is missing; it must be the centre of the wheel where the "
            f"second body is {said(second)}"
        )
    _within_time(scene, joint.active, f"{joint.said}: active")
    if joint.rolls and scene.static:
        raise SceneError(
            f"{joint.said}: the scheme is '{scene.scheme_name}'; it must be a dynamic one, because "
            "a contact holds velocities; in statics use an InPlane joint"
        )


def _edge_hinge(scene: Description, joint: Any, bodies: tuple[SceneBody, SceneBody]) -> None:
    """A hinge along edges: its ends, and what may act on many angles."""
    who = joint.said
    if not any(body.directors == 1 for body in bodies):
        raise SceneError(
            f"{who}: neither {said(bodies[0])} nor {said(bodies[1])} is a shell; one of "
            "them must be, or use Revolute"
        )
    for body, where, name, at in zip(
        bodies, ("first", "second"), (joint.at, joint.second_at), ("at", "second_at"), strict=True
    ):
        if body.directors != 1 and not body.single:
            raise SceneError(
                f"{who}: {where} is {said(body)}; it must be a shell, a rigid body or the ground"
            )
        if not body.single:
            if name is None:
                known = listed(body.edge_names or ()) or "those of its mesh"
                raise SceneError(
                    f"{who}: {at} is missing; it must be an edge of {said(body)}: {known}"
                )
            check_place(body, name, who, EDGES)
        elif name is not None:
            raise SceneError(
                f"{who}: {at} is {show(name)} and {where} {said(body)}; it must be left out, "
                "as the edge of the shell says where the hinge is"
            )
    if joint.rigid_angle:
        return
    for item in (*scene.drivers, *scene.force_elements, *_coupled(scene)):
        if getattr(item, "joint", None) != joint.name:
            continue
        linear = getattr(item, "stiffness", None) or getattr(item, "damping", None) is not None
        if not linear:
            raise SceneError(
                f"{said(item)}: it acts on {who}, which has an angle at each node, by a law or a "
                "given motion; the hinge must have rigid_angle=True, or the element a stiffness or "
                "damping, which are distributed along the edge"
            )


def _end(scene: Description, name: str, at: Any, who: str) -> None:
    """One end of a joint or element."""
    body = scene.end(name, who)
    if name != GROUND:
        check_place(body, at, who)
    elif not isinstance(at, tuple):
        raise SceneError(
            f"{who}: the ground has no point {show(at)}; it must be given by coordinates (x, y, z)"
        )


def _within_time(
    scene: Description, windows: tuple[tuple[float, float], ...] | None, who: str
) -> None:
    for start, end in windows or ():
        if start < 0 or start >= scene.t_end:
            raise SceneError(
                f"{who} has the window ({start:g}, {end:g}); it must begin between 0 and the "
                f"scene's end {scene.t_end:g}"
            )


def _coordinates(scene: Description) -> None:
    """Drivers, locks and joint elements: the joint's coordinates, each prescribed once."""
    owners: dict[tuple[str, str], str] = {}
    items: tuple[Driver | Lock, ...] = (*scene.drivers, *scene.locks)
    for item in items:
        who = said(item) if hasattr(item, "name") else f"lock of joint '{item.joint}'"
        for coordinate in scene.coordinates_of(item):
            other = owners.setdefault((item.joint, coordinate), who)
            if other is not who:
                raise SceneError(
                    f"{who}: the {coordinate} of joint '{item.joint}' is already prescribed by "
                    f"{other}; it must be prescribed once"
                )
    for driver in scene.drivers:
        for name, function in driver.given.items():
            finite_in_time(function, scene.t_end, f"{said(driver)}: {name}", 1)
    for lock in scene.locks:
        # one that begins after the end, as of a run that is cut short, is just not there
        for start, end in lock.active or ():
            if start < 0:
                raise SceneError(
                    f"lock of joint '{lock.joint}': active has the window ({start:g}, {end:g}); "
                    "it must begin at 0 or later"
                )
    for element in (*scene.joint_elements, *_coupled(scene)):
        scene.coordinates_of(element)
    relations: tuple[Any, ...] = (*scene.joints, *scene.couplings)
    for relation in relations:
        for function in relation.given:
            if isinstance(function, Signal):
                raise SceneError(
                    f"{relation.said}: {show(function)} is no value over time; it must be a "
                    "function of time, or a joint with a driver whose acceleration is commanded"
                )
            finite_in_time(function, scene.given_until, f"{relation.said}: value over time", 1)
    for joint in scene.joints:
        if isinstance(joint, Distance) and any(f(0.0) <= 0 for f in joint.given):
            raise SceneError(
                f"{joint.said}: length begins as {joint.given[0](0.0):g}; it must be greater than 0"
            )


def _coupled(scene: Description) -> list[Coupled]:
    """Coordinates of all couplings."""
    return [coupled for coupling in scene.couplings for coupled in coupling.terms]


def _glues(scene: Description) -> None:
    glued: set[str] = set()
    for glue in scene.glues:
        beam: Any = scene.body(glue.beam, "glue", (Beam,))
        shell = scene.shell(glue.shell, "glue")
        if beam.along != shell.name:
            raise SceneError(
                f"glue: beam '{beam.name}' does not run along shell '{shell.name}'; its curve must "
                "be AlongEdge or AlongLine of that shell"
            )
        if beam.degree != shell.degree:
            raise SceneError(
                f"glue: beam '{beam.name}' has degree {beam.degree}; it must be {shell.degree}, "
                f"that of shell '{shell.name}'"
            )
        if beam.name in glued:
            raise SceneError(f"glue: beam '{beam.name}' is glued twice; it must be glued once")
        glued.add(beam.name)
        model = scene.model_of(beam)
        if beam.natural is not None and model != beam.model:
            raise SceneError(
                f"glue: beam '{beam.name}' has natural strains, and the model of shell "
                f"'{shell.name}', which it follows, is {show(model)}; natural must be left out, or "
                "the model of the shell be 'exact'"
            )
    for beam in scene.beams:
        if beam.along is None:
            continue
        shell = scene.shell(beam.along, said(beam))
        if beam.name not in glued:
            raise SceneError(
                f"beam '{beam.name}': it runs along shell '{shell.name}' and is not glued to it; "
                f"the scene must have Glue('{beam.name}', '{shell.name}')"
            )
        if isinstance(beam.curve, AlongEdge):
            check_place(shell, beam.curve.edge, said(beam), EDGES)
        elif isinstance(beam.curve, AlongLine):
            for point in (beam.curve.start, beam.curve.end):
                check_place(shell, point, said(beam))


def _quantity(scene: Description, probe: Any) -> None:
    """Check that the probe's body has what it records, and that the frame that sees it is one."""
    (body,) = scene.bodies_of(probe)
    q = probe.quantity
    if probe.frame is not None:
        _frame(scene, probe)
    if q == "director" and not body.directors:
        raise SceneError(f"{said(probe)}: quantity is 'director'; {said(body)} has none")
    if isinstance(probe.at, Offset) and q not in MOTIONS:
        raise error_of(probe, f"quantity is {show(q)} and at an Offset; at must be a node")
    if q in Shell.quantities and q not in body.quantities:
        needed = "a shell; of a beam record force and moment"
    elif q == "shear" and probe.component == 2:
        raise error_of(probe, "component is 2; it must be 0 (13), 1 (23) or 'norm' for the shear")
    elif q in ("rotation", "angular_velocity") and not body.framed:
        needed = "a beam or a rigid body; of a shell record the director"
    elif q in Beam.quantities and q not in body.quantities:
        needed = "a beam; of a shell record membrane, bending and shear"
    else:
        return
    raise error_of(probe, f"quantity is {show(q)} and the body {said(body)}; it must be {needed}")


def _frame(scene: Description, probe: Any) -> None:
    """The body whose frame a probe's motion is seen from."""
    body = scene.body(probe.frame, f"{said(probe)}: frame")
    if not body.framed:
        raise SceneError(
            f"{said(probe)}: frame is {said(body)}, whose nodes have a director only; it must be a "
            "rigid body, or a beam with frame_at"
        )
    if probe.frame_at is not None:
        check_place(body, probe.frame_at, f"{said(probe)}: frame_at")
    elif body.nodal:
        raise error_of(
            probe, f"frame_at is missing; it must be the node of {said(body)} whose frame it is"
        )


def _directors(scene: Description, support: Fixed) -> None:
    (body,) = scene.bodies_of(support)
    if body.directors != 1 and any(c is not None for c in support.director):
        raise SceneError(
            f"fixed components: director is {show(support.director)} on {said(body)}; it must be "
            "left out, because only a shell has one: use Clamped or a joint to the ground"
        )


def _supported(scene: Description) -> None:
    """In equilibrium every group of connected bodies needs a support or a joint to the ground."""
    what = "a static scene" if scene.static else "a scene that starts in equilibrium"
    group = {name: name for name in (GROUND, *(b.name for b in scene.bodies))}
    pairs = [(join.first, join.second) for join in scene.joins]
    pairs += [(joint.first, joint.second) for joint in scene.joints]
    pairs += [(glue.beam, glue.shell) for glue in scene.glues]
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
    for first, second in pairs:
        old, new = group[first], group[second]
        group = {name: new if g == old else g for name, g in group.items()}
    for body in scene.bodies:
        if group[body.name] == group[GROUND]:
            continue
        how = "shell or join" if len(scene.shells) == len(scene.bodies) else "body or connect"
        raise SceneError(
            f"{said(body)}: nothing supports it, so it can move rigidly; {what} must "
            f"support every {how} it to one that is supported"
        )


def _carried(scene: Description) -> set[str]:
    """Massless bodies that others carry along: welded to them, or driven in all that is free.

    What carries has mass, is the ground, or is carried itself.
    """
    driven = {(d.joint, c) for d in scene.drivers for c in d.coordinates}
    found: set[str] = set()
    ties = [
        (joint, end, other)
        for joint in scene.joints
        if joint.active is None
        and (
            joint.of_regions
            or (
                isinstance(joint, DRIVEN)
                and all((joint.name, freedom) in driven for freedom in joint.freedoms)
            )
        )
        for end, other in ((joint.first, joint.second), (joint.second, joint.first))
    ]
    for _ in ties:
        for joint, end, name in ties:
            other: Any = scene.end(name, joint.said)
            if name == GROUND:
                carries = isinstance(joint, DRIVEN)
            elif other.single:
                carries = other.mass_given > 0 or name in found
            else:
                carries = other.directors == 3 or joint.second_at in other.region_names
            if carries:
                found.add(end)
    return found


def _massive(scene: Description) -> None:
    """In motion every body needs mass, but those that others carry along."""
    carried = _carried(scene)
    for body in scene.bodies:
        m, free = body.mass_given, body.single and (body.name in carried or body.of)
        if not (free or (m > 0 and math.isfinite(m))):
            raise SceneError(
                f"{said(body)}: its {body.mass_word} is {m:g}; it must be greater than 0 with "
                f"scheme '{scene.scheme_name}'{body.mass_remedy}"
            )
