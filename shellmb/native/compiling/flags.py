"""Flags of the C compiler, each a measured choice (docs/theory/built.md)."""

import hashlib
import os
import platform
from collections.abc import Mapping, Sequence
from itertools import takewhile
from pathlib import Path
from typing import Any

from ufl import Form
from ufl.core.expr import Expr
from ufl.domain import extract_domains

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
        environment: May force the level, or the number of cells that a kernel takes at once.
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
            f"{', '.join(POSSIBLE_LANES)}, the cells that a kernel takes at once, or not be set"
        )
    return [f"-march=x86-64-{level}"] if level else [], int(lanes)


# Sums may be reordered and multiplications fused, so that the processor's vectors can be used:
# `-ffast-math` without its promise that nothing is ever infinite or NaN, which must be seen
_LEVEL, LANES = level_and_lanes(os.environ, features_here())
_COMMON = ["-g0", "-ffp-contract=fast", "-fno-math-errno", "-fassociative-math"]
_COMMON += ["-fno-signed-zeros", "-fno-trapping-math", *_LEVEL]

COMPILER_FLAGS = ["-O2", "-ftree-vectorize", *_COMMON, f"-DLANES={LANES}", "-Wno-psabi"]

# FFCx writes straight code in which -O2 finds nothing more than -O1 with vectors: kernels of shells
# are as fast, and compiled in 0.6 of the time (5.3 s instead of 8.9 for those of `sudden_load`).
# Its loops over the nodes of a cell are short: unrolled they take 0.85 of the time in residuals and
# 0.96 in Jacobians (docs/theory/built.md). Vectors outside loops cost gcc a tenth and gain nothing,
# registers chosen for each loop by itself as much, constants looked for in code that has none too
_STRAIGHT = ["-O1", "-fira-region=one", "-fno-tree-ccp", *_COMMON]
KERNEL_FLAGS = [*_STRAIGHT, "-ftree-loop-vectorize", "-funroll-loops"]
# Kernels of several cells are vectors as they are. Their code has a name, too, for the cache
_HERE = Path(__file__).parent
_OURS = "".join((_HERE / name).read_text() for name in ("language.py", "lanes.py", "lanes.h"))
LANES_FLAGS = [*_STRAIGHT, f"-DLANES={LANES}", "-Wno-psabi"]
LANES_FLAGS += [f"-DLANES_CODE=0x{hashlib.sha256(_OURS.encode()).hexdigest()[:12]}"]
# Jacobians are seldom called: what pointers point to matters less there than gcc's time
JACOBIAN_FLAGS = ["-fno-tree-pta"]
# Residuals are called in each iteration: of several cells at once they take 0.8 (EP, ED) and 0.9
# (EP4) of the time for a fifth more of gcc's
RESIDUAL_FLAGS = ["-O2"]


# A form; or an expression and the points of the reference element where it is wanted
Item = Form | tuple[Expr, Any]


def flags_for(item: Item, more: Sequence[str] = ()) -> list[str]:
    """Flags for a form, or for an expression and its points.

    Args:
        item: The form; or the expression and its points.
        more: Flags that come last; a kernel with such has one cell at a time.
    """
    own: list[str] = []
    many = False
    if isinstance(item, Form):
        # surfaces have many cells; joints, rigid bodies and most beams have few
        many = not more and extract_domains(item)[0].topological_dimension == 2
        own = {1: RESIDUAL_FLAGS if many else [], 2: JACOBIAN_FLAGS}.get(len(item.arguments()), [])
    return [*(LANES_FLAGS if many else KERNEL_FLAGS), *own, *more]


def has_lanes(flags: Sequence[str]) -> bool:
    """Decide whether a kernel with these flags is one of several cells."""
    return LANES_FLAGS[-1] in flags
