"""Runs of mechanisms: in shellmb with the observers of a run, in Exudyn, and the exact motion."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np
from scipy.interpolate import CubicSpline

from shellmb.arrays import Floats
from shellmb.demos.verification.measuring import Stopwatch
from shellmb.errors import ConvergenceError, SceneError
from shellmb.observers.deferred import STEPS
from shellmb.running.standard import StandardObservers
from shellmb.scene import (
    GROUND,
    Beam,
    Prismatic,
    Revolute,
    Scene,
    Spherical,
    StepControl,
    Universal,
)
from shellmb.scene.values.validate import unit_vector
from shellmb.simulate.simulation import Simulation
from tests.bench.peers.codes import EXUDYN, OURS
from tests.bench.peers.dynamics.history import TipHistory
from tests.bench.peers.dynamics.motion import Motion, Runs, Study
from tests.bench.peers.exudyn import quiet, require, settings_of, timed
from tests.bench.peers.mechanisms.scenes import MECHANISMS, exact_of


class EndsOfSteps(TipHistory):
    """A history that is judged at the ends of its steps, where both codes have their answer."""

    def apart(self, reference: TipHistory) -> tuple[Floats, Floats]:
        """Difference from the reference, and what it is relative to."""
        truth = CubicSpline(reference.t, reference.u)(self.t)
        return self.u - truth, truth


@dataclass(frozen=True)
class Run:
    """A run of one code.

    Args:
        name: Name of the mechanism.
        dt: Time step, s.
        finer: Elements of flexible bodies for each of those of its scene.
    """

    name: str
    dt: float
    finer: int = field(default=1, kw_only=True)

    @property
    def scene(self) -> Scene:
        """The mechanism, of so many elements."""
        base = MECHANISMS[self.name].scene()
        beams = (replace(beam, elements=self.finer * beam.elements) for beam in base.beams)
        return replace(base, beams=tuple(beams))

    @property
    def mesh(self) -> tuple[int, int]:
        """Number of bodies, and one."""
        return MECHANISMS[self.name].bodies, 1


@dataclass(frozen=True)
class Exact(Run):
    """The exact motion, which no code has part in; it stands in for our converged answer."""

    code: ClassVar[str] = OURS
    how: ClassVar[str] = "DOP853"

    def run(self) -> TipHistory:
        """Integrate."""
        t, u = exact_of(self.name)
        return EndsOfSteps(t, u, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class ExactTheirs(Exact):
    """The exact motion in place of Exudyn's converged answer."""

    code: ClassVar[str] = EXUDYN


@dataclass(frozen=True)
class OurRun(Run):
    """In shellmb, with all that a run observes.

    Args:
        scheme: "ep" or "ep4".
    """

    code: ClassVar[str] = OURS
    scheme: str = "ep4"

    @property
    def how(self) -> str:
        """Time scheme."""
        return self.scheme.upper()

    def run(self) -> TipHistory:
        """Solve; set-up and compilation are not timed."""
        scene = replace(
            self.scene,
            scheme=self.scheme,
            alpha=None,
            dt=self.dt,
            # a step that fails is not taken again with a smaller one
            step_control=StepControl(min_dt=self.dt, max_dt=self.dt),
        )
        simulation, standard = Simulation(scene), StandardObservers(None)
        observers = list(standard.named.values())
        for observer in observers:
            observer.start(simulation)
        iteration, failed = simulation.problem.iteration, ""
        factored, watch = iteration.factorisations, Stopwatch()
        try:
            for _ in range(round(float(scene.t_end or 0.0) / self.dt)):
                simulation.advance(observers)
        except ConvergenceError as error:
            failed = str(error)
        # what is not booked yet is
        rows, (probe,) = standard.sources.history.rows, scene.probes
        cpu, wall = watch.cpu, watch.wall
        t, u = np.array([(row["t"], row[probe.name]) for row in rows]).T
        steps = max(len(t) - 1, 1)
        numbers = simulation.iterations / steps, (iteration.factorisations - factored) / steps
        return EndsOfSteps(t, u, cpu, wall, *numbers, failed)


@dataclass(frozen=True)
class ExudynRun(Run):
    """In Exudyn: generalised alpha, modified Newton.

    Of three kinds of rotations, dense and sparse solvers, modified and full Newton these are the
    fastest; errors are the same, but for Euler parameters, which have larger ones.

    Args:
        spectral_radius: Of generalised alpha at infinity.
        tolerance: Relative tolerance of Newton's method.
    """

    code: ClassVar[str] = EXUDYN
    spectral_radius: float = 0.9
    tolerance: float = 1e-6

    @property
    def how(self) -> str:
        """Time scheme."""
        return f"rho={self.spectral_radius:g}"

    def run(self) -> TipHistory:
        """Solve; set-up is not timed."""
        exu, scene = require(), self.scene
        container = exu.SystemContainer()
        system = container.AddSystem()
        with quiet():
            sensor, component = _translated(exu, system, scene)
        system.Assemble()
        settings, t_end = settings_of(exu), float(scene.t_end or 0.0)
        if self.mesh[0] < DENSE:
            settings.linearSolver.solverType = exu.LinearSolverType.EXUdense
        times = settings.timeIntegration
        times.numberOfSteps, times.endTime = round(t_end / self.dt), t_end
        times.adaptiveStep, times.verboseMode = False, 0
        times.generalizedAlpha.spectralRadius = self.spectral_radius
        times.newton.useModifiedNewton = True
        times.newton.relativeTolerance = self.tolerance
        settings.solution.sensors.writePeriod = self.dt
        cpu, wall, failed = timed(lambda: system.SolveDynamic(settings, showHints=False))
        rows = np.array(system.GetSensorStoredData(sensor))
        it, steps = system.sys["dynamicSolver"].it, max(len(rows) - 1, 1)
        if not failed and rows[-1, 0] < t_end * (1 - 1e-6):
            failed = "ended early"
        numbers = it.newtonStepsCount / steps, it.newtonJacobiCount / steps
        return EndsOfSteps(rows[:, 0], rows[:, 1 + component], cpu, wall, *numbers, failed)


# bodies from which on the sparse solver is faster
DENSE = 8
# steps of converged answers of mechanisms whose exact motion nobody knows, s
FINE, FINE_THEIRS = 1e-3, 5e-5
# multiples of their elements that runs have
MESHES = (1, 2)
# errors that times are compared at
ASKED: tuple[float, ...] = (1e-3, 1e-4, 1e-5)


def _translated(exu: Any, system: Any, scene: Any) -> tuple[Any, int]:
    """Put the bodies of a scene into a system of Exudyn; its probe and the component of it."""
    import exudyn.itemInterface as items
    from exudyn.rigidBodyUtilities import RigidBodyInertia

    (gravity,), (probe,) = scene.loads, scene.probes
    # angles are the fastest in the plane; what spins in space would pass their singular places
    kind = "EulerParameters" if scene.initial else "Rxyz"
    numbers, places = {GROUND: system.CreateGround()}, {GROUND: np.zeros(3)}
    for body in scene.rigid_bodies:
        if not np.array_equal(body.axes, np.eye(3)):
            raise SceneError(f"bench: rigid body '{body.name}' begins turned; it must not")
        centre = np.array(body.position) + np.array(body.com)
        spin, velocity = np.zeros(3), np.zeros(3)
        for motion in scene.initial:
            if motion.body in (None, body.name):
                spin += motion.spin
                velocity += motion.linear + np.cross(motion.spin, centre - np.array(motion.about))
        places[body.name] = centre
        numbers[body.name] = system.CreateRigidBody(
            inertia=RigidBodyInertia(mass=body.mass, inertiaTensor=body.inertia_tensor),
            nodeType=getattr(exu.NodeType, f"Rotation{kind}"),
            referencePosition=centre.tolist(),
            initialVelocity=velocity.tolist(),
            initialAngularVelocity=spin.tolist(),
            gravity=list(gravity.acceleration),
        )
    ends = {beam.name: _cable(exu, system, beam, gravity.acceleration) for beam in scene.beams}
    for joint in scene.joints:
        at = list(map(float, joint.at))
        if joint.second in ends:
            body, node = numbers[joint.first], _nearest(ends[joint.second], joint.at)
            local = (np.array(joint.at) - places[joint.first]).tolist()
            markers = [
                system.AddMarker(items.MarkerBodyPosition(bodyNumber=body, localPosition=local)),
                system.AddMarker(items.MarkerNodePosition(nodeNumber=node)),
            ]
            # nothing leaves the plane
            plane = items.ObjectJointSpherical(markerNumbers=markers, constrainedAxes=[1, 1, 0])
            system.AddObject(plane)
            continue
        pair = [numbers[joint.first], numbers[joint.second]]
        along, free = np.eye(3), [1, 1, 1, 0, 0, 0]
        if isinstance(joint, Revolute):
            along, free = _frame(joint.axis), [1, 1, 1, 1, 1, 0]
        elif isinstance(joint, Prismatic):
            along, free = _frame(joint.axis), [1, 1, 0, 1, 1, 1]
        elif isinstance(joint, Universal):
            # the axes stay perpendicular: nothing turns about the third
            a, b = (unit_vector(axis, "axis") for axis in (joint.axis, joint.second_axis))
            along, free = np.stack([a, b, np.cross(a, b)], axis=1), [1, 1, 1, 0, 0, 1]
        elif not isinstance(joint, Spherical):
            raise SceneError(f"bench: {joint.said} has no counterpart in Exudyn here")
        system.CreateGenericJoint(
            bodyNumbers=pair,
            position=at,
            rotationMatrixAxes=along,
            constrainedAxes=free,
            useGlobalFrame=True,
        )
    name = probe.body or scene.rigid_bodies[0].name
    where = probe.at
    point = scene.body(name).place(where) if isinstance(where, str) else np.array(where)
    sensor = system.AddSensor(
        items.SensorBody(
            bodyNumber=numbers[name],
            localPosition=(point - places[name]).tolist(),
            storeInternal=True,
            outputVariableType=exu.OutputVariableType.Position,
        )
    )
    return sensor, int(probe.component)


def _cable(exu: Any, system: Any, beam: Beam, gravity: Any) -> list[tuple[Floats, Any]]:
    """A straight slender beam in the plane, by ANCF; places and nodes of both ends."""
    import exudyn.beams as beams
    import exudyn.itemInterface as items

    first, last = beam.curve.position(np.array([0.0, 1.0])).T
    cable = items.Cable2D(
        physicsMassPerLength=beam.section.mass[0],
        physicsAxialStiffness=beam.section.stiffness[0, 0],
        physicsBendingStiffness=beam.section.stiffness[5, 5],
    )
    nodes, *_ = beams.GenerateStraightLineANCFCable2D(
        system, first.tolist(), last.tolist(), beam.elements, cable, list(gravity)
    )
    return [(first, nodes[0]), (last, nodes[-1])]


def _nearest(ends: list[tuple[Floats, Any]], at: Any) -> Any:
    """Node of the end that is at a place."""
    return min(ends, key=lambda end: float(np.linalg.norm(end[0] - np.array(at))))[1]


def _frame(axis: Any) -> Floats:
    """Axes as columns, the third one along a given one."""
    e = np.array(unit_vector(axis, "axis"), dtype=float)
    other = np.eye(3)[int(np.argmin(np.abs(e)))]
    first = np.cross(other, e)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(e, first), e], axis=1)


def least_step(name: str, scheme: str, dt: float, observed: bool, times: int = 6) -> float:
    """Mean time of the quickest run of steps that are booked together, s.

    It is nearly what a step takes on a machine of its own.

    Args:
        name: Name of the mechanism.
        scheme: Time scheme.
        dt: Time step, s.
        observed: Whether all is observed that a run observes.
        times: How many runs of steps.
    """
    base = MECHANISMS[name].scene()
    scene = replace(base, scheme=scheme, alpha=None, dt=dt, t_end=2 * times * STEPS * dt)
    simulation = Simulation(scene)
    observers = list(StandardObservers(None).named.values()) if observed else []
    for observer in observers:
        observer.start(simulation)
    found = []
    for _ in range(times):
        watch = Stopwatch()
        for _ in range(STEPS):
            simulation.advance(observers)
        found.append(watch.wall / STEPS)
    return min(found)


def study_of(name: str, fast: bool = False) -> Study:
    """Runs of a mechanism.

    Args:
        name: Its name.
        fast: Whether only a few runs are made.
    """
    mechanism, few = MECHANISMS[name], slice(-2, None) if fast else slice(None)
    rigid, asked = mechanism.exact is not None, ASKED
    meshes = (1,) if rigid else MESHES
    ours = [
        OurRun(name, dt, scheme=scheme, finer=finer)
        for scheme, steps in mechanism.steps.items()
        for dt in steps[few]
        for finer in meshes
    ]
    theirs = [
        ExudynRun(name, dt, rho, finer=finer)
        for dt in mechanism.theirs[few]
        for finer in meshes
        for rho in (0.9, 1.0)
    ]
    best = min(ours, key=lambda run: (run.scheme == "ep", run.dt))
    fine: tuple[Motion, Motion] = Exact(name, 0.0), ExactTheirs(name, 0.0)
    if not rigid:
        fine = OurRun(name, FINE, finer=4), ExudynRun(name, FINE_THEIRS, 1.0, finer=4)
        # both converged answers agree to 1e-5
        asked = ASKED[:2]
    runs = {
        OURS: Runs((fine[0], best), ours),
        EXUDYN: Runs((fine[1], theirs[-2]), theirs),
    }
    return Study(f"mechanism_{name}", mechanism.title, runs, runs, asked)
