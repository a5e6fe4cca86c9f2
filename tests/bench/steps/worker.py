"""Steps of one scene in a process of its own, round by round as it is told.

Another checkout's Python runs this file, too. So it knows scenes and the functions that users call,
and nothing that is within the package: a time function of the load, which every step asks for its
value, looks at the clock and waits at the ends of rounds.
"""

from __future__ import annotations

import json
import math
import os
import resource
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from mpi4py import MPI  # noqa: F401  (before dolfinx)

ROOT = Path(__file__).parents[3]
# scenes of the mechanisms are this checkout's in both processes; the package comes first
sys.path.append(str(ROOT))

import shellmb as sm  # noqa: E402
from shellmb.demos import sudden_load  # noqa: E402

# steps before those that are measured, at most, and of a run that nobody waits for the end of
WARM, MANY = 10, 5000


class Pace:
    """A factor of loads that is one, and tells the beginnings of steps.

    A run also asks for values before it begins, at times over all of it. These are farther apart
    than steps are: only calls in step after step from the first one on count. Each round ends once:
    a sweep backwards asks for all values again.

    Args:
        dt: Length of a step, s.
        ends: Steps before which a round ends, ascending.
        tell: Takes the time of each round, s.
    """

    def __init__(self, dt: float, ends: Sequence[int], tell: Callable[[float], None]) -> None:
        self._dt, self._ends, self._tell = dt, list(ends), tell
        self._step, self._begun = -1, 0.0

    def __call__(self, t: float) -> float:
        """The factor at a time; several are asked for in a step, some at its end."""
        # the end of a step is not yet the next one
        step = math.ceil(t / self._dt - 1e-6) - 1
        if step == self._step + 1:
            self._step = step
            if self._ends and step == self._ends[0]:
                self._ends.pop(0)
                self._tell(self.since())
                self._begun = time.process_time()
        elif step != self._step:
            self._step = 0 if step == 0 else -1
        return 1.0

    def since(self) -> float:
        """Processor time since the last round ended, s."""
        return time.process_time() - self._begun


def plate(mesh: tuple[int, int], pace: Pace, thickness: float = 2e-3) -> sm.Scene:
    """The strip of `sudden_load`, or a square, of some elements."""
    made = sudden_load.scene(thickness=thickness)
    length, width = sudden_load.LENGTH, sudden_load.WIDTH
    wide = length if 2 * mesh[1] > mesh[0] else width
    (shell,) = made.shells
    return replace(
        made,
        shells=replace(shell, surface=sm.Rectangle(length, wide), mesh=mesh),
        loads=sm.EdgeForce("right", (0, 0, 2.0 / width), time=pace),
        probes=sm.Probe("tip", (length, wide / 2, 0), component=2),
    )


def mechanism(name: str, pace: Pace) -> sm.Scene:
    """A mechanism of the comparison with other codes; its weight is in pace."""
    from tests.bench.peers.mechanisms.scenes import MECHANISMS

    made = MECHANISMS[name].scene()
    weights = [load for load in made.loads if isinstance(load, sm.Gravity)]
    others = [load for load in made.loads if load not in weights]
    return replace(made, loads=(*others, *(replace(load, time=pace) for load in weights)))


def work(case: dict[str, Any], tell: Callable[[float], None]) -> None:
    """Make all steps of a case.

    Args:
        case: `kind`, `name`, `scheme`, `dt`, `steps` of a round, and `rounds`.
        tell: Takes the time of each round, s; the first one is warm-up.
    """
    steps, rounds, kind = case["steps"], case["rounds"], case["kind"]
    warm = min(WARM, 2 * steps)
    pace = Pace(case["dt"], [warm + k * steps for k in range(rounds + 1)], tell)
    # what goes backwards has to come to its end
    last = warm + steps + 1 if kind == "adjoint" else MANY
    given = {"scheme": case["scheme"], "dt": case["dt"], "t_end": last * case["dt"]}

    def scene(thickness: float = 2e-3) -> sm.Scene:
        if kind == "mechanism":
            return mechanism(case["name"], pace)
        along, across = map(int, case["name"].split("x"))
        return plate((along, across), pace, thickness)

    runs: dict[str, Callable[[], object]] = {
        "gradient": lambda: sm.sensitivities(scene, ("thickness",), columns="probes", **given),
        "adjoint": lambda: sm.adjoint(
            scene, lambda history: history["tip"][-1], [("plate", "thickness")], **given
        ),
    }
    # files are written as by `shellmb run`, in a folder that goes
    runs.get(kind, lambda: sm.run(scene(), pictures=False, **given))()
    # the sweep backwards follows the last step, over all of them
    tell(pace.since() * steps / last)


def main() -> None:
    """Read a case and the descriptor that times go to from the command line."""
    with os.fdopen(int(sys.argv[2]), "w") as out:

        def tell(number: float) -> None:
            print(number, file=out, flush=True)
            if not sys.stdin.readline().strip():
                # enough: peak memory, MiB
                print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, file=out)
                out.flush()
                os._exit(0)

        work(json.loads(sys.argv[1]), tell)


if __name__ == "__main__":
    main()
