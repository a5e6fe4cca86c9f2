"""Levels of mesh and step until an error is met, from coarse to fine: of runs, and of modes."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from math import isfinite
from typing import Any

from mpi4py import MPI

from shellmb.accuracy.caveats import NO_LIMIT
from shellmb.accuracy.errors import FEWEST, Companions, find_companions, judged
from shellmb.accuracy.estimates import RATIO, ErrorEstimate, step_error
from shellmb.accuracy.family import Change, Family, degree_of, is_large
from shellmb.accuracy.measuring import slowest
from shellmb.accuracy.modes import ModeResults, mode_errors
from shellmb.accuracy.request.choose import AIM, Choice, choose
from shellmb.accuracy.request.levels import Level, Store, Target, UnknownQuantity, frequency_number
from shellmb.accuracy.request.messages import label, line, mesh_label, percent, seconds
from shellmb.accuracy.run_record import RunRecord, difference
from shellmb.errors import ConvergenceError, SceneError, ShellmbError, of_first
from shellmb.meshes.lifetime import free
from shellmb.running.execute import RunResult
from shellmb.running.natural_modes.run import find_modes, write_found
from shellmb.running.request import Request
from shellmb.running.results import Results
from shellmb.scene import Scene
from shellmb.scene.lookup import listed
from shellmb.scene.schemes import OURS
from shellmb.schemes.registry import make_scheme
from shellmb.simulate.simulation import Observer

type Tell = Callable[[str], None]

# steps of the first level at least, so many times larger than the scene's at most
FIRST, LARGEST = FEWEST * RATIO**2, 9
# levels at most
MOST = 8
# so many levels in a row whose differences do not fall are the last ones
LEVELS_THAT_TELL = 2
# what companions add to the run of a level
OVERHEAD = 1.9


@dataclass(frozen=True)
class Running:
    """Settings with which levels are run.

    Args:
        comm: Communicator.
        results: What gives results; None: the scene's own function.
        request: How the scene was requested.
        observers: More observers of the levels' runs.
        tell: Callback for progress messages.
        mode_results: What gives results of modes; None: there are none.
        modes: Whether "f1" may be a natural frequency.
    """

    comm: MPI.Comm
    results: Results | None = None
    request: Request | None = None
    observers: Sequence[Observer] = ()
    tell: Tell = lambda text: None
    mode_results: ModeResults | None = None
    modes: bool = True


@dataclass(frozen=True)
class Outcome:
    """Outcome of a request.

    Args:
        levels: Its levels.
        met: Whether the accuracy is met.
        says: Why it ended, in words.
        run: The last run; None where it is read from its directory.
    """

    levels: tuple[Level, ...]
    met: bool
    says: str
    run: RunResult | None


class Search:
    """Runs levels of a scene.

    Args:
        scene: The scene, with the mesh and the step of its first level.
        wanted: What is requested.
        store: Where levels are kept.
        how: How they are run.
    """

    def __init__(self, scene: Scene, wanted: Target, store: Store, how: Running) -> None:
        self.scene, self.wanted, self.store, self.how = scene, wanted, store, how
        self.quantity = wanted.quantity(scene, measures=how.results is not None)
        self.levels: list[Level] = []
        # levels are companions of one another, not of what ran before
        self._family = Family(scene, how.results, how.comm, ":" in (wanted.of or ""))
        kept, failures, self._stored = of_first(how.comm, store.read)
        self._family.found.update(kept)
        self._family.failures.update(failures)
        self._begun, self._cpu = time.perf_counter(), time.process_time()
        self._companions: list[Companions] = []

    def run(self) -> Outcome:
        """Run levels until the error is met, the budget is over, or nothing helps; collective.

        Raises:
            SceneError: If the scene has no such quantity, or is impossible.
            ConvergenceError: If it fails at all steps of the first level.
        """
        change = self._first()
        while True:
            try:
                run = self._level(change)
            except ShellmbError as error:
                if not self.levels:
                    raise
                says = f"{self._requested} is not met: the next level fails: {error}"
                return Outcome(tuple(self.levels), False, says, None)
            level, target = self.levels[-1], self.wanted.accuracy * self.size
            met = level.error <= target
            following = None if met else choose(self.levels, target)
            why = self._why(target, met, following)
            self.how.tell(line(self.levels, self.quantity, self.size, following, self.label))
            if why or following is None:
                return Outcome(tuple(self.levels), met, why, run)
            change, large = following.change, run is not None and is_large(run)
            del run
            if large:
                free(self.how.comm)

    @property
    def _requested(self) -> str:
        return f"{100 * self.wanted.accuracy:.3g} %"

    @property
    def size(self) -> float:
        """Size that errors are relative to: the value, or that of the curve where it vanishes."""
        size = abs(self.levels[-1].value)
        if not size and self.quantity.norm is not None:
            size = self._companions[-1].mine.size(replace(self.quantity, norm="l2"))
        return size

    def label(self, change: Change) -> str:
        """Mesh, step and scheme of a level in words.

        Args:
            change: What is different in it.
        """
        return label(change.apply(self.scene))

    def _first(self) -> Change:
        """Choose where levels begin: with larger steps, and the scheme that is chosen."""
        change = Change(step=self._first_step(), body=self.wanted.body)
        return replace(change, scheme=self._scheme(change)) if self.wanted.auto else change

    def _first_step(self) -> float:
        scene = self.scene
        if scene.static and scene.path is None:
            return 1.0
        if scene.step_control.step_error is not None or scene.path is not None:
            return RATIO
        return float(min(max(int(scene.t_end / scene.dt / FIRST), 1), LARGEST))

    def _scheme(self, change: Change) -> str:
        """The scheme that is predicted to be the cheapest one, from coarse runs of each."""
        if self.scene.static:
            raise SceneError(
                f"scheme is 'auto', and the scene '{self.scene.name}' is static; leave it out"
            )
        found: dict[str, float] = {}
        for scheme in OURS:
            own = replace(change, scheme=scheme)
            steps = (own, *(replace(own, step=own.step * RATIO**n) for n in (1, 2)))
            series = [kept for c in steps if (kept := self._family.run(c)) is not None]
            if len(series) < 2:
                continue
            self.wanted.check(self.scene, self.quantity, series[0])
            pairs = [difference(a, b, self.quantity) for a, b in pairwise(series)]
            order = order_of(own.apply(self.scene))
            size = abs(series[0].size(self.quantity)) or 1.0
            error = step_error([d for d in pairs if d is not None], order, size)
            target = 0.5 * self.wanted.accuracy * size
            finer = max(error.error / target, 1.0) ** (1 / min(error.believed, order))
            found[scheme] = slowest(self.how.comm, series[0].seconds) * finer
            self.how.tell(f"{scheme}: about {seconds(found[scheme])} for the error of the step")
        if not found:
            why = next(iter(self._family.failures.values()), "")
            raise ConvergenceError(f"no scheme gets through with {change.words()}: {why}")
        return min(found, key=lambda name: found[name])

    def _level(self, change: Change) -> RunResult | None:
        """Run a level and its comparison runs; the first one with smaller steps where it fails."""
        while True:
            try:
                run, kept = self._run(change)
                break
            except ConvergenceError:
                if self.levels or change.step <= 1.0:
                    raise
                change = replace(change, step=max(change.step / RATIO, 1.0))
                self.how.tell(f"the first level fails; again with {change.words()}")
        known = next((c for c in reversed(self._companions) if _helps(c.base, change)), None)
        self._companions.append(find_companions(self._family, change, kept.steps, known))
        scene = change.apply(self.scene)
        found = self._companions[-1].find(self.quantity, scene, order_of(scene))
        self.levels.append(self._level_of(change, found, kept.cpu, kept.seconds))
        out, comm = self.store.place(len(self.levels)), self.how.comm
        # of a request that was stopped before it knew them, too
        summary = self.store.summary(len(self.levels)) if run is None else run.summary
        if "errors" not in summary:
            errors = judged(self._companions[-1], self._family, scene, order_of(scene))
            errors.write(summary, out, comm)
        self.store.keep(self._family, self.levels)
        return run

    def _run(self, change: Change) -> tuple[RunResult | None, RunRecord]:
        """The run of a level, None where it is in the store, and what is kept of it."""
        number, how, run = len(self.levels) + 1, self.how, None
        kept = self._family.found.get(change)
        if kept is None or not self.store.is_done(number):
            place = self.store.emptied(number)
            run, kept = self._family.start(change, place, how.observers, how.request)
            self._family.found[change] = kept
        self.wanted.check(self.scene, self.quantity, kept)
        if run is not None:
            self.store.keep(self._family, self.levels)
        return run, kept

    def _level_of(
        self, change: Change, found: ErrorEstimate, seconds: float, stepping: float
    ) -> Level:
        """A level with its errors and its processor times."""
        scene = change.apply(self.scene)
        parts = {k: p.error for k, p in found.parts.items()}
        before = next((v.total for v in self._stored if v.change == change), None)
        total = slowest(self.how.comm, time.process_time() - self._cpu)
        past = self._stored[-1].total if self._stored else 0.0
        return Level(
            change=change,
            label=self.label(change),
            value=found.value,
            error=found.error,
            mesh=parts.pop("mesh"),
            step=parts.pop("step"),
            others=sum(parts.values()),
            order=min(max(found.step.order or 1.0, 1.0), max(order_of(scene), 1.0)),
            seconds=slowest(self.how.comm, seconds),
            stepping=slowest(self.how.comm, stepping),
            total=past + total if before is None else before,
            dimension=2 if any(s.model != "rigid" for s in scene.shells) else 1,
            refinable=self._refinable(scene),
            converges=all(part.converges for part in found.parts.values()),
        )

    def _refinable(self, scene: Scene) -> bool:
        try:
            scene.with_options(divide=2, body=self.wanted.body)
        except SceneError:
            return False
        return degree_of(scene) is not None

    def _why(self, target: float, met: bool, following: Choice | None) -> str:
        """Say why this is the last level; empty: it is not."""
        level, requested = self.levels[-1], self._requested
        if met:
            return f"{requested} is met"
        if not any(v.converges for v in self.levels[-LEVELS_THAT_TELL:]) and (
            following is None or len(self.levels) >= LEVELS_THAT_TELL
        ):
            return (
                f"{requested} cannot be met, because {self.quantity} {NO_LIMIT}: each finer level "
                "changes it by as much as the one before"
            )
        if level.converges and not isfinite(level.error):
            why = "; ".join(self._family.failures.values())
            return f"{requested} cannot be met, because an error is not known: {why}"
        if following is None:
            if level.others >= AIM * target:
                return (
                    f"{requested} is not met: reduced models, contacts and Newton's tolerance "
                    f"leave an error of {percent(level.others, self.size)}, which finer meshes and "
                    "steps do not change; use exact bodies, stiffer contacts or a smaller tolerance"
                )
            return f"{requested} is not met: the error of the mesh cannot be made smaller"
        if len(self.levels) >= MOST:
            return f"{requested} is not met after {MOST} levels"
        elapsed, expected = time.perf_counter() - self._begun, OVERHEAD * following.seconds
        budget = self.wanted.budget
        if self.how.comm.bcast(budget is not None and elapsed + expected > budget):
            return (
                f"{requested} is not met within the budget of {seconds(budget or 0.0)}: the next "
                f"level, {self.label(following.change)}, would take about {seconds(expected)} "
                f"after {seconds(elapsed)}"
            )
        return ""


def order_of(scene: Scene) -> float:
    """Order of the scheme of a scene.

    Args:
        scene: The scene.
    """
    return float(make_scheme(scene.scheme, scene.dissipation).order)


def _helps(known: Change, change: Change) -> bool:
    """Decide whether comparison runs of one run serve for another one."""
    same = replace(known, step=change.step, mesh=change.mesh) == change
    return same and (known.step == change.step or known.mesh == change.mesh)


class ModeSearch(Search):
    """Finds modes of a scene with finer and finer meshes.

    Args:
        scene: The scene, with the mesh of its first level.
        wanted: What is requested: a frequency as "f1", or a result of modes.
        store: Where levels are kept.
        how: How modes are found.

    Raises:
        SceneError: If a scheme is to be chosen.
    """

    def __init__(self, scene: Scene, wanted: Target, store: Store, how: Running) -> None:
        super().__init__(scene, wanted, store, how)
        if wanted.auto:
            raise SceneError("scheme is 'auto', and natural modes have no scheme; leave it out")

    def label(self, change: Change) -> str:
        """Mesh of a level in words.

        Args:
            change: What is different in it.
        """
        return mesh_label(change.apply(self.scene)) or "no mesh"

    def _first(self) -> Change:
        return Change(body=self.wanted.body)

    def _level(self, change: Change) -> None:
        """Modes of a level with their errors; what is in the store is taken from there."""
        number, comm, wanted = len(self.levels) + 1, self.how.comm, self.wanted
        before = next((v for v in self._stored if v.change == change), None)
        if before is not None and self.store.is_done(number):
            self.levels.append(before)
            return
        place, scene = self.store.emptied(number), change.apply(self.scene)
        measure, loaded, name = self.how.mode_results, wanted.loaded, self.quantity.name
        count = max(wanted.count, frequency_number(name) or 1)
        clock = time.process_time()
        how: dict[str, Any] = {"results": measure, "comm": comm, "pictures": False}
        find = partial(find_modes, count=count, loaded=loaded)
        modes, summary = write_found(find, scene, place, **how)
        seconds = slowest(comm, time.process_time() - clock)
        errors = mode_errors(scene, modes, summary["results"], loaded, measure, wanted.body)
        found = errors.others | errors.results
        if name not in found:
            raise UnknownQuantity(
                f"of is '{name}'; it must be a frequency or a result of the modes, {listed(found)}"
            )
        if (frequency_number(name) or modes.rigid + 1) <= modes.rigid:
            raise SceneError(
                f"of is '{name}', the frequency of a rigid-body motion, which is 0; ask for a "
                "mode that deforms the bodies, 'f7' of a free one"
            )
        if errors.remarks:
            self._family.failures[change] = "; ".join(errors.remarks)
        errors.write(summary, place, comm)
        # eigenproblems of fine meshes take most of the time: all of it grows with the elements
        self.levels.append(self._level_of(change, found[name], seconds, seconds))
        self.store.keep(self._family, self.levels)
