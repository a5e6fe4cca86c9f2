"""Flags of the C compiler, each a measured choice (docs/theory/built.md)."""

import platform
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ufl import Form
from ufl.core.expr import Expr


def _compiler_flags() -> list[str]:
    """Flags that let the loops of kernels use the processor's vectors: twice as fast.

    What matters is that sums may be reordered and multiplications fused (`-ffast-math` without its
    promise that nothing is ever infinite or NaN: those must be seen). A level that the processor
    has is named, and not `native`, so that another machine with the same cache compiles anew.
    """
    flags = ["-g0", "-ffp-contract=fast", "-fno-math-errno", "-fassociative-math"]
    flags += ["-fno-signed-zeros", "-fno-trapping-math"]
    processor = Path("/proc/cpuinfo")
    if platform.machine() == "x86_64" and processor.exists():
        features = next((x for x in processor.read_text().split("\n") if x.startswith("flags")), "")
        if {"avx2", "fma", "bmi2", "movbe"} <= set(features.split()):
            flags.append("-march=x86-64-v3")
    return flags


COMPILER_FLAGS = ["-O2", "-ftree-vectorize", *_compiler_flags()]

# FFCx writes straight code in which -O2 finds nothing more than -O1 with vectors: kernels of shells
# are as fast, and compiled in 0.6 of the time (5.3 s instead of 8.9 for those of `sudden_load`).
# Its loops over the nodes of a cell are short: unrolled they take 0.85 of the time in residuals and
# 0.96 in Jacobians (docs/theory/built.md). Vectors outside loops cost gcc a tenth and gain nothing,
# registers chosen for each loop by itself as much, constants looked for in code that has none too
KERNEL_FLAGS = ["-O1", "-ftree-loop-vectorize", "-funroll-loops", "-fira-region=one"]
KERNEL_FLAGS += ["-fno-tree-ccp", *_compiler_flags()]
# Jacobians are seldom called: what pointers point to matters less there than gcc's time
JACOBIAN_FLAGS = ["-fno-tree-pta"]


def flags_for(item: Form | tuple[Expr, Any], more: Sequence[str] = ()) -> list[str]:
    """Flags for a form, or for an expression and its points.

    Args:
        item: The form; or the expression and its points.
        more: Flags that come last.
    """
    jacobian = isinstance(item, Form) and len(item.arguments()) == 2
    return [*KERNEL_FLAGS, *(JACOBIAN_FLAGS if jacobian else []), *more]
