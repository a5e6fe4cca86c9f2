"""Errors of discretisation from companions of a run, and how much of an observed order to believe.

*Step.* A quantity differs by `d1` from the one with twice the step, and this by `d2` from the one
with four times it. If errors go with `h^p`,

    p = log2(d2/d1),      error = F d1/(2^p - 1)

(P. J. Roache, J. Fluids Eng. 116 (1994) 405-413, with the factor of safety F). Under sudden loads
orders of large steps are those of no other, so of orders above 1 half an order less is believed (or
1), and one half at least. A difference that is smaller, by chance, than the order of the scheme
allows is taken as large as that.

*Mesh.* Coarser meshes come close to the right answer by chance, and their orders are not those of
finer ones (clamped corners). The difference of elements of degree 2 from those of degree 3 on the
same mesh needs no order: it is the error but for that of degree 3, and a factor covers it. Where
places of the scene are no nodes of the other degree, twice the elements take its part.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, log2

# factor of safety of the extrapolation, what is taken off an observed order, the least believed
SAFETY, CAUTION, LOWEST = 1.25, 0.5, 0.5
# error of a mesh over its difference from a better one, of first order at least
BETTER = 2.0


@dataclass(frozen=True)
class Estimate:
    """An error that is estimated, in the unit of the quantity.

    Args:
        error: Its size; infinite where nothing can be said.
        order: The observed order; None where there is none.
    """

    error: float
    order: float | None = None


NONE, UNKNOWN = Estimate(0.0), Estimate(inf)


def step_error(differences: Sequence[float], highest: float) -> Estimate:
    """Error of the step of a run.

    Args:
        differences: Of the run from the one with twice the step, of this from the one with four
            times it; the second one may be missing.
        highest: Order of the scheme.

    Returns:
        The estimate. With one difference, the order is taken as 1; where differences grow as steps
        become smaller, the larger one is the error.
    """
    if not differences:
        return UNKNOWN
    fine = differences[0]
    coarse = differences[1] if len(differences) > 1 else 0.0
    if coarse == 0.0:
        return Estimate(SAFETY * fine)
    fine = max(fine, coarse / 2**highest)
    order = log2(coarse / fine)
    if order <= 0:
        return Estimate(SAFETY * fine, order)
    believed = max(order - CAUTION, min(order, 1.0), LOWEST)
    return Estimate(SAFETY * fine / (2**believed - 1), order)


def mesh_error(difference: float | None, better: bool) -> Estimate:
    """Error of the mesh of a run.

    Args:
        difference: Of its companion with other elements; None: not known.
        better: Whether the companion's elements are the better ones.
    """
    if difference is None:
        return UNKNOWN
    return Estimate(BETTER * difference if better else difference)
