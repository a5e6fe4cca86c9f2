"""Parts of a scene's description, each checked by itself; `Scene` checks the whole."""

from collections.abc import Callable
from dataclasses import KW_ONLY
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, SkipValidation

from shellmb.scene.beams.beam import Beam, Glue
from shellmb.scene.control.controllers import Law
from shellmb.scene.control.sensors import Event, Sensor, sensors_of
from shellmb.scene.initial import InitialVelocity, Starts
from shellmb.scene.loads.contacts import Contact, EnclosedVolume, Potential
from shellmb.scene.loads.loads import Load
from shellmb.scene.loads.supports import Support
from shellmb.scene.multibody.couplings import Relation
from shellmb.scene.multibody.elements import Driver, Element, Lock
from shellmb.scene.multibody.joints import Joint
from shellmb.scene.multibody.own_bodies import UserBody
from shellmb.scene.multibody.rigid import RigidBody
from shellmb.scene.probes import Probe, Reserve
from shellmb.scene.schemes import LINEAR, Scheme, dissipation, is_static
from shellmb.scene.settings import Output, PathFollowing, Solver, StepControl
from shellmb.scene.shells.shell import Join, Shell
from shellmb.scene.types import NONE, NOTHING, Completed, Name, Several
from shellmb.scene.units import check_order, parse_units
from shellmb.scene.values.validate import described

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
    drivers: Several[Driver] = NONE
    force_elements: Several[Element] = NONE
    glues: Several[Glue] = NONE
    locks: Several[Lock] = NONE
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
        return (
            self.scheme if isinstance(self.scheme, str) else str(getattr(self.scheme, "name", ""))
        )

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
        return (self.t_end or 0.0) if self.path is None else self.path.load_end or 1.0

    @property
    def bodies(self) -> tuple[Body, ...]:
        """All shells, beams, rigid bodies and bodies of the user's own."""
        return (*self.shells, *self.beams, *self.rigid_bodies, *self.own_bodies)

    @property
    def meshed(self) -> tuple[Shell | Beam, ...]:
        """All shells and beams."""
        return (*self.shells, *self.beams)

    @property
    def acting_locks(self) -> tuple[Lock, ...]:
        """The locks that an event switches, or of which a window begins before the scene's end."""
        end = self.t_end or 0.0
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
