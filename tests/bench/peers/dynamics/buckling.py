"""Section 6.1 of the paper in each code: what is run."""

from __future__ import annotations

from tests.bench.peers.codes import EXUDYN, OURS
from tests.bench.peers.dynamics.exudyn_buckling import ExudynBuckling
from tests.bench.peers.dynamics.motion import Runs, Study
from tests.bench.peers.dynamics.our_buckling import OurBuckling


def _ours() -> Runs:
    meshes, steps = ((6, 2), (8, 2), (12, 2), (12, 4)), (8e-3, 4e-3, 2e-3)
    schemes = (("ep", 0.0), ("ed", 1.0), ("ep4", 0.0), ("ed3", 0.5))
    return Runs(
        (OurBuckling((24, 8), 1e-3, "ep4", 0.0), OurBuckling((16, 4), 1e-3, "ep4", 0.0)),
        [OurBuckling(m, dt, *how) for m in meshes for dt in steps for how in schemes],
    )


def _exudyn() -> Runs:
    meshes, steps = ((6, 2), (8, 2), (12, 2), (12, 4), (16, 4)), (1e-3, 5e-4, 2.5e-4)
    return Runs(
        (ExudynBuckling((24, 8), 2.5e-4), ExudynBuckling((16, 4), 2.5e-4)),
        [ExudynBuckling(m, dt, r) for m in meshes for dt in steps for r in (0.9, 0.6)],
    )


STUDY = Study(
    "buckling",
    "section 6.1 without its reinforced edge, bowed by 0.1 mm, 0.08 s: sideways at mid-span",
    {OURS: _ours(), EXUDYN: _exudyn()},
    {
        OURS: Runs((OurBuckling((4, 2), 4e-3),), [OurBuckling((2, 2), 8e-3)]),
        EXUDYN: Runs((ExudynBuckling((4, 2), 1e-3),), [ExudynBuckling((2, 2), 1e-3)]),
    },
    # converged answers move by a third of a percent from mesh to mesh
    (1e-2,),
)
