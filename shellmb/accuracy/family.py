"""Comparison runs of a scene, each once: other steps, elements and tolerances, exact bodies."""

import math
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from mpi4py import MPI

from shellmb.accuracy.run_record import RunRecord, keep
from shellmb.errors import SceneError, ShellmbError, unsaid
from shellmb.meshes.lifetime import free
from shellmb.running.execute import RunResult, execute
from shellmb.running.request import Request
from shellmb.running.results import Results
from shellmb.scene import Scene
from shellmb.scene.checks.schemes import corners
from shellmb.scene.probes import RESULTANTS
from shellmb.simulate.simulation import BaseObserver, Observer, Simulation

# tolerances by which steps are chosen go with this power of what would be the step
POWER = 2.0
# distance of a corner from the end of a step, as a part of it, up to which it is there
MET = 1e-6
# steps in which no motion has a shape
SHAPELESS = 2
# elements up to which forms take longer to read than runs
SMALL = 64


@dataclass(frozen=True)
class Change:
    """Difference of a comparison run from the run.

    Args:
        step: Factor on the step; where steps follow a tolerance, its square on that.
        mesh: So many elements along a side replace one.
        coarser: One element along a side replaces so many.
        degree: Degree of the elements; None: as it is.
        tolerance: Factor on the tolerance of Newton's method.
        stiffness: Factor on the stiffness of contacts.
        exact: Whether bodies that are reduced to modes, or linear, are exact.
        scheme: Scheme; None: as it is.
        body: The only body whose mesh differs; None: all.
    """

    step: float = 1.0
    mesh: int = 1
    coarser: int = 1
    degree: int | None = None
    tolerance: float = 1.0
    stiffness: float = 1.0
    exact: bool = False
    scheme: str | None = None
    body: str | None = None

    def apply(self, scene: Scene) -> Scene:
        """The scene of the comparison run.

        Args:
            scene: The scene.

        Raises:
            SceneError: If there is no such run, for example because its nodes are at other places.
        """
        if self.scheme is not None and self.scheme != scene.scheme_name:
            scene = scene.with_options(scheme=self.scheme)
        if self.exact:
            for body in reduced(scene):
                scene = scene.with_options(model="exact", body=body.name)
        if self.mesh != 1:
            scene = scene.with_options(divide=self.mesh, body=self.body)
        if self.coarser != 1:
            scene = with_fewer(scene, self.coarser, self.body)
        if self.degree is not None:
            scene = scene.with_options(degree=self.degree, body=self.body)  # type: ignore[arg-type]
        if self.stiffness != 1.0:
            stiff = (replace(c, stiffness=c.stiffness * self.stiffness) for c in scene.contacts)
            scene = replace(scene, contacts=tuple(stiff))
        if self.tolerance != 1.0:
            tolerance = scene.solver.tolerance * self.tolerance
            scene = replace(scene, solver=replace(scene.solver, tolerance=tolerance))
        return scene if self.step == 1.0 else with_steps(scene, self.step)

    def words(self) -> str:
        """Name for messages: "3 times the step, twice the elements"."""
        if self.step == 1.0:
            step = []
        elif self.step > 1.0:
            step = [f"{self.step:g} times the step"]
        else:
            step = [f"1/{1 / self.step:g} of the step"]
        parts = {
            "twice the elements": self.mesh == 2,
            f"{self.mesh} times the elements": self.mesh > 2,
            f"1/{self.coarser} of the elements": self.coarser > 1,
            f"degree {self.degree}": self.degree is not None,
            "another tolerance of Newton's method": self.tolerance != 1.0,
            f"{self.stiffness:g} times the stiffness of contacts": self.stiffness != 1.0,
            "exact bodies": self.exact,
            f"scheme '{self.scheme}'": self.scheme is not None,
        }
        return ", ".join([*step, *(said for said, here in parts.items() if here)]) or "the scene"


def with_steps(scene: Scene, times: float) -> Scene:
    """The scene with other steps; with another tolerance where steps are chosen by one.

    Args:
        scene: The scene.
        times: Factor on the step.

    Raises:
        SceneError: If it is impossible.
    """
    control = scene.step_control
    if control.step_error is not None:
        error = min(control.step_error * times**POWER, 0.5)
        return replace(scene, step_control=replace(control, step_error=error))
    limits = {"min_dt": control.min_dt, "max_dt": control.max_dt}
    changes: dict[str, Any] = {k: v * times for k, v in limits.items() if v is not None}
    if times > 1:
        changes["times"] = _met(scene)
    return replace(scene, dt=scene.dt * times, step_control=replace(control, **changes))


def _met(scene: Scene) -> tuple[float, ...]:
    """Times at which larger steps end, too: corners of loads and motions at ends of the scene's."""
    steps = {t: t / scene.dt for t in corners(scene)}
    met = {t for t, count in steps.items() if abs(count - round(count)) < MET}
    return tuple(sorted({*scene.step_control.times, *met}))


def degree_of(scene: Scene) -> int | None:
    """Least degree of the elements; None without shells and beams that deform.

    Args:
        scene: The scene.
    """
    return min((b.degree for b in scene.meshed if b.model != "rigid"), default=None)


def prefers_degree(scene: Scene) -> bool:
    """Decide whether degree 3 tells of the mesh, and not twice the elements.

    It costs half as much, and has forms of its own, which take longer to read than small scenes
    take to run.
    Where something acts at points of a shell, elements of both degrees are off by the same.

    Args:
        scene: The scene.
    """
    at_points = any(load.at_point for load in scene.loads)
    return elements_of(scene) > SMALL and not (at_points or scene.joints or scene.glues)


def elements_of(scene: Scene) -> int:
    """Number of elements of shells and beams, as far as the scene says it.

    Args:
        scene: The scene.
    """
    return sum(math.prod(body.sides) for body in scene.meshed)


def has_resultants(scene: Scene) -> bool:
    """Decide whether resultants are probed, of which two meshes tell too little.

    Args:
        scene: The scene.
    """
    return any(probe.quantity in RESULTANTS for probe in scene.probes)


def with_fewer(scene: Scene, times: int, body: str | None) -> Scene:
    """The scene with one element along each side in place of several.

    Args:
        scene: The scene.
        times: Number of elements that one replaces.
        body: The only body that gets them; None: all.

    Raises:
        SceneError: If a mesh comes from a file, or its numbers of elements are no multiples.
    """
    chosen = [b for b in scene.meshed if body in (None, b.name)]
    files = any(b.refined_times is not None for b in chosen)
    if files or any(n % times for n in sides_of(chosen)):
        raise SceneError(f"no mesh has 1/{times} of the elements")

    def few(b: Any) -> Any:
        return b.with_sides(n // times for n in b.sides) if b in chosen else b

    return replace(scene, shells=tuple(map(few, scene.shells)), beams=tuple(map(few, scene.beams)))


def sides_of(bodies: Iterable[Any]) -> list[int]:
    """Numbers of elements along the sides of shells, and along beams."""
    return [n for b in bodies for n in b.sides]


def reduced(scene: Scene) -> list[Any]:
    """Bodies that deform in modes, or by small strains about a frame.

    Args:
        scene: The scene.
    """
    return [b for b in scene.meshed if b.linear or b.modes]


class Steps(BaseObserver):
    """An observer that times the steps of a run.

    Attributes:
        seconds: Their processor time [s].
    """

    def __init__(self) -> None:
        self._begun = self.seconds = 0.0

    def start(self, simulation: Simulation) -> None:
        """Start the clock."""
        self._begun = time.process_time()

    def finish(self, simulation: Simulation, error: BaseException | None) -> None:
        """Stop the clock."""
        self.seconds = time.process_time() - self._begun


# unknowns above which what a companion leaves behind is freed at once: looking through all objects
# takes a tenth of a second
LARGE = 50_000


def is_large(run: RunResult) -> bool:
    """Decide whether what a run leaves behind is to be freed at once; alike on all ranks.

    Args:
        run: The run.
    """
    simulation = run.simulation
    return simulation.model.comm.size > 1 or simulation.problem.system.size > LARGE


class Family:
    """Runs of one scene with changes.

    Args:
        scene: The scene.
        results: Gives results; None: the scene's own function.
        comm: Communicator.
        accounts: Whether comparison runs measure energies, momenta and forces, too.

    Attributes:
        found: What is kept of runs; None of those that failed.
        failures: Why these failed.
    """

    def __init__(
        self,
        scene: Scene,
        results: Results | None,
        comm: MPI.Comm = MPI.COMM_WORLD,
        accounts: bool = False,
    ) -> None:
        self.scene, self.comm = scene, comm
        self._results, self._accounts = results, accounts
        self.found: dict[Change, RunRecord | None] = {}
        self.failures: dict[Change, str] = {}

    @unsaid()
    def run(self, change: Change) -> RunRecord | None:
        """A comparison run; None where it cannot be, or fails; collective.

        Args:
            change: What is different in it.
        """
        if change not in self.found:
            try:
                run, found = self.start(change, watched=False, accounts=self._accounts)
            except ShellmbError as error:
                self.failures[change], self.found[change] = str(error), None
            else:
                self.found[change], large = found, is_large(run)
                del run
                if large:
                    free(self.comm)
        return self.found[change]

    def start(
        self,
        change: Change,
        out: Path | None = None,
        observers: Sequence[Observer] = (),
        request: Request | None = None,
        **measured: bool,
    ) -> tuple[RunResult, RunRecord]:
        """Run the scene with a change; collective.

        Args:
            change: What is different in it.
            out: Directory to write; None: nothing is written.
            observers: More observers.
            request: How the scene was requested.
            **measured: What is measured, as of `execute`; without a word everything.

        Returns:
            The run, and what is kept of it.

        Raises:
            ShellmbError: If there is no such scene, or it fails.
        """
        scene, clock, steps = change.apply(self.scene), time.process_time(), Steps()
        how: Any = {"comm": self.comm, "request": request, "results": self._results, **measured}
        run = execute(scene, out, [*observers, steps], pictures=False, **how)
        return run, keep(run, steps.seconds, time.process_time() - clock)
