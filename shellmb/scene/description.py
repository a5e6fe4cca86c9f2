"""Parts of a scene's description, each checked by itself; `Scene` checks the whole."""

from collections.abc import Callable
from dataclasses import KW_ONLY
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, SkipValidation

from shellmb.errors import SceneError
from shellmb.scene.beams.beam import Beam, Glue
from shellmb.scene.control.controllers import Law
from shellmb.scene.control.sensors import Event, Sensor, sensors_of
from shellmb.scene.initial import InitialVelocity, Starts
from shellmb.scene.loads.contacts import Contact, EnclosedVolume, Potential
from shellmb.scene.loads.loads import Gravity, Load
from shellmb.scene.loads.supports import Support
from shellmb.scene.lookup import ANY, kinds_of, with_places
from shellmb.scene.multibody import elements
from shellmb.scene.multibody.couplings import Coupled, Relation
from shellmb.scene.multibody.joints import GROUND, Joint
from shellmb.scene.multibody.rigid import RigidBody
from shellmb.scene.probes import Probe, Reserve
from shellmb.scene.schemes import LINEAR, Scheme, dissipation, is_static
from shellmb.scene.settings import Output, PathFollowing, Solver, StepControl
from shellmb.scene.shells.shell import Join, Shell
from shellmb.scene.types import NONE, NOTHING, Completed, Name, Several
from shellmb.scene.units import check_order, parse_units
from shellmb.scene.values.bodies import Ground, SceneBody, UserBody
from shellmb.scene.values.validate import described, listed, said

type Body = Shell | Beam | RigidBody | UserBody


def _units(value: str | None) -> str | None:
    check_order(parse_units(value))
    return value


@described("scene")
class Description:
    """All that a :class:`~shellmb.scene.Scene` has, each part checked by itself."""

    name: Name
    shells: Several[Shell] = NONE
    _: KW_ONLY
    supports: Several[Support] = NONE
    loads: Several[Load] = NONE
    joins: Several[Join] = NONE
    initial: Several[InitialVelocity] = NONE
    probes: Several[Probe] = NONE
    scheme: Annotated[str | Scheme, SkipValidation] = "static"
    alpha: Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)] | None = None
    # every scene that is made has both
    dt: Completed = NOTHING
    t_end: Completed = NOTHING
    solver: Solver = Solver()
    step_control: StepControl = StepControl()
    output: Output = Output()
    results: Callable[..., Any] | None = None
    beams: Several[Beam] = NONE
    rigid_bodies: Several[RigidBody] = NONE
    joints: Several[Joint] = NONE
    drivers: Several[elements.Driver] = NONE
    force_elements: Several[elements.Element] = NONE
    glues: Several[Glue] = NONE
    locks: Several[elements.Lock] = NONE
    assemble: bool = False
    start: Starts = "given"
    redundant: Literal["error", "drop"] = "error"
    path: PathFollowing | None = None
    potentials: Several[Potential] = NONE
    contacts: Several[Contact] = NONE
    volumes: Several[EnclosedVolume] = NONE
    units: Annotated[str | None, AfterValidator(_units)] = None
    controllers: Several[Law] = NONE
    events: Several[Event] = NONE
    errors: bool = False
    couplings: Several[Relation] = NONE
    own_bodies: Several[UserBody] = NONE
    reserves: Several[Reserve] = NONE

    @property
    def scheme_name(self) -> str:
        """Name of the scheme, also where it is an object."""
        return self.scheme if isinstance(self.scheme, str) else getattr(self.scheme, "name", "")

    @property
    def dissipation(self) -> float:
        """The ``alpha`` that its scheme works with: the given one, or the scheme's own."""
        return dissipation(self.scheme, self.alpha)

    @property
    def linear(self) -> bool:
        """Decide whether displacements are small, and all is linearised about the reference."""
        if isinstance(self.scheme, str):
            return self.scheme in LINEAR
        return bool(getattr(self.scheme, "linear", False))

    @property
    def static(self) -> bool:
        """Decide whether the scene has no velocities."""
        return is_static(self.scheme)

    @property
    def starts(self) -> tuple[Any, ...]:
        """Starts of the run, one after the other; empty if it starts as given."""
        items = self.start if isinstance(self.start, tuple) else (self.start,)
        return tuple(item for item in items if item != "given")

    @property
    def given_until(self) -> float:
        """Last time of what is prescribed; on a path the load factor takes the place of time."""
        return self.t_end if self.path is None else self.path.load_end or 1.0

    @property
    def bodies(self) -> tuple[Body, ...]:
        """All shells, beams, rigid bodies and bodies of the user's own."""
        return (*self.shells, *self.beams, *self.rigid_bodies, *self.own_bodies)

    @property
    def meshed(self) -> tuple[Shell | Beam, ...]:
        """All shells and beams."""
        return (*self.shells, *self.beams)

    @property
    def weights(self) -> tuple[Any, ...]:
        """The loads that are weights."""
        return tuple(load for load in self.loads if load.weighs)

    @property
    def prescribed(self) -> list[tuple[Any, str, Any]]:
        """Parts that move or grow as given, each with a name, and a number, a function or None."""
        parts: tuple[Any, ...] = (*self.volumes, *self.supports, *self.drivers)
        return [(part, name, value) for part in parts for name, value in part.given.items()]

    @property
    def tied(self) -> list[tuple[str, str]]:
        """Pairs of shells and beams that share nodes."""
        pairs = [(join.first, join.second) for join in self.joins]
        return pairs + [(glue.shell, glue.beam) for glue in self.glues]

    @property
    def coupled(self) -> list[Coupled]:
        """Coordinates of all couplings."""
        return [coupled for coupling in self.couplings for coupled in coupling.terms]

    @property
    def point_elements(self) -> tuple[elements.PointElement, ...]:
        """The force elements between points."""
        return tuple(e for e in self.force_elements if isinstance(e, elements.PointElement))

    @property
    def joint_elements(self) -> tuple[elements.JointElement, ...]:
        """The force elements on coordinates of joints."""
        return tuple(e for e in self.force_elements if isinstance(e, elements.JointElement))

    @property
    def acting_locks(self) -> tuple[elements.Lock, ...]:
        """The locks that an event switches, or of which a window begins before the scene's end."""
        end = self.t_end
        return tuple(
            k for k in self.locks if k.switch or any(start < end for start, _ in k.active or ())
        )

    @property
    def all_events(self) -> tuple[Event, ...]:
        """The events, also those of locks."""
        own = (lock.event for lock in self.locks)
        return (*self.events, *(event for event in own if event is not None))

    @property
    def sensors(self) -> tuple[Sensor, ...]:
        """All sensors that controllers and events read, each once."""
        found = [s for controller in self.controllers for s in controller.sensors]
        for event in self.all_events:
            found += (*sensors_of(event.when), *sensors_of(event.until))
        return tuple(dict.fromkeys(found))

    def body(
        self, name: str | None = None, who: str = "scene", kinds: tuple[type, ...] = ANY
    ) -> Body:
        """The body of that name, or the only one.

        Args:
            name: Its name, or None.
            who: Who asks, for the error.
            kinds: Classes of bodies that will do.

        Raises:
            SceneError: If there is none of that name, it is of another kind, or there is no name
                and several bodies.
        """
        wanted = " or ".join(k.label for k in kinds)  # type: ignore[attr-defined]
        named = None if name is None else next((b for b in self.bodies if b.name == name), None)
        if named is not None:
            if isinstance(named, kinds):
                return named
            raise SceneError(f"{who}: '{name}' is a {named.label}; it must be a {wanted}")
        fitting = [b for b in self.bodies if isinstance(b, kinds)]
        if name is None:
            if not fitting:
                raise SceneError(f"{who}: it acts on a {wanted}; the scene has none")
            if len(fitting) > 1:
                known = listed(b.name for b in fitting)
                raise SceneError(f"{who}: body is missing; it must be one of {known}")
            return fitting[0]
        what = fitting[0].label if len({type(b) for b in fitting}) == 1 else "body"
        known = listed(b.name for b in fitting) or "none"
        raise SceneError(f"{who}: there is no {what} '{name}'; the scene has {known}")

    def shell(self, name: str | None = None, who: str = "scene") -> Shell:
        """The shell of that name, or the only one.

        Args:
            name: Its name, or None.
            who: Who asks, for the error.

        Raises:
            SceneError: If there is none of that name, or no name and several shells.
        """
        shell: Any = self.body(name, who, (Shell,))
        return shell

    def end(self, name: str, who: str) -> SceneBody:
        """The body at an end of a joint or element.

        Raises:
            SceneError: If there is no such body.
        """
        return Ground() if name == GROUND else with_places(self.body(name, who), who)

    def joint(self, name: str, who: str = "scene") -> Joint:
        """The joint of that name.

        Args:
            name: Its name.
            who: Who asks, for the error.

        Raises:
            SceneError: If there is none.
        """
        for joint in self.joints:
            if joint.name == name:
                return joint
        known = listed(j.name for j in self.joints) or "none"
        raise SceneError(f"{who}: there is no joint '{name}'; the scene has {known}")

    def model_of(self, body: Any) -> Any:
        """Model of a shell or beam; of a beam glued to a shell in modes, or a rigid one, its."""
        names = [glue.shell for glue in self.glues if glue.beam == body.name]
        shells = [s for s in self.shells if s.name in names]
        led = [s.model for s in shells if s.rigid or s.modes]
        return led[0] if led else body.model

    def bodies_of(self, item: Any) -> tuple[Body, ...]:
        """Bodies that a support, load, potential, initial velocity or probe acts on.

        Raises:
            SceneError: If there is no such body, it is of another kind, or the choice is open.
        """
        if item.body is None and isinstance(item, Gravity | InitialVelocity):
            return tuple(body for body in self.bodies if body.placed)
        body = self.body(item.body, said(item), kinds_of(item))
        return (with_places(body, said(item)),)

    def coordinates_of(self, item: Any) -> tuple[elements.Coordinate, ...]:
        """Coordinates of its joint on which a driver, lock or joint element acts.

        Raises:
            SceneError: If the joint has no such coordinate, or the choice is open.
        """
        who = said(item)
        joint = self.joint(item.joint, who)
        chosen: tuple[elements.Coordinate, ...]
        if isinstance(item, elements.Driver):
            chosen = item.coordinates
        elif item.coordinate is not None:
            chosen = (item.coordinate,)
        else:
            chosen = joint.freedoms  # type: ignore[assignment]
            if hasattr(item, "name") and len(chosen) > 1:
                raise SceneError(
                    f"{who}: coordinate is missing; {joint.said} has both 'rotation' and "
                    "'translation'"
                )
        if not joint.freedoms:
            raise SceneError(
                f"{who}: {joint.said} has no coordinate to act on; it must be a revolute, "
                "prismatic, cylindrical or screw joint"
            )
        for name in chosen:
            if name not in joint.freedoms:
                raise SceneError(
                    f"{who}: {joint.said} has no {name}; it must be {listed(joint.freedoms)}"
                )
        return chosen
