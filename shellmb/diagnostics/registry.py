"""All watches. Every run has each of them."""

from shellmb.diagnostics.balances import Dissipation, Drift, EnergyLaw
from shellmb.diagnostics.base import Watch
from shellmb.diagnostics.contacts import Between, Contacts, Lifting, Slipping, TouchingFaces
from shellmb.diagnostics.elements.coarse import Coarse
from shellmb.diagnostics.elements.director_angles import Folded
from shellmb.diagnostics.elements.wrinkled import Wrinkled
from shellmb.diagnostics.modal_terms import ModalTerms
from shellmb.diagnostics.modes import DampedModes, Impacts
from shellmb.diagnostics.small_displacements import LinearBodies, ReducedBodies, SmallDisplacements
from shellmb.diagnostics.statics import LimitPoints, PathEnd, Unstable
from shellmb.diagnostics.steps import LargeTurns, StepErrors, StiffSpin, Unresolved
from shellmb.diagnostics.unknown_forces import Alternating, Pointed, Undetermined

# what is nearest to the cause comes first
WATCHES: tuple[type[Watch], ...] = (
    SmallDisplacements,
    ReducedBodies,
    LinearBodies,
    DampedModes,
    Impacts,
    ModalTerms,
    LargeTurns,
    Folded,
    Coarse,
    Wrinkled,
    Unstable,
    PathEnd,
    LimitPoints,
    StepErrors,
    StiffSpin,
    Undetermined,
    Lifting,
    Slipping,
    Contacts,
    Between,
    Unresolved,
    TouchingFaces,
    Pointed,
    Alternating,
    Drift,
    Dissipation,
    EnergyLaw,
)
