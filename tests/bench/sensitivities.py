"""What derivatives cost: steps of the plate of README with and without them.

`python -m tests.bench.sensitivities`. Processor time of steps, set-up excluded, the shortest of
several rounds in turn.
"""

from __future__ import annotations

import time
from collections.abc import Sequence

from shellmb.observers.history import History
from shellmb.observers.probes import Probes
from shellmb.running.standard import StandardObservers
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


def observers(columns: str) -> list[Observer]:
    """What looks at a scene beside the run."""
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
                Shadow(Simulation(scene, like=run.model), observers(columns), forces)
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


if __name__ == "__main__":
    main()
