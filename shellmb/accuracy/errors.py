"""Errors of a run's results and histories, estimated from cheaper comparison runs.

Step: the run against runs with three and nine times the step. Mesh: two runs against
each other, with the run's elements and with twice as many, and nine times the step, in which the
error of the step is the same. The error of a quantity is the sum of all parts. Statics have no
error of the step; rigid bodies alone have none of the mesh.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

from shellmb.accuracy.caveats import remarks
from shellmb.accuracy.estimates import (
    CAUTION,
    NONE,
    RATIO,
    UNKNOWN,
    ErrorEstimate,
    Errors,
    Estimate,
    mesh_error,
    model_error,
    step_error,
)
from shellmb.accuracy.family import (
    SHAPELESS,
    Change,
    Family,
    degree_of,
    elements_of,
    has_resultants,
    prefers_degree,
    reduced,
)
from shellmb.accuracy.run_record import RunRecord, damped, difference, keep
from shellmb.accuracy.studies.quantity import Quantity
from shellmb.barrier import arrive
from shellmb.running.execute import RunResult
from shellmb.scene import Scene

# norms in which the history of a probe is judged
NORMS = ("l2", "end", "max", "min")
# those of them that are points of the curve, and those that are anywhere on it
POINTS, EXTREMES = NORMS[1:], NORMS[2:]
# those at which a motion is not at rest
CERTAIN = NORMS[:2]
# steps of a motion, and of statics, that the largest steps of companions leave at least
FEWEST, FEWEST_STATIC = 5, 2
# steps that these leave where they are still larger, as they cost next to nothing
MANY = 40
# of Newton's tolerance a looser one tells, where it is not far below all else
LOOSE, LOOSER = 1e-7, 10.0
# elements up to which four times as many along each side are a companion
FEW = 1024
# the penalty of contacts
STIFFER = 4.0


@dataclass(frozen=True)
class Companions:
    """Comparison runs from which the errors of a run follow.

    Args:
        base: What is different in the run from the scene of the family.
        mine: The run.
        steps: The run and those with larger steps, each so many times that of the one before.
        ratio: That factor; below 1 where a smaller step tells.
        mesh: Two runs that differ in their elements; None: not known, or nothing to know.
        better: Whether the first of them has the better elements.
        others: Two runs by the part of the error that they differ in, and which share of it.
        meshes: Three runs whose elements become more, the last one first; none: not known.
    """

    base: Change
    mine: RunRecord
    steps: tuple[RunRecord, ...]
    ratio: float
    mesh: tuple[RunRecord, RunRecord] | None
    better: bool
    others: Mapping[str, tuple[RunRecord, RunRecord, float] | None]
    meshes: tuple[RunRecord, ...] = ()

    def find(
        self, quantity: Quantity, scene: Scene, order: float, resolved: bool = True
    ) -> ErrorEstimate:
        """A quantity with its error.

        Args:
            quantity: The quantity.
            scene: The scene.
            order: Order of its scheme.
            resolved: Whether all curves of the run are.
        """
        parts = {"mesh": NONE, "step": NONE}
        if degree_of(scene) is not None:
            parts["mesh"] = self._mesh(quantity)
        if not scene.static or scene.path is not None:
            step = self._step(quantity, order)
            # what no companion changes, as a count, has no error
            if quantity.norm is None and scene.path is None and step.error > 0:
                step = self._result(quantity, order, resolved)
            # schemes of order 2 damp slow motions, too, so their companions do not agree
            if quantity.norm in CERTAIN and order > 2 and degree_of(scene) is not None:
                taken = damped(self.mine.history, quantity.name)
                if taken > step.error > 0:
                    step = replace(step, error=taken, damped=True)
            parts["step"] = step
        for name, pair in self.others.items():
            away = None if pair is None else difference(pair[0], pair[1], quantity)
            parts[name] = UNKNOWN if pair is None else model_error(away, pair[2])
        return ErrorEstimate(self.mine.size(quantity), parts)

    def _mesh(self, quantity: Quantity) -> Estimate:
        """The error of the mesh."""
        away = None if self.mesh is None else difference(*self.mesh, quantity)
        pairs = [difference(a, b, quantity) for a, b in pairwise(self.meshes)]
        fine, coarse = pairs if len(pairs) == 2 else (None, None)
        levels = None if fine is None or coarse is None else (coarse, fine)
        return mesh_error(away, self.better, levels, self._scale(quantity))

    def _scale(self, quantity: Quantity) -> float:
        """Size of a quantity; of one point of a curve, that of the curve, if it is larger."""
        sizes = [quantity] if quantity.norm is None else [quantity, Quantity(quantity.name, "l2")]
        return max(abs(self.mine.size(each)) for each in sizes)

    def _result(self, quantity: Quantity, order: float, resolved: bool) -> Estimate:
        """The error of the step of a number that a function of the user's gives."""
        found = [kept.extreme(quantity.name) for kept in self.steps]
        extreme = found[0]
        if extreme is not None and found.count(extreme) == len(found):
            # the function takes it from the ends of the steps
            away = abs(abs(self.mine.results[quantity.name]) - abs(self.mine.size(extreme)))
            step = self._step(extreme, order)
            return replace(step, error=step.error + away)
        step = self._alone(quantity, order)
        if resolved:
            return step
        first = step_error(self._differences(quantity)[:1], 1.0, 0.0, self.ratio)
        return replace(step, error=max(step.error, first.error), resolved=False)

    def _step(self, quantity: Quantity, order: float) -> Estimate:
        """The error of the step: of a point of a curve that is not resolved, the largest alike."""
        if quantity.norm is None:
            return self._alone(quantity, order)
        curve = self._curve(quantity.name, order)
        if quantity.norm == "l2":
            return curve
        found = self._alone(quantity, order)
        # what one companion tells of a point is chance, too, as what those tell that are far away;
        # the extreme at the start has no error
        sure = curve.resolved and not (curve.far or curve.rough or found.rough)
        told = sure and (len(self.steps) > 2 or self.ratio < 1)
        # a point of a curve that converges does so; extremes may without the curve
        if quantity.norm == "end":
            found = replace(found, converges=curve.converges)
        if told or found.error == 0:
            return replace(found, resolved=curve.resolved)
        if quantity.norm == "end":
            errors = [found.error, curve.error]
        else:
            points = (replace(quantity, norm=norm) for norm in POINTS)
            errors = [self._alone(point, order).error for point in points]
        return replace(found, error=max(errors), resolved=curve.resolved)

    def _curve(self, name: str, order: float) -> Estimate:
        """The error of a whole curve."""
        found = self._alone(Quantity(name, "l2"), order)
        alternating = self.mine.alternating(name)
        if alternating > found.error > 0:
            return replace(found, error=alternating, resolved=False, converges=True)
        return found

    def _alone(self, quantity: Quantity, order: float) -> Estimate:
        """The error of the step, as differences of one quantity tell it."""
        size = abs(self.mine.size(quantity))
        caution = 2 * CAUTION if quantity.norm in EXTREMES else CAUTION
        away, scale = self._differences(quantity), self._scale(quantity)
        return step_error(away, order, size, self.ratio, caution, scale)

    def _differences(self, quantity: Quantity) -> list[float]:
        """Differences of the runs with other steps, each from the one before it."""
        pairs = [difference(a, b, quantity) for a, b in pairwise(self.steps)]
        return [d for d in pairs if d is not None]


def find_companions(
    family: Family, base: Change, steps: int, known: Companions | None = None
) -> Companions:
    """Run what tells the errors of a run that the family has; collective.

    Args:
        family: The family.
        base: What is different in the run.
        steps: Its number of steps.
        known: Comparison runs with the same mesh, or the same step, which hold for this one
            their errors for that one; None: there are none.
    """
    mine = family.found[base]
    assert mine is not None
    scene = base.apply(family.scene)
    moves = not scene.static or scene.path is not None
    series, ratio = [mine], RATIO
    if known is not None and known.base.step == base.step:
        series, ratio = list(known.steps), known.ratio
    elif moves:
        # all points of a path are equilibria, whatever its steps: one companion tells enough
        for times in (RATIO,) if scene.path is not None else (RATIO, RATIO**2):
            few = len(series) > 1 and steps <= SHAPELESS * times
            larger = None if few else family.run(replace(base, step=base.step * times))
            if larger is None:
                break
            series.append(larger)
        if len(series) == 1:
            # controllers that are sampled once a step have no larger ones
            ratio = 0.5
            smaller = family.run(replace(base, step=base.step * ratio))
            series = [mine] if smaller is None else [smaller, mine]
    mesh, better = None, True
    meshes: tuple[RunRecord, ...] = ()
    times = _largest(scene, steps, len(series) if ratio > 1 else 1)
    coarse = replace(base, step=base.step * times)
    if known is not None and known.base.mesh == base.mesh and moves:
        mesh, better, meshes = known.mesh, known.better, known.meshes
    elif degree_of(scene) is not None:
        fewer = _fewer(family, coarse) if has_resultants(scene) else None
        mesh, better = _mesh_pair(family, base, coarse, scene)
        if mesh is not None and better and has_resultants(scene):
            # fewer and fewer elements; none where a third run costs too much
            if fewer is not None:
                meshes = *mesh, fewer
            elif 16 * elements_of(scene) <= FEW:
                more = family.run(replace(coarse, mesh=4 * coarse.mesh))
                meshes = () if more is None else (more, *mesh)
    others: dict[str, tuple[RunRecord, RunRecord, float] | None] = {}
    for name, change, share in _others(scene, coarse):
        here, there = family.run(coarse), family.run(change)
        others[name] = None if here is None or there is None else (there, here, share)
    return Companions(base, mine, tuple(series), ratio, mesh, better, others, meshes)


def _largest(scene: Scene, steps: int, known: int) -> float:
    """Factor on the step of comparison runs that differ in something else."""
    if scene.path is not None:
        return RATIO
    if scene.static:
        return next((float(n) for n in (5, 4, 3, 2) if steps >= FEWEST_STATIC * n), 1.0)
    if known > 2 and steps >= MANY * RATIO**3:
        return RATIO**3
    few = (RATIO**n for n in range(known - 1, 0, -1))
    return next((times for times in few if steps >= FEWEST * times), 1.0)


def _mesh_pair(
    family: Family, base: Change, coarse: Change, scene: Scene
) -> tuple[tuple[RunRecord, RunRecord] | None, bool]:
    """Two comparison runs with different elements, and whether the first one has better ones."""
    divided, other = replace(coarse, mesh=2 * coarse.mesh), None
    if degree_of(scene) == 2:
        other = replace(coarse, degree=3)
    both = (other, divided) if prefers_degree(scene) else (divided, other)
    found = [change for change in both if change is not None]
    if degree_of(scene) == 3:
        found.append(replace(coarse, degree=2))
    for change in found:
        better = change.degree != 2
        if (kept := family.run(change)) is None:
            continue
        # equilibria without a path do not depend on the steps that lead to them
        same = base if scene.static and scene.path is None and better else coarse
        mine = family.run(same)
        return (None if mine is None else (kept, mine)), better
    return None, True


def _fewer(family: Family, coarse: Change) -> RunRecord | None:
    """A comparison run with half the elements along each side; None where there is no such mesh."""
    half = replace(coarse, mesh=coarse.mesh // 2)
    change = replace(coarse, coarser=2) if coarse.mesh % 2 else half
    found = family.run(change)
    # that is no fault, as four times the elements tell the same
    family.failures.pop(change, None)
    return found


def _others(scene: Scene, coarse: Change) -> list[tuple[str, Change, float]]:
    """Parts of the error beside mesh and step: what tells each, and which share of it is gone."""
    found = []
    if scene.solver.tolerance > LOOSE:
        found.append(("newton", replace(coarse, tolerance=1 / LOOSER), 1 - 1 / LOOSER))
    if reduced(scene):
        found.append(("model", replace(coarse, exact=True), 1.0))
    if scene.contacts:
        found.append(("contact", replace(coarse, stiffness=STIFFER), 1 - 1 / STIFFER))
    return found


def estimate_errors(run: RunResult) -> Errors:
    """Run the comparison runs of a run, and estimate its errors; collective.

    Args:
        run: The run, at its end.
    """
    family, base = Family(run.scene, run.measure, run.simulation.model.comm), Change()
    family.found[base] = keep(run)
    found = find_companions(family, base, run.simulation.step)
    return judged(found, family, run.scene, float(run.simulation.scheme.order))


def judged(found: Companions, family: Family, scene: Scene, order: float) -> Errors:
    """Errors of all quantities of a run.

    Args:
        found: Its comparison runs.
        family: Where they come from.
        scene: Its scene.
        order: Order of its scheme.
    """
    # along a path, points of two runs are not at the same loads
    columns = [] if scene.path is not None else found.mine.columns(scene)
    quantities = [Quantity(name, norm) for name in columns for norm in NORMS]
    probes = {str(q): found.find(q, scene, order) for q in quantities}
    resolved = all(each.step.resolved for each in probes.values())
    named = map(Quantity, found.mine.results)
    results = {q.name: found.find(q, scene, order, resolved) for q in named}
    said = remarks(
        found.mine, found.steps, found.mesh, family.failures, scene, {**results, **probes}
    )
    return Errors(results, probes, said)


def add_errors(run: RunResult, pictures: bool = False) -> RunResult:
    """Estimate the errors of a run and put them into its summary, also the one on disk; collective.

    Args:
        run: The run, at its end.
        pictures: Whether its pictures are drawn, with bands of its errors.

    Returns:
        The run.
    """
    comm = run.simulation.model.comm
    estimate_errors(run).write(run.summary, run.out, comm)
    if pictures and run.out is not None and comm.rank == 0:
        from shellmb.show.pictures import budget_of, draw_directory

        draw_directory(run.out, budget=budget_of(run.summary["wall_s"]))
    arrive(comm)
    return run
