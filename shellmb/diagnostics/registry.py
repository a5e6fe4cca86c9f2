"""All watches. Every run has each of them."""

from shellmb.diagnostics.balances import Dissipation, Drift, EnergyLaw
from shellmb.diagnostics.base import Watch
from shellmb.diagnostics.damped_modes import DampedModes
from shellmb.diagnostics.elements.coarse import Coarse
from shellmb.diagnostics.elements.director_angles import Folded
from shellmb.diagnostics.elements.wrinkled import Wrinkled
from shellmb.diagnostics.forces.alternating import Alternating
from shellmb.diagnostics.forces.between import Between
from shellmb.diagnostics.forces.contacts import Contacts, TouchingFaces
from shellmb.diagnostics.forces.pointed import Pointed
from shellmb.diagnostics.forces.rolling import Lifting, Slipping
from shellmb.diagnostics.forces.undetermined import Undetermined
from shellmb.diagnostics.forces.unresolved import Unresolved
from shellmb.diagnostics.small_displacements import LinearBodies, ReducedBodies, SmallDisplacements
from shellmb.diagnostics.statics import LimitPoints, PathEnd, Unstable
from shellmb.diagnostics.step_error import StepErrors
from shellmb.diagnostics.turns import LargeTurns, StiffSpin

# what is nearest to the cause comes first
WATCHES: tuple[type[Watch], ...] = (
    SmallDisplacements,
    ReducedBodies,
    LinearBodies,
    DampedModes,
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
