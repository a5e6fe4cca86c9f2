"""Peak memory of a configuration in a process of its own: `python -m tests.bench.memory JSON`."""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path

from tests.bench.record import Configuration
from tests.bench.steps.process import last_line

STEPS = 2


def peak_mib(kind: str, scheme: str, mesh: tuple[int, int], how: Configuration) -> float:
    """Peak of the resident memory over set-up and some steps with all observers, MiB.

    Raises:
        ShellmbError: If the process fails.
    """
    asked = json.dumps([kind, scheme, list(mesh), how.path, how.newton])
    return float(last_line("the process that measures memory", "tests.bench.memory", asked))


def main(asked: str) -> None:
    """Run the configuration asked for, print the peak."""
    from tests.bench.runner import Runner
    from tests.bench.scenes import plate

    kind, scheme, mesh, path, newton = json.loads(asked)
    scene = plate(kind, scheme, (mesh[0], mesh[1]), Configuration(path, newton))
    with tempfile.TemporaryDirectory() as folder:
        runner = Runner(scene, Path(folder))
        runner.advance(STEPS)
        runner.stepping.finish()
        # not from `getrusage`, which begins with the size of the process that started this one
        lines = Path("/proc/self/status").read_text().splitlines()
    peak = next(line for line in lines if line.startswith("VmHWM"))
    print(int(peak.split()[1]) / 1024)


if __name__ == "__main__":
    main(sys.argv[1])
