"""Natural modes tell of elements that lock where a thin curved body bends."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from shellmb.arrays import Floats
from shellmb.diagnostics.elements.locking import (
    BOUND,
    PRONE,
    Roughness,
    excess,
    places,
    why,
)
from shellmb.model.model import Model


def locked_modes(
    model: Model, modes: Sequence[tuple[int, float, Callable[[str], Floats]]], state: Directors
) -> list[str]:
    """Sentences on bodies in whose modes elements lock; collective.

    Args:
        model: The bodies.
        modes: Number of each elastic mode, its strain energy, and its parts by names of bodies.
        state: Changes of the directors that modes are about, shape (n, 3), by names of bodies;
            None: none.
    """
    said = []
    for name, body in model.shells.items():
        mesh = places(body)
        if mesh is None:
            continue
        d = body.node_directors()[:, 0]
        if mesh.proneness(d if state is None else d + state(name)) < PRONE:
            continue
        roughness, found = Roughness(body), []
        for number, energy, part in modes:
            share = model.comm.allreduce(roughness.energy(part(name))) / energy
            found.append((excess(body, share), share, number))
        (worst, share, most), numbers = (
            max(found),
            [n for e, _, n in found if e.value > BOUND],
        )
        if numbers:
            # squares of frequencies are in proportion to stiffness
            high = worst._replace(value=float(np.sqrt(1 + worst.value)) - 1)
            which = f"the frequency of mode {most} is too high"
            if len(numbers) > 1:
                listed = ", ".join(map(str, numbers))
                which = f"frequencies of modes {listed} are too high, that of {most} most of all"
            stiff = f"shell '{name}' is too stiff in bending; {why(body, share)}"
            said.append(f"{which}, by {high.said}: {stiff}")
    return said


type Directors = Callable[[str], Floats] | None
