"""Section 6.1 of the paper, without its reinforced edge, in shellmb."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

from shellmb.demos import lateral_buckling as demo
from shellmb.scene import Scene
from tests.bench.peers.dynamics.history import TipHistory
from tests.bench.peers.dynamics.our_motion import OurMotion

# sideways, and as in the bundled study of 6.1, m and s
BOW, T_END = 1e-4, 0.08


@cache
def scene() -> Scene:
    """The demo's, its link at the plate itself.

    The beam along the free edge is left out: no beam of Exudyn shares nodes with a plate, and that
    with slopes along its axis only, which could be tied to them, has no torsion.
    """
    base = demo.scene(imperfection=BOW, t_end=T_END)
    joints = tuple(
        replace(joint, second="plate") if joint.name == "corner" else joint for joint in base.joints
    )
    return replace(base, beams=(), glues=(), joints=joints, probes=())


@dataclass(frozen=True)
class OurBuckling(OurMotion):
    """Settings of the solution."""

    def run(self) -> TipHistory:
        """Solve; set-up and compilation are not timed."""
        return self.solve(scene(), (demo.LENGTH / 2, BOW, demo.MIDDLE), 1)
