"""Whole commands, start-up included, for the plate under a sudden load in three codes.

python -m tests.bench.peers.whole       # needs the extra `peers`; a minute

The settings are those that the table of `docs/evidence/beside_others.md` has as
the fastest for an error. `shellmb` runs from the command line, without pictures and with compiled
kernels; a peer's script imports the peer, builds its model and solves. What a peer's script needs
of this checkout (scene, tables) is imported before the clock starts, so times are in favour of
peers. A command's time is the least of several.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

from tests.bench.peers.codes import EXUDYN, OPENSEES, OURS

TIMES = 3
# for errors of 1, 0.25 and 0.1 %
COMMANDS = {
    OURS: (
        "--scheme ed3 --alpha 0.5 --mesh 8x1 --dt 0.02",
        "--scheme ed3 --alpha 0.5 --mesh 8x1 --dt 0.01",
        "--scheme ep4 --mesh 8x1 --dt 0.0078125",
    ),
    EXUDYN: (
        "ExudynPlate((8, 1), 2.5e-3, spectral_radius=0.9)",
        "ExudynPlate((12, 2), 1.25e-3, spectral_radius=1.0)",
        "ExudynPlate((16, 4), 1.25e-3, spectral_radius=0.9)",
    ),
    OPENSEES: (
        "OpenSeesPlate((6, 1), 1e-2, 'NLDKGQ', 'Newmark')",
        "OpenSeesPlate((8, 1), 5e-3, 'NLDKGQ', 'TRBDF2')",
        "OpenSeesPlate((16, 2), 2.5e-3, 'NLDKGQ', 'Newmark')",
    ),
}
# an interpreter's own start is counted, other modules of this checkout are not
SCRIPT = """
import sys, time
start = time.process_time()
import numpy
start -= time.process_time()
from tests.bench.peers.dynamics.exudyn_plate import ExudynPlate
from tests.bench.peers.dynamics.opensees_plate import OpenSeesPlate
before = time.process_time()
{call}.run()
print("processor seconds", time.process_time() - before - start)
"""


def command(code: str, settings: str) -> float:
    """Processor time of a command, s.

    Args:
        code: The code.
        settings: One of its settings in `COMMANDS`.
    """
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    if code != OURS:
        words = [sys.executable, "-c", SCRIPT.format(call=settings)]
        done = subprocess.run(words, env=environment, capture_output=True, text=True, check=True)
        return float(done.stdout.partition("processor seconds")[2].split()[0])
    shellmb = str(Path(sys.executable).parent / "shellmb")
    with tempfile.TemporaryDirectory() as folder:
        words = [shellmb, "run", "sudden_load", *settings.split(), "--no-pictures", "--quiet"]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([*words, "--out", f"{folder}/run"], env=environment, check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    """Measure all of them in turn, and print a table."""
    found = {
        (code, k): min(command(code, settings) for _ in range(TIMES))
        for code, rows in COMMANDS.items()
        for k, settings in enumerate(rows)
    }
    print("| error | " + " | ".join(COMMANDS) + " |\n| --- | --- | --- | --- |")
    for k, error in enumerate(("1 %", "0.25 %", "0.1 %")):
        print(f"| {error} | " + " | ".join(f"{found[code, k]:.2g} s" for code in COMMANDS) + " |")


if __name__ == "__main__":
    main()
