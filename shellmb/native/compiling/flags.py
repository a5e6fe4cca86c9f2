"""Flags of the C compiler, each a measured choice (docs/theory/built.md)."""

import os
import platform
from collections.abc import Mapping
from itertools import takewhile
from pathlib import Path

from shellmb.errors import RunError

# Levels of x86-64: what each has beyond the one before, as Linux calls it, and numbers in a vector
LEVELS: dict[str, tuple[set[str], int]] = {
    "v2": ({"cx16", "lahf_lm", "pni", "popcnt", "sse4_1", "sse4_2", "ssse3"}, 2),
    "v3": ({"abm", "avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "movbe", "xsave"}, 4),
    "v4": ({"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"}, 8),
}
FORCED_LEVEL, FORCED_LANES = "SHELLMB_KERNEL_LEVEL", "SHELLMB_KERNEL_LANES"
POSSIBLE_LANES = ("1", "2", "4", "8")


def features_here() -> set[str]:
    """Features of this processor by Linux; none if it is not an x86-64."""
    processor = Path("/proc/cpuinfo")
    if platform.machine() != "x86_64" or not processor.exists():
        return set()
    lines = processor.read_text().split("\n")
    return set(next((x for x in lines if x.startswith("flags")), "").split())


def runnable(features: set[str]) -> list[str]:
    """Levels that a processor can run, the lowest first.

    Args:
        features: Of the processor.
    """
    return list(takewhile(lambda level: LEVELS[level][0] <= features, LEVELS))


def level_and_lanes(environment: Mapping[str, str], features: set[str]) -> tuple[list[str], int]:
    """The flag for a level of processors, and how many numbers its vectors have.

    A level is named, and not `native`, so that another machine with the same cache compiles anew.

    Args:
        environment: May force the level, or the number of cells that are taken at once.
        features: Of the processor, which chooses what is not forced.

    Raises:
        RunError: If what is forced does not exist, or the processor cannot run it.
    """
    runs = runnable(features)
    level = environment.get(FORCED_LEVEL, "") or (runs[-1] if runs else "")
    if level and level not in LEVELS:
        raise RunError(
            f"the environment variable {FORCED_LEVEL} is '{level}': it must be "
            f"{', '.join(LEVELS)}, a level of x86-64, or not be set"
        )
    if level and level not in runs:
        can = f"only up to {runs[-1]}" if runs else "none of the levels of x86-64 that have names"
        raise RunError(
            f"the environment variable {FORCED_LEVEL} is '{level}', whose instructions this "
            f"processor has not: it runs {can}"
        )
    lanes = environment.get(FORCED_LANES, "") or str(LEVELS[level][1] if level else 2)
    if lanes not in POSSIBLE_LANES:
        raise RunError(
            f"the environment variable {FORCED_LANES} is '{lanes}': it must be "
            f"{', '.join(POSSIBLE_LANES)}, the cells that are taken at once, or not be set"
        )
    return [f"-march=x86-64-{level}"] if level else [], int(lanes)


# Sums may be reordered and multiplications fused, so that the processor's vectors can be used:
# `-ffast-math` without its promise that nothing is ever infinite or NaN, which must be seen
_LEVEL, LANES = level_and_lanes(os.environ, features_here())
COMPILER_FLAGS = ["-O2", "-ftree-vectorize", "-g0", "-ffp-contract=fast", "-fno-math-errno"]
COMPILER_FLAGS += ["-fassociative-math", "-fno-signed-zeros", "-fno-trapping-math", *_LEVEL]
COMPILER_FLAGS += [f"-DLANES={LANES}", "-Wno-psabi"]
