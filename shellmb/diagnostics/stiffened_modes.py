"""Modes about a loaded state tell of bodies with small strains, which forces do not stiffen."""

from collections.abc import Sequence

import numpy as np

from shellmb.arrays import Floats
from shellmb.diagnostics.base import STIFFENED, Motion, Parts
from shellmb.model.frames.beam import BeamModel
from shellmb.model.model import Model
from shellmb.model.reduced.data import ModalBody
from shellmb.model.shells.shell import ShellModel
from shellmb.observers.fields.modal import ModalState
from shellmb.preprocessing.modal.geometric_stiffness import GeometricStiffness


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
