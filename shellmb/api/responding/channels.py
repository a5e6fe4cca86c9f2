"""Inputs and outputs of linear systems: loads, motors, motions and ground; probes and joints."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial, update_wrapper
from typing import Any

import numpy as np
import scipy.sparse as sp
import ufl
from dolfinx import fem
from ufl.algorithms.ad import expand_derivatives

from shellmb.api.responding.system import GROUND
from shellmb.arrays import Floats, Ints
from shellmb.errors import SceneError
from shellmb.model.locations.nodes import local_nodes
from shellmb.model.sections.branches import branches_of
from shellmb.model.signals import Signals
from shellmb.observers.fields.modal import modal_members
from shellmb.observers.fields.nodal import Nodes
from shellmb.observers.fields.resultants import RESULTANTS, Resultants
from shellmb.observers.forces.joints import Span, column_names, joints_of, parts_of
from shellmb.observers.probes import linear, places_of, spot_of
from shellmb.running.rotating.linearised import Linearised
from shellmb.scene import Gravity, Motor, Probe, Scene
from shellmb.scene.control.signals import Commanded, Input
from shellmb.scene.schemes import SIMPLEST
from shellmb.sensitivity.adjoint.objective import FOURTH

AXES = "xyz"
# rotations are differentiated by central differences over this angle and twice it, rad
ANGLE = 1e-3


class Perturbation:
    """A function of time of a scene, or a law of a motor, with a number that is added to it.

    Args:
        given: What the scene has; None: nothing, or the factor 1 of a load.
        idle: Whether it is zero about the state.

    Attributes:
        extra: The number.
    """

    def __init__(self, given: Any = None, idle: bool = False) -> None:
        self._given, self.idle, self.extra = given, idle, 0.0
        self._constants: list[fem.Constant] = []

    def __call__(self, t: float) -> float:
        """Value at a time."""
        own = 0.0 if self.idle else 1.0 if self._given is None else float(self._given(t))
        return own + self.extra

    @property
    def driving(self) -> dict[str, Any]:
        """Arguments of a motor."""
        law = partial(self.law)
        # errors name what the scene has
        return {"law": law if self._given is None else update_wrapper(law, self._given)}

    def still(self, t: float) -> float:
        """Small part of a motion that stands still in its frame."""
        return self.extra

    def law(self, coordinate: Any, rate: Any, time: Any) -> Any:
        """Law of a motor."""
        added = fem.Constant(time.ufl_domain(), 0.0)
        self._constants.append(added)
        value = 0.0 if self._given is None else self._given(coordinate, rate, time)
        with suppress(TypeError, ValueError):
            return value + added
        # which is none
        return value

    def add(self, number: float) -> None:
        """Add a number."""
        self.extra = number
        for constant in self._constants:
            constant.value = number  # type: ignore[assignment]


class Commanding(Perturbation):
    """Command of a motor with a number that is added to it.

    Args:
        command: An input.
    """

    def __init__(self, command: Input) -> None:
        super().__init__()
        self._command = Input(command.name, command.default)

    @property
    def driving(self) -> dict[str, Any]:
        """Arguments of a motor."""
        return {"command": self._command}

    def add(self, number: float) -> None:
        """Add a number."""
        self.extra = number
        value = self._command.default + number
        self._command.take(0.0, 0.0, value, value)


def without_commands(scene: Scene, control: Mapping[str, Any] | None = None) -> Scene:
    """A scene without controllers: motors and loads have what is commanded at a state.

    Motors take it as inputs, as another program's commands are, which have their defaults.

    Args:
        scene: The scene.
        control: State of its controllers, as `Control.state` gives it; None: they command nothing.

    Raises:
        SceneError: If a controller moves a driver.
    """
    signals = Signals(scene)
    samplers = [] if control is None else control["samplers"]
    for controller, sampler in zip(scene.controllers, samplers, strict=control is not None):
        for output, value in sampler["outputs"].items():
            signals.command(0.0, (controller.name, output), value)

    def told(motor: Any) -> Any:
        return replace(motor, command=Input(motor.name, signals.held(motor.command)))

    def timed(load: Any) -> Any:
        held = signals(load.time, 0.0)
        return replace(load, time=lambda t: held)

    for driver in scene.drivers:
        for name in driver.coordinates:
            if isinstance(getattr(driver, name), Commanded):
                raise SceneError(
                    f"linearise: driver '{driver.name}' moves by a controller; give its {name} as "
                    "a function of time, or let a motor take the command"
                )
    return replace(
        scene,
        force_elements=tuple(e if e.command is None else told(e) for e in scene.force_elements),
        loads=tuple(timed(e) if isinstance(e.time, Commanded) else e for e in scene.loads),
        controllers=(),
    )


def _moved(
    given: Callable[[float], Any], parts: Sequence[Perturbation]
) -> Callable[[float], Floats]:
    """A translation in time with numbers added to its components."""
    return lambda t: np.asarray(given(t), dtype=float) + [part.extra for part in parts]


def with_inputs(
    scene: Scene, control: Mapping[str, Any] | None = None
) -> tuple[Scene, dict[str, Perturbation]]:
    """A scene in which numbers can be added to all inputs, and these by name.

    Loads are `load1`, `load2`, ...: 1 is the load as the scene has it, whatever its function of
    time. Motors have their own names [N m or N], drivers `NAME.rotation` and `NAME.translation`,
    supports whose motion is prescribed `support1.x`, ..., `support1.rotation`, numbered among all
    supports; and `base.x`, `base.y`, `base.z` are accelerations of ground with all that it holds,
    in which displacements are those relative to ground.

    Args:
        scene: The scene.
        control: As of `without_commands`.

    Raises:
        SceneError: If a controller moves a driver.
    """
    # what has no mass is told before ground accelerates it
    scene = without_commands(scene, control).with_options(scheme=SIMPLEST)
    found: dict[str, Perturbation] = {}

    def new(name: str, given: Any = None, command: Any = None, idle: bool = False) -> Perturbation:
        if name in found:
            raise SceneError(
                f"linearise: two inputs are called '{name}'; rename the motor or the driver"
            )
        found[name] = Perturbation(given, idle) if command is None else Commanding(command)
        return found[name]

    loads = [
        replace(load, time=new(f"load{k}", load.time))  # type: ignore[type-var]
        for k, load in enumerate(scene.loads, start=1)
    ]
    base = [
        Gravity(tuple(-row), time=new(name, idle=True))
        for name, row in zip(GROUND, np.eye(3), strict=True)
    ]
    elements = [
        replace(e, **new(e.name, e.law, e.command).driving) if isinstance(e, Motor) else e
        for e in scene.force_elements
    ]
    drivers = [
        replace(d, **{k: new(f"{d.name}.{k}", getattr(d, k)) for k in d.coordinates})  # type: ignore[arg-type]
        for d in scene.drivers
    ]
    supports: list[Any] = list(scene.supports)
    for k, support in enumerate(supports, start=1):
        if support.rotation is not None or support.translation is not None:
            parts: dict[str, Any] = {}
            if support.rotation is not None:
                parts["rotation"] = new(f"support{k}.rotation", support.rotation)
            if support.translation is not None:
                moved = [new(f"support{k}.{axis}") for axis in AXES]
                parts["translation"] = _moved(support.translation, moved)
            supports[k - 1] = replace(support, **parts)
        elif support.given:
            parts = {
                part: tuple(
                    new(f"support{k}.{prefix}{axis}", c) if callable(c) else c
                    for axis, c in zip(AXES, getattr(support, part), strict=True)
                )
                for part, prefix in (("displacement", ""), ("director", "director."))
            }
            supports[k - 1] = replace(support, **parts)
    changed = replace(
        scene,
        loads=(*loads, *base),
        force_elements=tuple(elements),
        drivers=tuple(drivers),
        supports=tuple(supports),
    )
    return changed, found


def columns(state: Linearised, inputs: dict[str, Perturbation]) -> tuple[Floats, Floats]:
    """Forces by each input, and values of fixed unknowns by each, both (unknowns, inputs)."""
    forces, motions = (np.zeros((state.system.size, len(inputs))) for _ in range(2))

    def residual() -> Floats:
        state.model.mechanism.command(state.model.signals)
        return state.relaxation.forces(lambda f: float(getattr(f, "extra", 0.0)))

    none = residual()
    for k, one in enumerate(inputs.values()):
        one.add(1.0)
        forces[:, k] = none - residual()
        for times, weight in FOURTH:
            one.add(times * ANGLE)
            motions[:, k] += weight / ANGLE * _given(state)
        one.add(0.0)
    forces[state.system.fixed] = 0.0
    return forces, motions


def _given(state: Linearised) -> Floats:
    """Values of the fixed unknowns, among zeros, shape (unknowns,)."""
    found = np.zeros(state.system.size)
    for k, body in enumerate(state.model.bodies):
        for fixed in body.fixed:
            numbers = state.system.numbering.by_field[k][fixed.dofs]
            found[numbers] = fixed.value(state.relaxation.time)
    return found


# rows of a number that follows from small motions, shape (unknowns,): 0 by the unknowns, 1 by their
# rates, from 3 on by what each branch sees of the unknowns
type Output = dict[int, Floats]


def outputs(
    state: Linearised, scene: Scene, K: sp.csr_array, joints: bool, times: Sequence[float]
) -> dict[str, Output]:
    """Outputs of a scene: its probes, and forces of joints as histories have them.

    Args:
        state: The state.
        scene: The scene.
        K: Stiffness with the columns of fixed unknowns.
        joints: Whether forces of joints are among them: where joints carry forces at the state,
            these turn along, too.
        times: Times of branches that relax [s].

    Raises:
        SceneError: If there is no node at a probe's point.
    """
    found = {p.name: _probe(state, p, times) for p in scene.probes if not unfit(state, p)}
    return found | _joints(state, K) if joints else found


def unfit(state: Linearised, probe: Probe) -> str:
    """Say why a probe is no linear output; empty where it is one.

    Args:
        state: The state.
        probe: The probe.
    """
    if probe.component == "norm":
        return "a norm is not linear in small motions; give component 0, 1 or 2"
    if probe.frame is not None:
        return "it is seen from a frame; leave the frame out"
    (given,) = state.model.scene.bodies_of(probe)
    if given.name in modal_members(state.model):
        return f"'{given.name}' is reduced to modes; take model='exact' or 'floating-frame'"
    return ""


def _probe(state: Linearised, probe: Probe, times: Sequence[float]) -> Output:
    who = f"linearise: probe '{probe.name}'"
    (given,) = state.model.scene.bodies_of(probe)
    body: Any = state.model.meshed.get(given.name)
    axis = np.eye(3)[int(probe.component)]
    every = np.zeros((3 + len(times), state.system.size))
    row = every[int(probe.quantity in ("velocity", "angular_velocity"))]
    if body is not None and probe.quantity in given.quantities:
        for place, weight in places_of(body, probe.at, who):
            at = local_nodes(body, place, who)
            every += weight * _resultant(state, body, at, probe, times)
        return dict(enumerate(every))
    spot = spot_of(state.model, given.name, probe.at, who)
    numbers = _numbers(state, spot.body)
    if probe.quantity in ("rotation", "angular_velocity"):
        assert isinstance(spot.nodes, Nodes)
        D = spot.nodes.values(_function(state, spot.body).x.array).directors
        # `theta = sum d x w / 2`, of which `axis . (d x w) = (axis x d) . w`
        turned = spot.weights[:, None, None] * np.cross(axis, D) / 2
        np.add.at(row, numbers[spot.nodes.dofs[1]], turned)
    else:
        dofs, shares = linear(spot)
        np.add.at(row, numbers[dofs], np.outer(shares[int(probe.quantity == "director")], axis))
    return dict(enumerate(every))


class _Changes(Resultants):
    """Changes of resultants of some cells with a state, and of those of branches by their times."""

    def __init__(self, body: Any, q: fem.Function, change: fem.Function, cells: Ints) -> None:
        found = [expand_derivatives(ufl.derivative(body.resultants(q), q, change))]
        every = branches_of(body) or ()
        relaxing = [pair for own in every for pair in own.stresses(q, change)]
        self.times = [time for time, _ in relaxing]
        self._prepare(body, found + [body.of_stress(stress, q) for _, stress in relaxing], cells)

    def every(self) -> list[Floats]:
        """Values of each element that is read at its nodes."""
        return [self.at_nodes(expression) for expression in self._expressions]


def _resultant(
    state: Linearised, body: Any, nodes: Any, probe: Probe, times: Sequence[float]
) -> Floats:
    """Rows of a resultant at a node, by one unknown of the elements there after the other."""
    change = fem.Function(body.mixed.space)
    at = body.mixed.subspaces["u"].dofmap.list
    cells = np.flatnonzero(np.isin(at, nodes).any(axis=1))
    reading = _Changes(body, _function(state, body.name), change, cells)
    places = np.isin(at[cells], nodes)
    dofs = np.unique(np.concatenate([body.mixed.space.dofmap.cell_dofs(c) for c in cells]))
    numbers, rows = _numbers(state, body.name), np.zeros((3 + len(times), state.system.size))
    component = RESULTANTS[probe.quantity][int(probe.component)]
    orders = [0, *(3 + times.index(time) for time in reading.times)]
    for dof in dofs:
        change.x.array[dof] = 1.0
        for order, values in zip(orders, reading.every(), strict=True):
            rows[order, numbers[dof]] += values[places][:, component].mean()
        change.x.array[dof] = 0.0
    return rows


def _joints(state: Linearised, K: sp.csr_array) -> dict[str, Output]:
    """Forces and moments of joints by their multipliers."""
    mechanism = state.model.mechanism
    number = {name: k for k, name in enumerate(mechanism.joints)}
    rows = np.zeros((len(number), 2, 3, state.system.size))
    for group in mechanism.groups:
        numbers = _numbers(state, group.name)
        mu = group.mixed.dofs["mu"].reshape(-1, group.count)
        # what a multiplier does is what its constraint is a function of
        work = K[numbers[mu.ravel()]][:, numbers].toarray()
        q = np.tile(_function(state, group.name).x.array, (len(work), 1))
        for part in parts_of(group, joints_of(group), number):
            # (multipliers, items, force and moment, components)
            values = part.values(Span(q, q, q), work)[:, :, :2]
            for item, (cell, joint) in enumerate(zip(part.cells, part.numbers, strict=True)):
                own = slice(cell * group.count, (cell + 1) * group.count)
                shares = np.moveaxis(values[own, item], 0, -1)
                rows[joint][..., numbers[mu[cell]]] += shares
    flat = rows.reshape(-1, state.system.size)
    return {name: {0: row} for name, row in zip(column_names(mechanism), flat, strict=True)}


def _numbers(state: Linearised, name: str) -> Ints:
    """Unknowns of a body's local dofs."""
    names = [body.name for body in state.model.bodies]
    return np.asarray(state.system.numbering.by_field[names.index(name)])


def _function(state: Linearised, name: str) -> fem.Function:
    return state.relaxation.functions[name]
