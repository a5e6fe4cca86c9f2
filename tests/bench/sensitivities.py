"""Cost of derivatives: steps of the plate of README with and without them.

`python -m tests.bench.sensitivities`. Processor time of steps, set-up excluded, the shortest of
several rounds in turn. Then what the sweep backwards costs, for the thickness of each element.
"""

from __future__ import annotations

import time
from collections.abc import Sequence

from shellmb.observers.history import History
from shellmb.observers.probes import Probes
from shellmb.running.standard import StandardObservers
from shellmb.sensitivity.adjoint.backwards import Reading
from shellmb.sensitivity.adjoint.elementwise import changes
from shellmb.sensitivity.adjoint.places import Place, varying
from shellmb.sensitivity.adjoint.steps import Steps
from shellmb.sensitivity.adjoint.sweep import Sweep
from shellmb.sensitivity.parameters import beside, differentiated, parameters_of
from shellmb.sensitivity.shadow import Shadow
from shellmb.sensitivity.tangent import Pair, Tangents
from shellmb.simulate.simulation import Observer, Simulation

# mesh, steps, scheme, Newton's method, parameters, columns
CASES = (
    ((6, 2), 100, "ep", "full", ("thickness",), "probes"),
    ((6, 2), 200, "ep", "auto", ("thickness",), "probes"),
    ((6, 2), 200, "ep", "auto", ("thickness", "force"), "probes"),
    ((6, 2), 200, "ep", "auto", ("thickness",), "all"),
    ((6, 2), 200, "ep4", "auto", ("thickness",), "probes"),
    ((32, 32), 20, "ep", "auto", ("thickness",), "probes"),
    ((32, 32), 20, "ep", "full", ("thickness",), "probes"),
)
ROUNDS = 3
# mesh, steps, scheme, Newton's method of runs that go backwards
BACK = (
    ((6, 2), 100, "ep", "auto"),
    ((12, 8), 50, "ep", "auto"),
    ((12, 8), 20, "ed", "auto"),
    ((12, 8), 20, "ep4", "auto"),
    ((32, 32), 5, "ep", "auto"),
    ((32, 32), 5, "ep", "full"),
)


def observers(columns: str) -> list[Observer]:
    """Observers of a scene beside the run."""
    if columns == "all":
        named = StandardObservers(None).named.items()
        return [o for name, o in named if not name.startswith(("watch", "stop"))]
    probes = Probes()
    return [probes, History([probes])]


def seconds(
    mesh: tuple[int, int],
    steps: int,
    scheme: str,
    newton: str,
    names: Sequence[str],
    columns: str,
) -> float:
    """Processor time of the steps of a run with derivatives by some parameters, s."""
    made = differentiated(
        "sudden_load", None, mesh=mesh, scheme=scheme, newton=newton, t_end=steps * 1e-3
    )
    base = made.scene()

    def make(run: Simulation) -> list[Pair]:
        forces, made_pairs = columns == "all", []
        for p in parameters_of(made, names):
            above, below = (
                Shadow(Simulation(scene, like=run), observers(columns), forces)
                for scene in beside(made, base, p)
            )
            made_pairs.append(Pair(p, above, below))
        return made_pairs

    run = Simulation(base)
    every: list[Observer] = [*StandardObservers(None).named.values(), Tangents(make)]
    for observer in every if names else every[:-1]:
        observer.start(run)
    begin = time.process_time()
    while run.step < steps:
        run.advance(every if names else every[:-1])
    return time.process_time() - begin


def there_and_back(
    mesh: tuple[int, int], steps: int, scheme: str, newton: str
) -> tuple[float, float]:
    """Processor time of the steps of a run, and of the sweep backwards over them, s."""
    made = differentiated(
        "sudden_load", None, mesh=mesh, scheme=scheme, newton=newton, t_end=steps * 1e-3
    )
    place, kept = Place("plate", "thickness"), Steps()
    run = Simulation(varying(made.scene(), (place,)))
    every: list[Observer] = [*StandardObservers(None).named.values(), kept]
    for observer in every:
        observer.start(run)
    begin = time.process_time()
    while run.step < steps:
        run.advance(every)
    forth = time.process_time() - begin
    sweep = Sweep(run, [(place.body, changes(run.model.shells[place.body], place.name))], False)
    reading = Reading(run, run.scene.probes[0])
    begin = time.process_time()
    for step in kept.backwards(run):
        reading.add(sweep.covector, 1.0)
        sweep.back(step, *kept.times[step.number])
    return forth, time.process_time() - begin


def main() -> None:
    """Print a line for each case."""
    print("mesh   scheme newton columns  parameters        run [ms/step]  share per parameter")
    for mesh, steps, scheme, newton, names, columns in CASES:
        alone, beside_it = [], []
        for _ in range(ROUNDS):
            alone.append(seconds(mesh, steps, scheme, newton, (), columns))
            beside_it.append(seconds(mesh, steps, scheme, newton, names, columns))
        share = (min(beside_it) / min(alone) - 1) / len(names)
        print(
            f"{mesh[0]}x{mesh[1]:<4} {scheme:6} {newton:6} {columns:8} {','.join(names):17} "
            f"{1e3 * min(alone) / steps:13.3f}  {share:.2f}",
            flush=True,
        )
    print("mesh   scheme newton fields of the section  run [ms/step]  sweep over run")
    for mesh, steps, scheme, newton in BACK:
        forth, back = zip(
            *(there_and_back(mesh, steps, scheme, newton) for _ in range(ROUNDS)), strict=True
        )
        print(
            f"{mesh[0]}x{mesh[1]:<4} {scheme:6} {newton:6} {'thickness':22} "
            f"{1e3 * min(forth) / steps:13.3f}  {min(back) / min(forth):.2f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
