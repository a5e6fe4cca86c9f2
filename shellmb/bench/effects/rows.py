"""Times steps with and without each effect, in one process and in turn."""

from __future__ import annotations

import gc
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median

from mpi4py import MPI

from shellmb.bench.effects.case import Case, Mesh
from shellmb.bench.effects.mechanisms import CASES as MECHANISMS
from shellmb.bench.effects.plates import CASES as PLATES
from shellmb.bench.effects.record import EffectRecord, Side, shares
from shellmb.bench.measure import WARM
from shellmb.effects.catalogue.registry import EFFECTS, find_effect
from shellmb.effects.count import count
from shellmb.effects.measure import Stepping, in_turn
from shellmb.errors import SceneError
from shellmb.scene import Output, Scene

# effects that no step pays for, or that cannot be left out: why they have no row
_FIRST = "acts before the first step only"
NO_ROW = {
    "initial_velocity": _FIRST,
    "equilibrium_start": _FIRST,
    "assembly": _FIRST,
    "bending": "no shell or beam can do without",
    "drilling": "no shell has",
    "material_damping": "no section has",
}
_MADE: dict[str, Case] = {case.effect: case for case in (*PLATES, *MECHANISMS)}
# in the order of the registry, which is that of their groups
CASES = {name: _MADE[name] for name in EFFECTS if name in _MADE}
# a frame is written at every tenth step, as in the demo of the plate
FRAME = 10

Sides = tuple[Side, Side]
Pairs = list[tuple[float, float]]


@dataclass(frozen=True)
class EffectPlan:
    """What is measured.

    Args:
        effects: Names of effects; empty: all that have a case.
        schemes: Time schemes, where the effect leaves the choice.
        meshes: Elements of the plate along and across.
        steps: Steps of a round.
        rounds: Rounds; in each both scenes are run.
    """

    effects: Sequence[str] = ()
    schemes: Sequence[str] = ("ep",)
    meshes: Sequence[Mesh] = ((16, 4),)
    steps: int = 20
    rounds: int = 15

    def cases(self) -> list[tuple[Case, str, Mesh]]:
        """Case, scheme and mesh of all; what a case has no choice of is measured once.

        Raises:
            SceneError: If there is no such effect, or a step does not pay for it.
        """
        found = []
        for name in self.effects or CASES:
            find_effect(name)
            if name in NO_ROW:
                raise SceneError(
                    f"bench: effect is '{name}', which {NO_ROW[name]}; it must be another one"
                )
            case = CASES[name]
            meshes = self.meshes if case.meshed else self.meshes[:1]
            schemes = self.schemes if case.scheme is None else (case.scheme,)
            found += [(case, scheme, mesh) for mesh in meshes for scheme in schemes]
        return found


def measure_effects(
    plan: EffectPlan, report: Callable[[str], None] = lambda text: None
) -> list[EffectRecord]:
    """Run all that is planned; collective.

    Args:
        plan: What.
        report: Is told what is going on.
    """
    found = []
    comm = MPI.COMM_WORLD
    for case, scheme, mesh in plan.cases():
        effect, pair = EFFECTS[case.effect], case.pair(scheme, mesh)
        row = (effect.name, effect.group, pair[0].scheme_name, case.size(mesh))
        report(f"{row[0]}, {row[2]} {row[3]}: with and without it")
        with tempfile.TemporaryDirectory() as scratch:
            folder = Path(comm.bcast(scratch))
            if effect.observer is None:
                sides, pairs = _compared(pair, folder, plan)
            else:
                sides, pairs = _observed(pair[0], effect.observer, folder, plan)
            comm.Barrier()
        found.append(EffectRecord(*row, *sides, *shares(pairs), plan.rounds, comm.size))
        # meshes and matrices are freed collectively
        gc.collect()
    return found


def _compared(pair: tuple[Scene, Scene], folder: Path, plan: EffectPlan) -> tuple[Sides, Pairs]:
    """Two scenes whose first steps are run in turn."""
    having, lacking = Stepping(pair[0], folder / "with"), Stepping(pair[1], folder / "without")
    having.begin(WARM, 0)
    lacking.begin(WARM, 0)
    before = _factorisations(having), _factorisations(lacking)
    pairs = in_turn(
        lambda: having.round(plan.steps), lambda: lacking.round(plan.steps), plan.rounds
    )
    # each round begins at the start again, so that the last step's number is that of its steps
    having_times, lacking_times = zip(*pairs, strict=True)
    done = having.simulation.step * plan.rounds, lacking.simulation.step * plan.rounds
    sides = (
        _side(having, having_times, before[0], done[0]),
        _side(lacking, lacking_times, before[1], done[1]),
    )
    having.finish()
    lacking.finish()
    return sides, pairs


def _observed(scene: Scene, observer: str, folder: Path, plan: EffectPlan) -> tuple[Sides, Pairs]:
    """A scene, and the time that one of its observers takes in the same steps.

    Steps go on from round to round: a row or a frame is written once. What most of them take is
    less than the noise of two runs, be they as close in time as can be.
    """
    assert scene.dt is not None
    # a frame is written at every tenth step
    frames = -(-(WARM + plan.steps * plan.rounds) // FRAME)
    long = replace(scene, t_end=frames * FRAME * scene.dt, output=Output(frames=frames + 1))
    stepping = Stepping(long, folder)
    stepping.begin(WARM, 0)
    before, pairs = _factorisations(stepping), []
    for _ in range(plan.rounds):
        begin = time.process_time()
        stepping.begin(0, plan.steps)
        spent = (time.process_time() - begin) / plan.steps
        spent = float(stepping.simulation.model.comm.allreduce(spent, op=MPI.MAX))
        pairs.append((spent, spent * (1 - (stepping.observer_share(observer) or 0.0))))
    without = _side(stepping, [less for _, less in pairs], before, plan.steps * plan.rounds)
    own = len(stepping.kernels[observer])
    having = replace(
        without, kernels=without.kernels + own, step_s=median(spent for spent, _ in pairs)
    )
    stepping.finish()
    return (having, without), pairs


def _factorisations(stepping: Stepping) -> int:
    return stepping.simulation.problem.iteration.factorisations


def _side(stepping: Stepping, times: Sequence[float], before: int, done: int) -> Side:
    """Counts of a scene, and what its steps took.

    Args:
        stepping: The scene after all rounds.
        times: Processor time of a step in each of them, s.
        before: Factorisations before the first round.
        done: Steps since then.
    """
    simulation = stepping.simulation
    problem = simulation.problem
    made = count(problem)
    return Side(
        made.unknowns,
        problem.iteration.linear.size,
        made.stored,
        made.coefficients,
        made.integrals,
        made.kernels,
        simulation.iterations / simulation.step,
        (_factorisations(stepping) - before) / done,
        median(times),
    )
