"""Displacements that are taken as small are not: of all bodies, or of some about their frames."""

from typing import Any

import numpy as np

from shellmb.arrays import Floats
from shellmb.diagnostics.base import STIFFENED, Cautions, RunWarning, Watch, said_of
from shellmb.model.body import strain_energy
from shellmb.observers.account.energy import present
from shellmb.observers.fields.modal import ModalState
from shellmb.observers.fields.nodal import nodal_bodies
from shellmb.preprocessing.modal.isolated import lowest_frequency
from shellmb.preprocessing.modal.stretched import Parts, stiffening
from shellmb.preprocessing.modal.tangent import GeometricStiffness, bending_scale
from shellmb.scene.checks.schemes import SMALL_ANGLE
from shellmb.scene.schemes import SIMPLEST
from shellmb.simulate.simulation import Simulation
from shellmb.system.assembly.functionals import functionals

# energy of bending below this share of all of it is round-off
STRAIGHT = 1e-12
# lowest frequency of a beam with one end clamped, over sqrt(D/(m L^4))
CANTILEVER = 3.516
# In statics what does not bend may still be about to buckle: from this part of the buckling load of
# a cantilever on, a sixteenth of that with two ends clamped
COMPRESSED = 0.5


class SmallDisplacements(Watch):
    """Watches the directors of all bodies where forms are linearised."""

    name = "small displacements"
    remembered = ("_largest",)

    def start(self, simulation: Simulation) -> None:
        """See whether forms are linearised."""
        self.idle = not simulation.scheme.linear

    def accepted(self, simulation: Simulation) -> None:
        """Take the rotations of the step."""
        for body in nodal_bodies(simulation.model).values():
            change = simulation.problem.state(body.name).x.array[body.mixed.dofs["w"]]
            size = float(np.sqrt(np.max(np.sum(change.reshape(-1, 3) ** 2, axis=1), initial=0.0)))
            self._note(body.name, size, simulation.t)

    def cautions(self, simulation: Simulation) -> Cautions:
        """A sentence for each body that turns too far; collective."""
        if not simulation.scheme.linear:
            return
        for body in nodal_bodies(simulation.model).values():
            largest, when = self._worst(simulation, body.name)
            if largest > SMALL_ANGLE:
                rigid = body is simulation.model.rigid
                name = None if rigid else body.name
                says = (
                    f"{said_of(simulation, body.name)} {'turn' if rigid else 'turns'} by "
                    f"{largest:.2g} rad, at t = {when:g}; with scheme "
                    f"'{simulation.scheme.name}' displacements are small, up to {SMALL_ANGLE:g} "
                    "rad: its results are of the size of the square of that off; use --scheme "
                    f"{SIMPLEST if simulation.scheme.dynamic else 'static'}"
                )
                yield self.caution(name, largest, SMALL_ANGLE, says)


class _AboutFrames(Watch):
    """Watches bodies whose displacements are small about a frame: what these do not know.

    That is how far directors turn there, and stiffness by forces that act already: what forces
    along the body would do on squares of rotations, beside its energy of bending. In a body that
    spins at a rate `w` fibres under tension are stiffer, and what is off the axis is drawn
    outwards: by about `m w^2` either way, beside the stiffness `m w_1^2` of the lowest mode.
    """

    # what is said of such a body, and who does not know of forces
    name, said, blind = "", "", ""
    remembered = ("_largest",)

    # kinds of numbers that are noted with the name of the body: largest rotation about the frame on
    # this rank [rad], largest spin [rad/s], energy that is left out, energy of bending and strain
    # energy [J], and compression in statics, over what buckles a cantilever
    def _begin(self) -> None:
        # the state with the largest energy since the run went on, with that and the energy of
        # stretching if edges did not follow [J]
        self._shapes: dict[str, tuple[float, float, Floats]] = {}

    @staticmethod
    def _counted(simulation: Simulation) -> bool:
        """Decide whether unstable directions are counted."""
        return not (simulation.scheme.dynamic or simulation.scheme.linear)

    def _spins(self, name: str, d: Floats, rates: Floats, t: float) -> None:
        """Note the rate at which a frame turns, where that is no vibration.

        A body that vibrates has rates of its mean rotation, too: as large as its frequency times
        the angle, while what they do to its stiffness is of the size of the square of that angle.
        So a rate counts from where the frame has turned farther than what is small.

        Args:
            name: Name of the body.
            d: Directors of its frame, as rows, shape (3, 3); at the reference the unit matrix.
            rates: Their rates, 1/s.
            t: Time, s.
        """
        turned = np.linalg.norm(np.cross(np.eye(3), d).sum(axis=0) / 2)
        if turned > SMALL_ANGLE or np.trace(d) < 1:
            spin = float(np.linalg.norm(np.cross(d, rates).sum(axis=0) / 2))
            self._note(f"spins {name}", spin, t)

    def _parts(self, simulation: Simulation, name: str, shape: Floats) -> Parts:
        """Displacements and resultants of a state of a body, relative to its frame."""
        raise NotImplementedError

    def _energies(self, name: str, found: Floats, energy: float, shape: Floats, t: float) -> None:
        """Note what is left out, the energy of stretching, the strain energy and its state."""
        left, stretching, squares = map(float, found)
        sizes = {"left out": left, "bending": energy - stretching, "energy": energy}
        for kind, size in sizes.items():
            self._note(f"{kind} {name}", size, t)
        if energy > self._shapes.get(name, (0.0,))[0]:
            self._shapes[name] = energy, squares, np.array(shape)

    def _bent(self, simulation: Simulation, name: str) -> Cautions:
        """Cautions of a body that bends too far, or by forces along it; collective."""
        turn, when = self._worst(simulation, f"turns {name}")
        if turn > SMALL_ANGLE:
            says = (
                f"{said_of(simulation, name)} {self.said} and turns by {turn:.2g} rad relative to "
                f"its frame, at t = {when:g}; rotations there are small, up to {SMALL_ANGLE:g} "
                "rad: its results are of the size of the square of that off; use model='exact'"
            )
            yield self.caution(name, turn, SMALL_ANGLE, says)
        left, when = self._worst(simulation, f"left out {name}")
        energy, _ = self._worst(simulation, f"energy {name}")
        bending = max(self._worst(simulation, f"bending {name}")[0], STRAIGHT * energy)
        if left > STIFFENED * bending:
            how = (
                f"forces along it would do {left:.2g} J on squares of its rotations, at "
                f"t = {when:g}, {left / bending:.1%} of its largest energy of bending: they would "
                "change its stiffness by about as much"
            )
            yield self._stiffer(simulation, name, left / bending, how)
        elif (share := self._worst(simulation, f"compression {name}")[0]) > COMPRESSED:
            how = (
                f"forces along it reach {share:.2g} of what buckles it with one end clamped: they "
                "would soften it, also where unstable directions are counted"
            )
            yield self._stiffer(simulation, name, share, how)
        share, when = self._stretched(simulation, name)
        if share > STIFFENED:
            how = (
                "squares of its displacements would make it stiffer by about "
                f"{share:.1%}, at t = {when:g}, as they stretch it between its supports or where "
                "it bends in two directions"
            )
            yield self._stiffer(simulation, name, share, how)

    def _stiffer(self, simulation: Simulation, name: str, share: float, how: str) -> RunWarning:
        """That a body's stiffness is off by a share, which small strains do not know."""
        who = f"{said_of(simulation, name)} {self.said}"
        says = f"{who} and {how}, and {self.blind} not know that; use model='exact'"
        return self.caution(name, share, STIFFENED, says)

    def _stretched(self, simulation: Simulation, name: str) -> tuple[float, float]:
        """By what share a body is stiffer as it is stretched, and when; collective."""
        energy, when = self._worst(simulation, f"energy {name}")
        here, squares, shape = self._shapes.get(name, (0.0, 0.0, np.zeros(0)))
        # of a run that went on the largest state may be an earlier one
        if 2 * squares * energy <= STIFFENED * here**2:
            return 0.0, when
        size = np.sqrt(energy / here)
        parts = {
            member: {part: size * values for part, values in found.items()}
            for member, found in self._parts(simulation, name, shape).items()
        }
        return stiffening(simulation.scene, simulation.model.comm, parts), when

    def _spun(self, simulation: Simulation, name: str, lowest: float, of: str) -> Cautions:
        """The caution of a body that spins too fast; collective."""
        spin, when = self._worst(simulation, f"spins {name}")
        share = (spin / lowest) ** 2
        if share > STIFFENED:
            how = (
                f"spins at {spin:.3g} rad/s, at t = {when:g}, {spin / lowest:.2g} of its lowest "
                f"frequency {of}, {lowest:.3g} rad/s: centrifugal forces would change its "
                f"stiffness by about {share:.0%}"
            )
            yield self._stiffer(simulation, name, share, how)


class ReducedBodies(_AboutFrames):
    """Watches bodies in modes."""

    name, said, blind = "reduced bodies", "is reduced to modes", "its modes do"

    def start(self, simulation: Simulation) -> None:
        """Find the bodies, how much each mode turns their directors at most, and its forces."""
        self._bodies: list[tuple[Any, ...]] = []
        for data in simulation.model.modal:
            most = np.sqrt(np.max(np.sum(data.slopes**2, axis=1), axis=0, initial=0.0))
            forces = [(GeometricStiffness(m.body), m.states) for m in data.members.values()]
            self._bodies.append((data, ModalState(simulation.model, data), most, forces))
        self.idle = not self._bodies

    def _parts(self, simulation: Simulation, name: str, shape: Floats) -> Parts:
        (data,) = (data for data in simulation.model.modal if data.name == name)
        found = {}
        for member, kept in data.members.items():
            dofs, state = kept.body.mixed.dofs, kept.states @ shape
            found[member] = {part: state[where] for part, where in dofs.items()}
        return found

    def accepted(self, simulation: Simulation) -> None:
        """Take the step."""
        t = simulation.t
        for data, state, most, forces in self._bodies:
            frame, eta = state.now(simulation)
            found = [force.of(states @ eta) for force, states in forces]
            energy = float(data.stiffness @ eta**2) / 2
            self._energies(data.name, np.sum(found, axis=0), energy, eta, t)
            for force, states in forces if self._counted(simulation) else ():
                self._note(f"compression {data.name}", force.compression(states @ eta), t)
            turns = f"turns {data.name}"
            # only what may be larger is looked at node by node
            if float(np.abs(eta) @ most) > max(self._noted(turns)[0], SMALL_ANGLE):
                turned = np.sum((data.slopes @ eta) ** 2, axis=1)
                self._note(turns, float(np.sqrt(np.max(turned, initial=0.0))), t)
            if "v" in simulation.scheme.rates:
                d = np.eye(3) + frame[3:].reshape(3, 3)
                rates = state.now(simulation, "v")[0][3:].reshape(3, 3)
                self._spins(data.name, d, rates, t)

    def cautions(self, simulation: Simulation) -> Cautions:
        """A sentence for each body that bends, is pressed or spins too much; collective."""
        for data in simulation.model.modal:
            yield from self._bent(simulation, data.name)
            yield from self._spun(simulation, data.name, data.clamped, "with one joint fixed")


class LinearBodies(_AboutFrames):
    """Watches bodies with linear strains, which know no more than modes do."""

    name, said, blind = "linear bodies", "has linear strains", "linear strains do"

    def start(self, simulation: Simulation) -> None:
        """Find the bodies and their directors."""
        self._bodies: list[tuple[Any, ...]] = []
        for body in simulation.model.meshed.values():
            if body.ties:
                form = strain_energy(body, simulation.problem.state(body.name))
                energy = functionals([present([form])], simulation.model.comm)
                self._bodies.append((body, body.node_directors(), GeometricStiffness(body), energy))
        self.idle = not self._bodies

    def _parts(self, simulation: Simulation, name: str, shape: Floats) -> Parts:
        body = simulation.model.meshed[name]
        back = (np.eye(3) + body.ties[0].changes(shape)).T
        parts = {part: shape[where] for part, where in body.mixed.dofs.items()}
        X, D = body.mixed.nodes("u"), body.node_directors()
        parts["u"] = ((X + parts["u"].reshape(-1, 3)) @ back - X).ravel()
        parts["w"] = ((D + parts["w"].reshape(D.shape)) @ back - D).ravel()
        return {name: parts}

    def accepted(self, simulation: Simulation) -> None:
        """Take the step."""
        t = simulation.t
        for body, D, left, energy in self._bodies:
            levels, (tie,) = simulation.problem.levels[body.name], body.ties
            q = levels.q.x.array
            change = tie.changes(q)
            d = np.eye(3) + change
            self._energies(body.name, left.of(q, d), float(energy()[0]), q, t)
            if self._counted(simulation):
                self._note(f"compression {body.name}", left.compression(q), t)
            lean = q[body.mixed.dofs["w"]].reshape(D.shape) - D @ change
            size = float(np.sqrt(np.max(np.sum(lean**2, axis=2), initial=0.0)))
            self._note(f"turns {body.name}", size, t)
            if "v" in levels.rates:
                self._spins(body.name, d, tie.changes(levels.rates["v"].x.array), t)

    def cautions(self, simulation: Simulation) -> Cautions:
        """A sentence for each body that bends, is pressed or spins too much; collective."""
        for body, *_ in self._bodies:
            yield from self._bent(simulation, body.name)
            spin, _ = self._worst(simulation, f"spins {body.name}")
            # a cantilever of its length is softer than it is
            slow = CANTILEVER * np.sqrt(bending_scale(body))
            if (spin / slow) ** 2 > STIFFENED:
                lowest = lowest_frequency(simulation.model, body.name)
                yield from self._spun(simulation, body.name, lowest, "by itself")
