"""Cost of derivatives: steps of the plate of README with and without them.

`python -m tests.bench.sensitivities`. Processor time of steps, set-up excluded, of both runs in
turn, the median of several rounds. Then what the sweep backwards costs, for the thickness of each
element, in runs, and what is spent before it, once: forms in UFL and kernels from the cache.
`python -m tests.bench.sensitivities back` prints the latter only; `forward` and `paths`, along
static paths, are the others.
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Sequence
from dataclasses import replace

from shellmb.observers.history import History
from shellmb.observers.probes import Probes
from shellmb.running.loader import load
from shellmb.running.standard import StandardObservers
from shellmb.scene import Scene
from shellmb.sensitivity.adjoint.elementwise import ElementField, changes, varying
from shellmb.sensitivity.adjoint.run import Reading
from shellmb.sensitivity.adjoint.steps import Steps
from shellmb.sensitivity.adjoint.sweep import Sweep
from shellmb.sensitivity.parameters import (
    Differentiated,
    differentiated,
)
from shellmb.sensitivity.paths import PathTangents
from shellmb.sensitivity.perturbed_run import PerturbedRun
from shellmb.sensitivity.tangent import Pair, Tangents
from shellmb.simulate.simulation import Observer, Simulation
from tests.sensitivity.path_scenes import roof

# mesh, steps, scheme, Newton's method, parameters, columns
CASES = (
    ((6, 2), 100, "ep", "full", ("thickness",), "probes"),
    ((6, 2), 200, "ep", "auto", ("thickness",), "probes"),
    ((6, 2), 200, "ep", "auto", ("thickness", "force"), "probes"),
    ((6, 2), 200, "ep", "auto", ("thickness", "force", "E", "density"), "probes"),
    ((6, 2), 200, "ep", "auto", ("thickness",), "all"),
    ((6, 2), 200, "ep4", "auto", ("thickness",), "probes"),
    ((32, 32), 20, "ep", "auto", ("thickness",), "probes"),
    ((32, 32), 20, "ep", "auto", ("thickness", "force"), "probes"),
    ((32, 32), 20, "ep", "auto", ("thickness", "force", "E", "density"), "probes"),
    ((32, 32), 20, "ep", "full", ("thickness",), "probes"),
)
ROUNDS = 3
# mesh and steps along the path of a hinged roof, and parameters
PATHS = (
    ((8, 8), 12, ("thickness",)),
    ((8, 8), 12, ("thickness", "E", "radius")),
    ((16, 16), 8, ("thickness",)),
)
# mesh, steps, scheme, Newton's method of runs that go backwards
BACK = (
    ((6, 2), 100, "ep", "auto"),
    ((6, 2), 100, "ep", "full"),
    ((6, 2), 50, "ed", "auto"),
    ((6, 2), 50, "ep4", "auto"),
    ((6, 2), 50, "ed3", "auto"),
    ((6, 2), 20, "static", "auto"),
    ((32, 32), 10, "ep", "auto"),
    ((32, 32), 10, "ep", "full"),
    ((32, 32), 6, "ed", "auto"),
    ((32, 32), 6, "ep4", "auto"),
    ((32, 32), 6, "ed3", "auto"),
    ((32, 32), 6, "static", "auto"),
)


def plate(
    thickness: float = 2e-3, force: float = 2.0, E: float = 210e9, density: float = 7870.0
) -> Scene:
    """Scene `sudden_load` with more parameters."""
    scene = load("sudden_load").module.scene(force=force, thickness=thickness)
    (body,) = scene.shells
    material = replace(body.section, E=E, density=density)
    return replace(scene, shells=replace(body, section=material))


def observers(columns: str) -> list[Observer]:
    """Observers of a scene beside the run."""
    if columns == "all":
        named = StandardObservers(None).named.items()
        return [o for name, o in named if not name.startswith(("watch", "stop"))]
    probes = Probes()
    return [probes, History([probes])]


def started(
    mesh: tuple[int, int],
    steps: int,
    scheme: str,
    newton: str,
    names: Sequence[str],
    columns: str,
) -> tuple[Simulation, list[Observer]]:
    """A run of the plate with derivatives by some parameters, before its first step."""
    made = differentiated(plate, None, mesh=mesh, scheme=scheme, newton=newton, t_end=steps * 1e-3)
    return beside_it(made, names, columns)


def beside_it(
    made: Differentiated, names: Sequence[str], columns: str
) -> tuple[Simulation, list[Observer]]:
    """A run with derivatives by some parameters before its first step, and its observers."""
    base = made.scene()

    def make(run: Simulation) -> list[Pair]:
        forces, made_pairs = columns == "all", []
        for p in made.parameters(names):
            above, below = (
                PerturbedRun(Simulation(scene, like=run), observers(columns), forces)
                for scene in made.beside(base, p)
            )
            made_pairs.append(Pair(p, above, below))
        return made_pairs

    run = Simulation(base)
    every: list[Observer] = list(StandardObservers(None).named.values())
    if names:
        every.append(PathTangents(make) if base.path else Tangents(make))
    for observer in every:
        observer.start(run)
    return run, every


def seconds(runs: Sequence[tuple[Simulation, list[Observer]]], steps: int) -> list[float]:
    """Processor times of the steps of some runs, which make them in turn, s."""
    spent = [0.0] * len(runs)
    for _ in range(steps):
        for k, (run, every) in enumerate(runs):
            begin = time.process_time()
            run.advance(every)
            spent[k] += time.process_time() - begin
    return spent


def there_and_back(
    mesh: tuple[int, int], steps: int, scheme: str, newton: str
) -> tuple[float, float, float]:
    """Processor time of the steps of a run, of the sweep back over them, and before it, s."""
    made = differentiated(
        "sudden_load", None, mesh=mesh, scheme=scheme, newton=newton, t_end=steps * 1e-3
    )
    place, kept = ElementField("plate", "thickness"), Steps()
    run = Simulation(varying(made.scene(), (place,)))
    every: list[Observer] = [*StandardObservers(None).named.values(), kept]
    for observer in every:
        observer.start(run)
    begin = time.process_time()
    while run.step < steps:
        run.advance(every)
    forth = time.process_time() - begin
    begin = time.process_time()
    found = changes(run.model.shells[place.body], place.name, None)
    sweep = Sweep(run, [(place.body, found)], False)
    before = time.process_time() - begin
    reading = Reading(run, run.scene.probes[0])
    begin = time.process_time()
    for step in kept.backwards(run):
        reading.add(sweep.covector, 1.0)
        sweep.back(step, *kept.times[step.number])
    return forth, time.process_time() - begin, before


def forward() -> None:
    """Print a line for each case of derivatives beside the run."""
    print("mesh   scheme newton columns  parameters        run [ms/step]  share per parameter")
    for mesh, steps, scheme, newton, names, columns in CASES:
        alone, shares = [], []
        for _ in range(ROUNDS):
            runs = [started(mesh, steps, scheme, newton, by, columns) for by in ((), names)]
            own, with_them = seconds(runs, steps)
            alone.append(own)
            shares.append((with_them / own - 1) / len(names))
        share = statistics.median(shares)
        print(
            f"{mesh[0]}x{mesh[1]:<4} {scheme:6} {newton:6} {columns:8} {','.join(names):17} "
            f"{1e3 * min(alone) / steps:13.3f}  {share:.2f}",
            flush=True,
        )


def along() -> None:
    """Print a line for each case of derivatives along a static path."""
    print("mesh   parameters               run [ms/step]  share per parameter")
    for mesh, steps, names in PATHS:
        made = differentiated(roof, None, mesh=mesh)
        rounds = [
            seconds([beside_it(made, by, "probes") for by in ((), names)], steps)
            for _ in range(ROUNDS)
        ]
        alone, together = map(min, zip(*rounds, strict=True))
        print(
            f"{mesh[0]}x{mesh[1]:<4} {','.join(names):24} {1e3 * alone / steps:13.3f}  "
            f"{(together / alone - 1) / len(names):.2f}",
            flush=True,
        )


def backward() -> None:
    """Print a line for each case of a sweep backwards."""
    print("mesh   scheme newton  run [ms/step]  sweep [runs]  before it [s]")
    for mesh, steps, scheme, newton in BACK:
        rounds = [there_and_back(mesh, steps, scheme, newton) for _ in range(ROUNDS)]
        forth, back, before = map(min, zip(*rounds, strict=True))
        print(
            f"{mesh[0]}x{mesh[1]:<4} {scheme:6} {newton:6} {1e3 * forth / steps:13.3f} "
            f"{back / forth:13.2f} {before:14.2f}",
            flush=True,
        )


def main() -> None:
    """Print a line for each case."""
    parts = {"forward": forward, "paths": along, "back": backward}
    wanted = sys.argv[1:] or list(parts)
    for name in wanted:
        if name not in parts:
            sys.exit(f"part '{name}' is unknown; it must be one of {', '.join(parts)}")
    for name in wanted:
        parts[name]()


if __name__ == "__main__":
    main()
