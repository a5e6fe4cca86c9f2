"""Bodies that are too stiff or too soft in their modes: by model, state, damping, and elements."""

from collections.abc import Callable, Sequence

import numpy as np

from shellmb.arrays import Floats
from shellmb.diagnostics.base import STIFFENED, Cautions, Motion, Parts, Watch, said_of
from shellmb.diagnostics.elements.coarse import Signs
from shellmb.diagnostics.elements.finer import BOUND, REMEDY, beyond, by_others
from shellmb.diagnostics.elements.wrinkled import wrinkled_modes
from shellmb.model.frames.beam import BeamModel
from shellmb.model.model import Model
from shellmb.model.reduced.data import ModalBody
from shellmb.model.shells.shell import ShellModel
from shellmb.observers.fields.modal import ModalState
from shellmb.preprocessing.modal.tangent import GeometricStiffness
from shellmb.scene import Scene
from shellmb.simulate.simulation import Simulation

# shares of an impact, and of the energy that was exchanged by it
SUDDEN, NOTHING = 0.1, 1e-6
# part of a frequency that loads change at most where it is compared without them
CHANGED = 0.2


class _Linear:
    """A body with linear strains.

    Args:
        body: The body.
        state: The state.
    """

    said = "has linear strains"

    def __init__(self, body: ShellModel | BeamModel, state: Parts) -> None:
        self.name, self._tie = body.name, body.ties[0]
        self._force, self._u = GeometricStiffness(body), body.mixed.dofs["u"]
        self._q = state(body.name)
        self._places = body.mixed.nodes("u") + self._q[self._u].reshape(-1, 3)
        self._back = np.eye(3) + self._tie.changes(self._q).T

    def left_out(self, mode: Parts) -> float:
        """Energy that forces along it do on squares of a mode's rotations, J; collective."""
        values, both = mode(self.name), self._q.copy()
        # of positions `y` as seen from the frame, `y R^T` in rows, the change
        moved = values[self._u].reshape(-1, 3) @ self._back
        both[self._u] = (moved + self._places @ self._tie.changes(values).T).reshape(self._u.shape)
        return float(self._force.of(both)[0])


class _Reduced:
    """A body in modes.

    Args:
        model: The model.
        data: The body.
        state: The state.
    """

    said = "is reduced to modes"

    def __init__(self, model: Model, data: ModalBody, state: Parts) -> None:
        self.name, self._nodes = data.name, ModalState(model, data)
        self._members = [
            (GeometricStiffness(kept.body), kept.body.mixed.dofs["u"], kept.states)
            for kept in data.members.values()
        ]
        self._at = self._amplitudes(state)

    def _amplitudes(self, values: Parts) -> Floats:
        return self._nodes.read(values(self._nodes.rigid), values(self._nodes.modes.name))[1]

    def left_out(self, mode: Parts) -> float:
        """Energy that forces along it do on squares of a mode's rotations, J; collective."""
        amplitudes, energy = self._amplitudes(mode), 0.0
        for force, u, states in self._members:
            both = states @ self._at
            both[u] = states[u] @ amplitudes
            energy += float(force.of(both)[0])
        return energy


def stiffened_modes(model: Model, state: Parts | None, modes: Sequence[Motion]) -> list[str]:
    """Sentences on bodies whose forces would change frequencies, which small strains leave out.

    Args:
        model: The bodies.
        state: The loaded state that modes are about; None: the reference, which has no forces.
        modes: The elastic modes.
    """
    if state is None or not modes:
        return []
    bodies: list[_Linear | _Reduced] = [_Linear(b, state) for b in model.meshed.values() if b.ties]
    bodies += [_Reduced(model, data, state) for data in model.modal]
    said = []
    for body in bodies:
        shares = [
            (sum(map(body.left_out, mode.parts)) / mode.energy, mode.number) for mode in modes
        ]
        (worst, most), numbers = max(shares), [n for share, n in shares if share > STIFFENED]
        if numbers:
            which = "of mode" if len(numbers) == 1 else f"of mode {most} most of all, of modes"
            said.append(
                f"'{body.name}' {body.said}, which do not know that forces along it stiffen or "
                f"soften it: squares of frequencies would change by about {worst:.1%}, {which} "
                f"{', '.join(map(str, numbers))}; use model='exact'"
            )
    return said


def beside_better(
    model: Model,
    modes: Sequence[Motion],
    unknowns: int,
    values: Floats,
    better: Callable[[Scene], Floats],
    what: str,
    loaded: bool = False,
) -> list[str]:
    """Sentences on modes that are not those of better elements; collective.

    Args:
        model: The model.
        modes: Its modes about the reference.
        unknowns: Number of unknowns.
        values: What is compared of all modes, frequencies or load factors.
        better: Gives the same of a scene, without loads.
        what: What it is called.
        loaded: Whether loads act on the modes, which better elements are compared without; where
            these change a frequency much, nothing is known of it.
    """
    # those of bodies in modes without loads may be singular
    if (loaded and model.modal) or not any(_doubtful(model, name, modes) for name in model.shells):
        return []
    here = better(model.scene) if loaded else values
    # eigenproblems cost more than linear responses
    if not (found := by_others(model.scene, 2 * unknowns, better)):
        return []
    others, how = found
    count = min(len(here), *map(len, others))
    first, *rest = (each[:count] for each in (here, *others))
    parts = np.abs(first / rest[0] - 1) if len(rest) == 1 else beyond(first, *rest)
    bare = np.abs(here - values) < CHANGED * np.abs(values)
    off = {n: parts[n - 1] for n, *_ in modes if n <= len(parts) and bare[n - 1]}
    far = [n for n in off if off[n] > BOUND]
    if not far:
        return []
    most = max(far, key=lambda n: off[n])
    which = f"mode {most} is off in its {what}"
    if len(far) > 1:
        listed = ", ".join(map(str, far))
        which = f"modes {listed} are off in their {what}, mode {most} most of all"
    named = ", ".join(f"shell '{name}'" for name in model.shells)
    return [f"{which}, by about {100 * off[most]:.0f} %, beside {how}; {named}: {REMEDY}"]


def _doubtful(model: Model, name: str, modes: Sequence[Motion]) -> bool:
    signs = Signs(model, name)
    shapes = ((part(name), energy) for _, energy, (part, *_) in modes)
    return any(signs.doubtful(q, 0 * q, energy) for q, energy in shapes)


SECTIONS = stiffened_modes, wrinkled_modes


class DampedModes(Watch):
    """Watches what bodies in modes do not relax by.

    What strains of one kind resist by their rates the full body shifts to others; its modes cannot.
    """

    name = "damped modes"
    remembered = ("_largest",)

    def start(self, simulation: Simulation) -> None:
        """Find the bodies."""
        model = simulation.model
        damped = [d for d in model.modal if d.relaxing is not None and d.relaxing.any()]
        rates = "v" in simulation.scheme.rates
        self._bodies = [(data, ModalState(model, data)) for data in damped] if rates else []
        self.idle = not self._bodies

    def accepted(self, simulation: Simulation) -> None:
        """Take the step."""
        for data, state in self._bodies:
            eta, rate = state.now(simulation)[1], state.now(simulation, "v")[1]
            assert data.damping is not None
            assert data.relaxing is not None
            products = [data.stiffness @ eta**2, data.stiffness @ rate**2]
            products += [rate @ matrix @ rate for matrix in (data.damping, data.relaxing)]
            # the largest of each, and when
            before, when = self._largest.get(data.name, (np.zeros(4), 0.0))
            if products[3] > before[3]:
                when = simulation.t
            self._largest[data.name] = np.maximum(before, products).tolist(), when

    def cautions(self, simulation: Simulation) -> Cautions:
        """A sentence for each body that resists otherwise than its modes do."""
        for name, (products, when) in self._largest.items():
            share = _share(*products)
            if share > STIFFENED:
                says = (
                    f"{said_of(simulation, name)} is reduced to modes, and its strains have "
                    "several times of damping: it would relax in shapes that no mode has, and "
                    f"what it resists with is off by about {share:.1%}, at t = {when:g}; use one "
                    "time for all strains, or model='floating-frame'"
                )
                yield self.caution(name, share, STIFFENED, says)


def _share(energy: float, fast: float, damped: float, relaxing: float) -> float:
    """By what share of its size the dynamic stiffness `K + i w D` of modes is off.

    Slowly, `w D` being small beside the stiffness of what relaxes, that is by `w^2 D K^-1 D`, and
    fast by no more than `w D`, when nothing but the modes would resist.

    Args:
        energy: Amplitudes times stiffness times amplitudes; the largest, J.
        fast: The same of the rates: over the first it is the square of `w`.
        damped: Of rates with damping, W.
        relaxing: Of rates with what relaxes, J.
    """
    if not relaxing > 0 or not energy > 0:
        return 0.0
    slow, quick = relaxing / energy, damped / float(np.sqrt(fast * energy))
    return float(slow * quick / (slow + quick) / (1 + quick))


class Impacts(Watch):
    """Watches which part of impacts bodies in modes take, where a lock or joint begins to act.

    What is at the joint stops at once, of an exact body the less the finer its elements are; waves
    stop the rest. Modes are shapes of all of a body, and stop as such. What each body takes of an
    impact is the kinetic energy of the change of its velocities.
    """

    name = "impacts on modes"
    remembered = ("_largest",)

    def start(self, simulation: Simulation) -> None:
        """Find the bodies, and what begins to act."""
        model = simulation.model
        self._switched = model.mechanism.switches.items
        self._bodies = {data.name: ModalState(model, data) for data in model.modal}
        self.idle = not self._bodies or not self._switched or not simulation.scheme.dynamic
        if not self.idle:
            self.accepted(simulation)

    def accepted(self, simulation: Simulation) -> None:
        """Take velocities, which an impact may change."""
        self._before = {name: each.now(simulation, "v") for name, each in self._bodies.items()}
        self._acting = [item.acting for item in self._switched]

    def switched(self, simulation: Simulation) -> None:
        """Take the impact."""
        energies, rigid = self.sources.energy, simulation.model.rigid
        loss = energies.values["dissipation"] - self.sources.history.rows[-1]["dissipation"]
        if rigid is None or self.idle or not loss > NOTHING * energies.exchanged:
            return
        begun = [
            item.group.labels[k]
            for item, on in zip(self._switched, self._acting, strict=True)
            for k in np.flatnonzero(item.acting & ~on)
        ]
        for name, state in self._bodies.items():
            then, now = self._before[name], state.now(simulation, "v")
            (x, *d), eta = (now[0] - then[0]).reshape(4, 3), now[1] - then[1]
            data, body = state.modes.data, rigid.bodies[rigid.index[name]]
            euler = np.trace(body.inertia_tensor) / 2 * np.eye(3) - body.inertia_tensor
            energy = body.mass * (x @ x) + np.sum(euler * (np.array(d) @ np.transpose(d)))
            energy += eta**2 @ (data.stiffness / data.omega2)
            self._note(name, float(energy / 2 / loss), simulation.t, ", ".join(begun))

    def cautions(self, simulation: Simulation) -> Cautions:
        """A sentence for each body that takes more than a part of an impact."""
        for name, (share, when, what) in self._largest.items():
            if share > SUDDEN:
                says = (
                    f"{said_of(simulation, name)} is reduced to modes and takes {share:.0%} of the "
                    f"impact at t = {when:.4g} s ({what}): its modes stop as a whole, where waves "
                    "stop an exact body, and of impulses and the energy that is lost up to this "
                    "part is too much; read means of forces and impulses over a period of the "
                    "body, which are right, or use more modes or model='exact'"
                )
                yield self.caution(name, share, SUDDEN, says)
