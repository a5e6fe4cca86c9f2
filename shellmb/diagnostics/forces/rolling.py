"""Joints that roll: one pulls where a real wheel or blade would lift off, or slips."""

import numpy as np

from shellmb.diagnostics.base import Cautions, Watch
from shellmb.model.massless import gathered
from shellmb.simulate.simulation import Simulation

# part of the largest pressure of a run; the mean of two steps is looked at, since forces of EP
# alternate
PULL = 1e-3
# part of the speeds that it is the difference of: with 0.1 rad in a step it is 4e-3 in EP
SLIP = 2e-2


class Lifting(Watch):
    """Watches the normal forces of rolling and knife-edge joints."""

    name = "lifting"
    remembered = ("_last", "_press", "_largest")

    def _begin(self) -> None:
        self._last: dict[str, float] = {}
        # the largest pressure
        self._press: dict[str, float] = {}

    def start(self, simulation: Simulation) -> None:
        """Find the joints."""
        self._groups = simulation.model.mechanism.contacts
        self.idle = not self._groups

    def accepted(self, simulation: Simulation) -> None:
        """Take the forces of the step."""
        for group in self._groups:
            q = simulation.problem.levels[group.name].q.x.array
            forces = gathered(group.nodes, group.sliding(q, 0 * q)[:, 4])
            for name, force in zip(group.labels, forces.tolist(), strict=True):
                mean = (force + self._last.get(name, force)) / 2
                self._last[name] = force
                self._press[name] = max(self._press.get(name, 0.0), abs(mean))
                self._note(name, -mean, simulation.t)

    def cautions(self, simulation: Simulation) -> Cautions:
        """The contacts that pull."""
        for name, (pull, when) in self._largest.items():
            share = pull / self._press[name]
            if share > PULL:
                bound = simulation.model.mechanism.joints[name]
                says = (
                    f"{bound.joint.said} pulls at '{bound.joint.second}' by up to {pull:.3g} N (at "
                    f"t = {when:.4g} s): it would lift off, and the joint holds it down; load it "
                    "more, or move it more slowly"
                )
                yield self.caution(bound.joint.second, share, PULL, says)


class Slipping(Watch):
    """Looks at the end of a run at the slip of contacts, which EP leaves."""

    name = "slipping"

    def cautions(self, simulation: Simulation) -> Cautions:
        """The contacts that slip by more than that."""
        for group in simulation.model.mechanism.contacts:
            levels = simulation.problem.levels[group.name]
            slips = group.sliding(levels.q.x.array, levels.rates["v"].x.array)
            shares = slips[:, 0] / np.maximum(slips[:, 1], 1e-300)
            mine = [(int(k), float(s)) for k, s in zip(group.nodes.item, shares, strict=True)]
            for item, share in sorted(
                {p for part in group.nodes.mesh.comm.allgather(mine) for p in part}
            ):
                if share > SLIP:
                    joint = group.joints[item].joint
                    says = (
                        f"{joint.said} slips by {share:.1%} of its speeds at the end of the run: "
                        "use --scheme ep4, --scheme ed3 or a smaller step"
                    )
                    yield self.caution(joint.second, share, SLIP, says)
