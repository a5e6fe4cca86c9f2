"""Measures the configurations one beside the other, so that noise hits all alike."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

from mpi4py import MPI

from shellmb.demos.effects.stepping import WARM, in_turn, scratch
from shellmb.meshes.lifetime import free
from tests.bench.memory import peak_mib
from tests.bench.record import (
    AUTO,
    CONFIGURATIONS,
    MODIFIED,
    UNREDUCED,
    Configuration,
    Measured,
    Record,
    typical,
)
from tests.bench.runner import Runner
from tests.bench.scenes import plate

# at this size memory is measured without being asked for
LARGE = 4096
# from this size on, modified Newton is not measured
MANY = 1000
# the unreduced path has about so many unknowns per element, and is left out beyond the limit
UNKNOWNS = {"ep": 50, "ed": 100, "static": 50}
LIMIT = 150_000


@dataclass(frozen=True)
class Plan:
    """Plan of what is measured.

    Args:
        scenes: "dynamic", "triangles" (dynamic ones of triangles), "static".
        schemes: Time schemes of the dynamic ones.
        meshes: Elements along and across.
        steps: Steps of a round; None: by the size of the mesh.
        rounds: Rounds of each configuration.
        memory: Whether peak memory is measured for all; else for the default at large meshes.
        limit: The unreduced path is left out where it has more unknowns, about.
        clock: "cpu" or "wall".
    """

    scenes: Sequence[str] = ("dynamic", "static")
    schemes: Sequence[str] = ("ep", "ed", "ep4", "ed3")
    meshes: Sequence[tuple[int, int]] = ((6, 2), (16, 4), (32, 32), (64, 64))
    steps: int | None = None
    rounds: int = 3
    memory: bool = False
    limit: int = LIMIT
    clock: str = "wall"

    def cases(self) -> list[tuple[str, str, tuple[int, int]]]:
        """Scene, scheme and mesh of all, small ones first."""
        found = []
        for mesh in self.meshes:
            for kind in self.scenes:
                schemes = self.schemes if kind != "static" else ("static",)
                found += [(kind, scheme, mesh) for scheme in schemes]
        return found

    def length(self, kind: str, mesh: tuple[int, int], how: Configuration) -> int:
        """Steps of a round.

        Lagging factorisations need enough steps to be seen at their usual rate, and a frame is
        written at every tenth step; full Newton is the same in each.
        """
        elements = mesh[0] * mesh[1]
        if kind == "static":
            return 5 if elements < 100 else 1
        if self.steps is not None:
            return self.steps
        if elements < 100:
            return 40 if elements < 30 else 20
        if how == AUTO:
            return 10
        few = 3 if how.path == "reduced" else 2
        return few if elements < LARGE else 1


def measure(plan: Plan, report: Callable[[str], None] = lambda text: None) -> list[Measured]:
    """Run all that is planned; collective."""
    found = []
    for kind, scheme, mesh in plan.cases():
        name = f"{kind} {scheme} {mesh[0]}x{mesh[1]}"
        unknowns = UNKNOWNS.get(scheme, 100) * mesh[0] * mesh[1]
        some = [c for c in CONFIGURATIONS if c.path != "full" or unknowns <= plan.limit]
        if UNREDUCED not in some:
            report(f"{name}: no unreduced path (about {unknowns} unknowns, limit {plan.limit})")
        if mesh[0] * mesh[1] >= MANY:
            # between the two others, and each takes its time
            some = [c for c in some if c != MODIFIED]
        report(f"{name}: {', '.join(map(str, some))}")
        found += _measure_case(plan, kind, scheme, mesh, some)
    return found


def _measure_case(
    plan: Plan, kind: str, scheme: str, mesh: tuple[int, int], some: Sequence[Configuration]
) -> list[Measured]:
    """Rounds of all configurations in turn."""
    comm = MPI.COMM_WORLD
    with scratch() as folder:
        runners = [
            Runner(plate(kind, scheme, mesh, how), folder / str(how).replace("/", "-"))
            for how in some
        ]
        warm = 1 if kind == "static" else WARM
        for how, runner in zip(some, runners, strict=True):
            # full Newton has nothing to learn
            runner.advance(warm if how.newton != "full" or mesh[0] * mesh[1] < 100 else 1)
        works = [
            partial(runner.round, plan.length(kind, mesh, how))
            for how, runner in zip(some, runners, strict=True)
        ]
        rounds = in_turn(plan.rounds, works)
        unknowns = [r.unknowns for r in runners]
        for runner in runners:
            runner.stepping.finish()
        del runners, runner, works
        free()
    found = []
    for k, how in enumerate(some):
        own = tuple(r[k] for r in rounds)
        best = typical(own)
        record = Record(
            kind,
            scheme,
            how.path,
            how.newton,
            f"{mesh[0]}x{mesh[1]}",
            mesh[0] * mesh[1],
            unknowns[k],
            best.iterations,
            best.factorisations,
            best.step_s,
            **best.parts,
            bare_s=best.bare_s,
            peak_mib=None,
            ranks=comm.size,
        )
        large = record.elements >= LARGE and how == AUTO
        if comm.size == 1 and (plan.memory or large):
            record = replace(record, peak_mib=peak_mib(kind, scheme, mesh, how))
        found.append(Measured(record, own))
    return found


def quick() -> Plan:
    """Plan that a test can wait for."""
    return Plan(schemes=("ep", "ed"), meshes=((4, 1),), steps=5, rounds=2)
