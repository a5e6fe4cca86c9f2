"""The residual at given unknowns by one call of `unknowns.c`, where one process has all of them."""

from petsc4py import PETSc

import numpy as np

from shellmb.native import library as native
from shellmb.native.library import CArrays
from shellmb.system.assembly.blocks import BlockSystem
from shellmb.system.assembly.dependent_functions import Following
from shellmb.system.assembly.loops import LoopResiduals


class FusedResidual:
    """The parts of `BlockSystem.evaluate` in one call.

    Args:
        system: The system.
        residuals: What assembles its residuals.

    Attributes:
        evaluation: For C, what it knows.
    """

    def __init__(self, system: BlockSystem, residuals: LoopResiduals) -> None:
        self._lib, pointer, n = native.cells().lib, CArrays(), system.numbering
        assert isinstance(system.follow, Following)
        self.evaluation = pointer.many(
            "Evaluation",
            [
                {
                    "fields": len(system.arrays),
                    "ends": pointer(n.offsets[1:].astype(np.int64)),
                    "arrays": pointer.many("double *", list(map(pointer, system.arrays))),
                    "local": len(n.local_to_global),
                    "wanted": pointer(system.exchange.wanted),
                    **system.follow.members,
                    "sums": pointer(np.zeros(len(n.local_to_global))),
                    "owned": n.owned,
                    "meshes": residuals.struct,
                    "held": len(system.fixed),
                    "fixed": pointer(system.fixed),
                    "values": pointer(system.values),
                    "reactions": pointer(system.reactions),
                }
            ],
        )
        # what it points to
        self._kept = pointer, system.follow, residuals

    def __call__(self, x: PETSc.Vec, b: PETSc.Vec) -> None:
        """Residual `b` at the unknowns `x`, which the fields take."""
        self._lib.evaluate(self.evaluation, x.handle, b.handle)
