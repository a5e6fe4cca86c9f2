"""Peak memory of a configuration in a process of its own: `python -m shellmb.bench.memory JSON`."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path

from shellmb.bench.record import Configuration
from shellmb.errors import ShellmbError

STEPS = 2


def peak_mib(kind: str, scheme: str, mesh: tuple[int, int], how: Configuration) -> float:
    """Peak of the resident memory over set-up and some steps with all observers, MiB.

    Args:
        kind: "dynamic" or "static".
        scheme: Time scheme.
        mesh: Elements along and across.
        how: How to solve.

    Raises:
        ShellmbError: If the process fails.
    """
    asked = json.dumps([kind, scheme, list(mesh), how.path, how.newton])
    command = [sys.executable, "-m", "shellmb.bench.memory", asked]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        last = (done.stderr.strip().splitlines() or ["it said nothing"])[-1]
        raise ShellmbError(f"bench: the process that measures memory failed: {last}")
    return float(done.stdout.split()[-1])


def main(asked: str) -> None:
    """Run the configuration asked for, print the peak."""
    from shellmb.bench.runner import Runner
    from shellmb.bench.scenes import plate

    kind, scheme, mesh, path, newton = json.loads(asked)
    scene = plate(kind, scheme, (mesh[0], mesh[1]), Configuration(path, newton))
    with tempfile.TemporaryDirectory() as folder:
        runner = Runner(scene, Path(folder))
        runner.advance(STEPS)
        runner.finish()
        # not from `getrusage`, which begins with the size of the process that started this one
        lines = Path("/proc/self/status").read_text().splitlines()
    peak = next(line for line in lines if line.startswith("VmHWM"))
    print(int(peak.split()[1]) / 1024)


if __name__ == "__main__":
    main(sys.argv[1])
