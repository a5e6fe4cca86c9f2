"""Error against time of shellmb and Exudyn on one problem, run in turn."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from shellmb.bench.peers import exudyn_plate, our_plate
from shellmb.bench.peers.exudyn_plate import ExudynPlate
from shellmb.bench.peers.history import TipHistory, difference
from shellmb.bench.peers.our_plate import OurPlate

type Plate = OurPlate | ExudynPlate

# errors that are asked for
ASKED = (1e-2, 1e-3)
OURS, EXUDYN = "shellmb", "Exudyn"


@dataclass(frozen=True)
class Point:
    """One run of the study.

    Args:
        code: "shellmb" or "Exudyn".
        scheme: "EP", "ED alpha=1", "rho=0.9".
        mesh: Elements, "6x2".
        dt: Time step, s.
        error: L2 norm over time of the error of the tip, relative to that of the tip's deflection.
        largest: Largest error over the largest deflection.
        error_own: As `error`, against the converged answer of the code itself.
        cpu_s: Processor time of the steps, s; the least of all runs.
        wall_s: Wall time of the steps, s; the least of all runs.
        iterations: Newton iterations per step.
        factorisations: Factorisations per step.
        failed: Why it ended early; "" if it did not.
    """

    code: str
    scheme: str
    mesh: str
    dt: float
    error: float | None
    largest: float | None
    error_own: float | None
    cpu_s: float
    wall_s: float
    iterations: float
    factorisations: float
    failed: str


@dataclass(frozen=True)
class Study:
    """What is run.

    Args:
        meshes: Of shellmb.
        steps: Of shellmb, s.
        peer_meshes: Of Exudyn.
        peer_steps: Of Exudyn, s.
        fine: Converged answers of shellmb, the finest first; the others check it.
        peer_fine: Those of Exudyn.
        again: How often what may be best is run again, the codes in turn.
    """

    meshes: Sequence[tuple[int, int]] = ((3, 1), (8, 1), (8, 2), (12, 2))
    steps: Sequence[float] = (2e-2, 1e-2, 5e-3, 2.5e-3)
    peer_meshes: Sequence[tuple[int, int]] = ((8, 1), (8, 2), (12, 2), (12, 4), (16, 4))
    peer_steps: Sequence[float] = (2.5e-3, 1e-3)
    fine: Sequence[OurPlate] = (
        OurPlate((16, 4), 1e-3, "ed", 0.0),
        OurPlate((12, 4), 2e-3, "ed", 0.0),
    )
    peer_fine: Sequence[ExudynPlate] = (
        ExudynPlate((24, 6), 1e-3),
        ExudynPlate((16, 4), 5e-4),
    )
    again: int = 2

    def plates(self) -> list[Plate]:
        """All runs, the codes in turn as long as both have some."""
        ours: list[Plate] = [
            OurPlate(mesh, dt, scheme, alpha)
            for mesh in self.meshes
            for dt in self.steps
            for scheme, alpha in (("ep", 1.0), ("ed", 1.0), ("ed", 0.0))
        ]
        theirs: list[Plate] = [
            ExudynPlate(mesh, dt, spectral_radius=radius)
            for mesh in self.peer_meshes
            for dt in self.peer_steps
            for radius in (0.9, 1.0)
        ]
        return in_turn(ours, theirs)


def quick() -> Study:
    """What a test can wait for."""
    return Study(
        meshes=((2, 1),),
        steps=(2e-2,),
        peer_meshes=((2, 1),),
        peer_steps=(2.5e-3,),
        fine=(OurPlate((3, 1), 1e-2, "ed", 0.0), OurPlate((2, 1), 1e-2)),
        peer_fine=(ExudynPlate((4, 1), 2.5e-3), ExudynPlate((2, 1), 2.5e-3)),
        again=1,
    )


@dataclass(frozen=True)
class Comparison:
    """What came out.

    Args:
        points: All runs.
        checks: Differences of converged answers (L2 norm over time, relative) by what they are of.
        peaks: Largest deflection of both converged answers by code, m.
        apart: Whether the codes' own converged answers are the measure, because they differ by more
            than half the smallest error asked for.
    """

    points: tuple[Point, ...]
    checks: dict[str, float]
    peaks: dict[str, float]
    apart: bool

    def judged(self, point: Point) -> float:
        """The error of a run that counts."""
        error = point.error_own if self.apart else point.error
        return np.inf if error is None else error

    def best(self, code: str, error: float) -> Point | None:
        """The fastest run of a code with at most that error, by processor time."""
        some = [p for p in self.points if p.code == code and self.judged(p) <= error]
        return min(some, key=lambda p: p.cpu_s, default=None)

    def front(self, code: str) -> list[Point]:
        """Runs that no other one beats in both error and time, the fastest first."""
        found: list[Point] = []
        for p in sorted((p for p in self.points if p.code == code), key=lambda p: p.cpu_s):
            if self.judged(p) < min((self.judged(f) for f in found), default=np.inf):
                found.append(p)
        return found


def run(plate: Plate) -> TipHistory:
    """Run it in its code."""
    if isinstance(plate, ExudynPlate):
        return exudyn_plate.run(plate)
    return our_plate.run(plate)


def in_turn(first: Sequence[Plate], second: Sequence[Plate]) -> list[Plate]:
    """Elements of two lists by turns, spread evenly."""
    both = [((k + 0.5) / len(some), p) for some in (first, second) for k, p in enumerate(some)]
    return [p for _, p in sorted(both, key=lambda pair: pair[0])]


def compare(study: Study, report: Callable[[str], None] = lambda text: None) -> Comparison:
    """Run the study.

    Args:
        study: What.
        report: Is told what is going on.
    """
    report("converged answers")
    ours = [run(p) for p in study.fine]
    theirs = [run(p) for p in study.peer_fine]
    checks = {}
    families: list[tuple[str, Sequence[Plate], list[TipHistory]]] = [
        (OURS, study.fine, ours),
        (EXUDYN, study.peer_fine, theirs),
    ]
    for code, plates, found in families:
        for plate, other in zip(plates[1:], found[1:], strict=True):
            name = f"{code}: {title(plate)} against {title(plates[0])}"
            checks[name] = difference(other, found[0])[0]
    apart = difference(theirs[0], ours[0])[0]
    checks[f"{EXUDYN} against {OURS}, both converged"] = apart
    points: dict[Plate, Point] = {}

    def add(plate: Plate) -> None:
        history = run(plate)
        own = ours[0] if isinstance(plate, OurPlate) else theirs[0]
        found = _point(plate, history, ours[0], own)
        before = points.get(plate, found)
        points[plate] = replace(
            found,
            cpu_s=min(found.cpu_s, before.cpu_s),
            wall_s=min(found.wall_s, before.wall_s),
        )

    every = study.plates()
    for n, plate in enumerate(every):
        if n % 10 == 0:
            report(f"run {n + 1} of {len(every)}")
        add(plate)
    peaks = {OURS: ours[0].peak, EXUDYN: theirs[0].peak}
    made = Comparison(tuple(points.values()), checks, peaks, bool(apart > min(ASKED) / 2))
    names = {point: plate for plate, point in points.items()}
    fronts = [[names[p] for p in made.front(code)] for code in (OURS, EXUDYN)]
    report(f"the best once more, {study.again} times in turn")
    for plate in in_turn(*fronts) * study.again:
        add(plate)
    return replace(made, points=tuple(points.values()))


def _point(plate: Plate, history: TipHistory, truth: TipHistory, own: TipHistory) -> Point:
    code = OURS if isinstance(plate, OurPlate) else EXUDYN
    error, largest = difference(history, truth)
    own_error, _ = difference(history, own)
    return Point(
        code,
        scheme_of(plate),
        f"{plate.mesh[0]}x{plate.mesh[1]}",
        plate.dt,
        _finite(error),
        _finite(largest),
        _finite(own_error),
        history.cpu_s,
        history.wall_s,
        history.iterations,
        history.factorisations,
        history.failed,
    )


def _finite(error: float) -> float | None:
    """An error as JSON knows it."""
    return float(error) if np.isfinite(error) else None


def scheme_of(plate: Plate) -> str:
    """Its time scheme in words."""
    if isinstance(plate, ExudynPlate):
        newton = "" if plate.modified else ", full Newton"
        return f"rho={plate.spectral_radius:g}{newton}"
    return "EP" if plate.scheme == "ep" else f"ED alpha={plate.alpha:g}"


def title(plate: Plate) -> str:
    """Mesh, step and scheme."""
    return f"{plate.mesh[0]}x{plate.mesh[1]}, dt = {plate.dt:g} s, {scheme_of(plate)}"


def large_load(
    steps: Sequence[float] = (4e-3, 1e-3), t_end: float = 1.0
) -> list[tuple[Plate, TipHistory]]:
    """The same plate, 12x2, under 40 N: who comes through, with which step.

    Args:
        steps: Time steps, s.
        t_end: End, s.
    """
    mesh, force = (12, 2), 40.0
    plates: list[Plate] = []
    for dt in steps:
        plates += [OurPlate(mesh, dt, s, force=force, t_end=t_end) for s in ("ep", "ed")]
        plates += [
            ExudynPlate(mesh, dt, force, t_end, radius, modified=modified)
            for radius in (0.9, 1.0)
            for modified in (True, False)
        ]
    return [(plate, run(plate)) for plate in plates]
