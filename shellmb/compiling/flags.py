"""Flags of the C compiler, each a measured choice (docs/theory/built.md)."""

import hashlib
import platform
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ufl import Form
from ufl.core.expr import Expr
from ufl.domain import extract_domains

# Levels of processors, what they have beyond the one before, and numbers in a vector
LEVELS = (
    ("v3", {"avx2", "fma", "bmi2", "movbe"}, 4),
    ("v4", {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"}, 8),
)


def _level() -> tuple[list[str], int]:
    """The flag for this processor's level, and how many numbers its vectors have.

    A level is named, and not `native`, so that another machine with the same cache compiles anew.
    """
    flags: list[str] = []
    numbers, processor = 2, Path("/proc/cpuinfo")
    if platform.machine() == "x86_64" and processor.exists():
        features = next((x for x in processor.read_text().split("\n") if x.startswith("flags")), "")
        for level, needed, width in LEVELS:
            if not needed <= set(features.split()):
                break
            flags, numbers = [f"-march=x86-64-{level}"], width
    return flags, numbers


# Sums may be reordered and multiplications fused, so that the processor's vectors can be used:
# `-ffast-math` without its promise that nothing is ever infinite or NaN, which must be seen
_LEVEL, LANES = _level()
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
_OURS = "".join((_HERE / f"lanes.{end}").read_text() for end in ("py", "h"))
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
    """Whether a kernel with these flags is one of several cells."""
    return LANES_FLAGS[-1] in flags
