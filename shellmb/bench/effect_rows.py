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

from shellmb.bench.effect_case import Case, Mesh
from shellmb.bench.effect_mechanisms import CASES as MECHANISMS
from shellmb.bench.effect_plates import CASES as PLATES
from shellmb.bench.effect_record import EffectRecord, Side, shares
from shellmb.bench.measure import WARM
from shellmb.effects.count import count
from shellmb.effects.measure import Stepping, in_turn
from shellmb.effects.registry import EFFECTS, find_effect
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


class Unwatched(Stepping):
    """A scene that is stepped while one of the observers does not look.

    It is started, because others ask it for numbers, which then stay as they were.

    Args:
        scene: The scene.
        folder: Where the others write.
        observer: Name of the one that does not look.
    """

    def __init__(self, scene: Scene, folder: Path, observer: str) -> None:
        super().__init__(scene, folder)
        self._left_out = self._timed[observer]
        self._observers.remove(self._left_out)

    def finish(self) -> None:
        """Close the files."""
        super().finish()
        self._left_out.finish(self.simulation, None)


def measure_effects(
    plan: EffectPlan, report: Callable[[str], None] = lambda text: None
) -> list[EffectRecord]:
    """Run all that is planned; collective.

    Args:
        plan: What.
        report: Is told what is going on.
    """
    found = []
    for case, scheme, mesh in plan.cases():
        report(f"{case.effect}, {case.scheme or scheme} {mesh[0]}x{mesh[1]}: with and without it")
        found.append(_row(plan, case, scheme, mesh))
        # meshes and matrices are freed collectively
        gc.collect()
    return found


def _row(plan: EffectPlan, case: Case, scheme: str, mesh: Mesh) -> EffectRecord:
    effect = EFFECTS[case.effect]
    scene, less = case.pair(scheme, mesh)
    comm = MPI.COMM_WORLD
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(comm.bcast(scratch))
        if effect.observer is None:
            having, lacking = Stepping(scene, folder / "with"), Stepping(less, folder / "without")
        else:
            scene = _long(scene, WARM + plan.steps * plan.rounds)
            having = Stepping(scene, folder / "with")
            lacking = Unwatched(scene, folder / "without", effect.observer)
        both = having, lacking
        for one in both:
            one.begin(WARM, 0)
        before = [_factorisations(one) for one in both]
        # scenes begin again; observers go on, because a frame or a row is written once
        step = Stepping.round if effect.observer is None else _go_on
        pairs = in_turn(
            lambda: step(having, plan.steps), lambda: step(lacking, plan.steps), plan.rounds
        )
        own = 0 if effect.observer is None else len(having.kernels[effect.observer])
        sides = [
            _side(one, [pair[k] for pair in pairs], _factorisations(one) - before[k], plan)
            for k, one in enumerate(both)
        ]
        for one in both:
            one.finish()
        comm.Barrier()
    with_it, without = sides
    saved, spread = shares(pairs)
    return EffectRecord(
        effect=effect.name,
        group=effect.group,
        scheme=scene.scheme_name,
        mesh=f"{mesh[0]}x{mesh[1]}" if case.meshed else "-",
        having=replace(with_it, kernels=with_it.kernels + own),
        lacking=without,
        saved=saved,
        spread=spread,
        rounds=plan.rounds,
        ranks=comm.size,
    )


def _long(scene: Scene, steps: int) -> Scene:
    """A scene with at least so many steps, and a frame at every tenth of them."""
    assert scene.dt is not None
    frames = -(-steps // FRAME)
    return replace(scene, t_end=frames * FRAME * scene.dt, output=Output(frames=frames + 1))


def _go_on(stepping: Stepping, steps: int) -> float:
    """Processor time of one of the steps after those so far, s; of several ranks the slowest."""
    begin = time.process_time()
    stepping.begin(0, steps)
    spent = time.process_time() - begin
    return float(stepping.simulation.model.comm.allreduce(spent, op=MPI.MAX)) / steps


def _factorisations(stepping: Stepping) -> int:
    return stepping.simulation.problem.iteration.factorisations


def _side(
    stepping: Stepping, times: Sequence[float], factorisations: int, plan: EffectPlan
) -> Side:
    """Counts of a scene, and what its steps took."""
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
        factorisations / (min(simulation.step, plan.steps) * plan.rounds),
        median(times),
    )
