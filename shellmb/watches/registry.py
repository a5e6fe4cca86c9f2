"""All watches. Every run has each of them."""

from __future__ import annotations

from collections.abc import Sequence

from shellmb.observers.summary import Sources
from shellmb.simulate.simulation import Simulation
from shellmb.watches.base import Caution, Watch
from shellmb.watches.damped_modes import DampedModes
from shellmb.watches.dissipation import Dissipation
from shellmb.watches.drift import Drift
from shellmb.watches.elements.folded import Folded
from shellmb.watches.elements.locked import Locked
from shellmb.watches.energy_law import EnergyLaw
from shellmb.watches.forces.alternating import Alternating
from shellmb.watches.forces.contacts import Contacts
from shellmb.watches.forces.rolling import Lifting, Slipping
from shellmb.watches.forces.undetermined import Undetermined
from shellmb.watches.large_turns import LargeTurns
from shellmb.watches.small_displacements import LinearBodies, ReducedBodies, SmallDisplacements
from shellmb.watches.statics.stability import Unstable
from shellmb.watches.step_error import StepErrors
from shellmb.watches.stiff_spin import StiffSpin

# what is nearest to the cause comes first
WATCHES: tuple[type[Watch], ...] = (
    SmallDisplacements,
    ReducedBodies,
    LinearBodies,
    DampedModes,
    LargeTurns,
    Folded,
    Locked,
    Unstable,
    StepErrors,
    StiffSpin,
    Undetermined,
    Lifting,
    Slipping,
    Contacts,
    Alternating,
    Drift,
    Dissipation,
    EnergyLaw,
)


def watches(sources: Sources) -> list[Watch]:
    """One of each.

    Args:
        sources: The observers of the run.
    """
    return [kind(sources) for kind in WATCHES]


def cautions(watching: Sequence[Watch], simulation: Simulation) -> list[Caution]:
    """What they have to say.

    Args:
        watching: The watches of a run.
        simulation: The simulation, at its end.
    """
    return [caution for watch in watching for caution in watch.cautions(simulation)]
