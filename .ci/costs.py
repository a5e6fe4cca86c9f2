"""What scenes cost: unknowns, seconds and GiB; the tables of docs/evidence/costs.md.

    python .ci/costs.py            # the tables anew: some minutes
    python .ci/costs.py 16x16 100  # these cases only, printed

Each case runs in a process of its own with one thread. Times are processor times with compiled
forms in the cache: set-up is everything before the first step, a step is the median of those behind
the first.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import time
from itertools import pairwise
from pathlib import Path
from statistics import median
from typing import Any

from shellmb import scene as s
from shellmb.demos.verification.measuring import replaced
from shellmb.simulate.simulation import BaseObserver, Simulation

PAGE = Path(__file__).resolve().parents[1] / "docs" / "evidence" / "costs.md"
MESHES = ("6x2", "16x16", "32x32", "64x64", "128x128")
BODIES = ("10", "100", "1000")
STEPS = 4


def plate(mesh: str) -> s.Scene:
    """A square steel plate, clamped at one side, under a sudden load."""
    steel = s.Isotropic(E=210e9, nu=0.3, thickness=5e-3, density=7850.0)
    nx, ny = map(int, mesh.split("x"))
    return s.Scene(
        mesh,
        s.Shell("plate", s.Rectangle(1.0, 1.0), steel, mesh=(nx, ny)),
        supports=s.Clamped("left"),
        loads=s.EdgeForce("right", (0, 0, 500.0)),
        scheme="ep4",
        dt=2e-3,
        t_end=STEPS * 2e-3,
    )


def chain(count: str) -> s.Scene:
    """A chain of rigid bars that falls from the horizontal."""
    n = int(count)
    bars = [
        s.RigidBody(f"bar {k}", 1.0, (1e-3, 0.02, 0.02), position=(0.5 * k + 0.25, 0, 0))
        for k in range(n)
    ]
    names = [s.GROUND, *(bar.name for bar in bars)]
    joints = [
        s.Revolute(f"joint {k}", names[k], names[k + 1], at=(0.5 * k, 0, 0), axis=(0, 1, 0))
        for k in range(n)
    ]
    return s.Scene(
        count,
        rigid_bodies=bars,
        joints=joints,
        loads=s.Gravity(),
        scheme="ep4",
        dt=2e-3,
        t_end=STEPS * 2e-3,
    )


class Times(BaseObserver):
    """Processor times at the ends of steps."""

    def __init__(self) -> None:
        self.at: list[float] = []

    def accepted(self, simulation: Simulation) -> None:
        """Note the time."""
        self.at.append(time.process_time())


def measure(case: str) -> dict[str, Any]:
    """Run a case in this process."""
    begin = time.process_time()
    simulation = Simulation(plate(case) if "x" in case else chain(case))
    times, built = Times(), time.process_time()
    simulation.run([times])
    at = [built, *times.at]
    return {
        "unknowns": simulation.problem.system.size,
        "setup_s": built - begin,
        "step_s": median(b - a for a, b in pairwise(at[1:])),
        "gib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20,
    }


def row(case: str) -> str:
    """A row of the table, from a process of its own."""
    command = [sys.executable, __file__, "--measure", case]
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    done = subprocess.run(command, check=True, env=environment, capture_output=True, text=True)
    found = json.loads(done.stdout.splitlines()[-1])
    cells = (
        case,
        f"{found['unknowns']}",
        f"{found['setup_s']:.2g}",
        f"{found['step_s']:.2g}",
        f"{found['gib']:.2g}",
    )
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Measure, and print or write."""
    if sys.argv[1:2] == ["--measure"]:
        print(json.dumps(measure(sys.argv[2])))
        return
    if sys.argv[1:]:
        print("\n".join(map(row, sys.argv[1:])))
        return
    text = PAGE.read_text()
    for name, cases in (("plates", MESHES), ("chains", BODIES)):
        head = f"| {'mesh' if name == 'plates' else 'bodies'} | unknowns | set-up [s] | step [s] |"
        lines = [f"{head} GiB |", "| ---: | ---: | ---: | ---: | ---: |", *map(row, cases)]
        marks = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
        text = replaced(text, *marks, "\n".join(lines))
    PAGE.write_text(text)


if __name__ == "__main__":
    main()
