"""Times steps with and without each effect, in one process and in turn."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from statistics import median

from mpi4py import MPI

import numpy as np

from shellmb.accuracy.measuring import slowest
from shellmb.arrays import Ints
from shellmb.demos.effects.catalogue.registry import EFFECTS, find_effect
from shellmb.demos.effects.count import count
from shellmb.demos.effects.stepping import WARM, Stepping, in_turn, observer_shares, scratch, shares
from shellmb.demos.verification.measuring import Stopwatch
from shellmb.errors import SceneError
from shellmb.meshes.lifetime import free
from shellmb.scene import Output, Scene
from tests.bench.effects.case import Case, Mesh
from tests.bench.effects.mechanisms import CASES as MECHANISMS
from tests.bench.effects.plates import CASES as PLATES
from tests.bench.effects.record import EffectRecord, Side

# effects that no step pays for, or that cannot be left out: why they have no row
_FIRST = "acts before the first step only"
_BESIDE = "is computed beside runs"
NO_ROW = {
    "initial_velocity": _FIRST,
    "equilibrium_start": _FIRST,
    "state_start": _FIRST,
    "assembly": _FIRST,
    "bending": "no shell or beam can do without",
    "drilling": "no shell has",
    "modes_in_rotation": _BESIDE,
    "modes_of_states": _BESIDE,
    "linear_buckling": _BESIDE,
}
_MADE: dict[str, Case] = {case.effect: case for case in (*PLATES, *MECHANISMS)}
# in the order of the registry, which is that of their groups
CASES = {name: _MADE[name] for name in EFFECTS if name in _MADE}
# a frame is written at every tenth step, as in the demo of the plate
FRAME = 10

Sides = tuple[Side, Side]
Pairs = list[tuple[float, ...]]


@dataclass(frozen=True)
class EffectPlan:
    """Plan of what is measured.

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
    """Run all that is planned; collective."""
    found = []
    for case, scheme, mesh in plan.cases():
        effect, pair = EFFECTS[case.effect], case.pair(scheme, mesh)
        row = (effect.name, effect.group, pair[0].scheme_name, case.size(mesh))
        report(f"{row[0]}, {row[2]} {row[3]}: with and without it")
        with scratch() as folder:
            if effect.observer is None:
                sides, pairs = _compared(pair, folder, plan)
            else:
                sides, pairs = _observed(pair[0], effect.observer, folder, plan)
        ranks = MPI.COMM_WORLD.size
        found.append(EffectRecord(*row, *sides, *shares(pairs), plan.rounds, ranks))
        free()
    return found


def _compared(pair: tuple[Scene, Scene], folder: Path, plan: EffectPlan) -> tuple[Sides, Pairs]:
    """Two scenes whose first steps are run in turn."""
    both = [Stepping(scene, folder / str(k)) for k, scene in enumerate(pair)]
    before = []
    for stepping in both:
        stepping.advance(WARM)
        before.append(_numbers(stepping))
    pairs = in_turn(plan.rounds, [partial(stepping.round, plan.steps) for stepping in both])
    having, lacking = map(_side, both, zip(*pairs, strict=True), before)
    for stepping in both:
        stepping.finish()
    return (having, lacking), pairs


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
    stepping.advance(WARM)
    before, pairs = _numbers(stepping), Pairs()
    for _ in range(plan.rounds):
        watch = Stopwatch()
        share = observer_shares(stepping, plan.steps)[observer]
        spent = slowest(MPI.COMM_WORLD, watch.cpu / plan.steps)
        pairs.append((spent, spent * (1 - share)))
    own, less = zip(*pairs, strict=True)
    without = _side(stepping, less, before)
    kernels = without.kernels + len(stepping.observers[observer].kernels)
    having = replace(without, kernels=kernels, step_s=median(own))
    stepping.finish()
    return (having, without), pairs


def _numbers(stepping: Stepping) -> Ints:
    """Steps, iterations and factorisations so far."""
    return np.array([stepping.steps, stepping.iterations, stepping.factorisations])


def _side(stepping: Stepping, times: Sequence[float], before: Ints) -> Side:
    """Counts of a scene, and what its steps took.

    Args:
        stepping: The scene after all rounds.
        times: Processor time of a step in each of them, s.
        before: Its numbers before the first round.
    """
    problem = stepping.simulation.problem
    made = count(problem)
    steps, iterations, factorisations = map(int, _numbers(stepping) - before)
    return Side(
        made.unknowns,
        problem.iteration.linear.size,
        made.stored,
        made.coefficients,
        made.integrals,
        made.kernels,
        iterations / steps,
        factorisations / steps,
        median(times),
    )
