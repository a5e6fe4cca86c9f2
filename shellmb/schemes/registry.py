"""The schemes by name. Tests of order, energy, momenta and constraints run over this list."""

from collections.abc import Callable

from shellmb.errors import SceneError
from shellmb.schemes.base import Scheme
from shellmb.schemes.ed import EnergyDecaying
from shellmb.schemes.ep import EnergyPreserving
from shellmb.schemes.quadratic import QuadraticInTime, energy_decaying_3
from shellmb.schemes.rivals.ed_printed import EnergyDecayingAsPrinted
from shellmb.schemes.rivals.generalized_alpha import GeneralizedAlpha
from shellmb.schemes.static import Linear, Static

SCHEMES: dict[str, Callable[[float], Scheme]] = {
    "static": lambda alpha: Static(),
    "linear": lambda alpha: Linear(),
    "ep": lambda alpha: EnergyPreserving(),
    "ed": lambda alpha: EnergyDecaying(alpha),
    "ep4": lambda alpha: QuadraticInTime(),
    "ed3": energy_decaying_3,
    # rivals, for comparison
    "generalized-alpha": GeneralizedAlpha,
    "ed-printed": EnergyDecayingAsPrinted,
}


def make_scheme(scheme: str | Scheme, alpha: float) -> Scheme:
    """The scheme of that name, or the scheme itself where it is given as an object.

    Args:
        scheme: Name or scheme.
        alpha: Dissipation, for schemes that have it.

    Raises:
        SceneError: If there is no scheme of that name.
    """
    if not isinstance(scheme, str):
        return scheme
    if scheme not in SCHEMES:
        raise SceneError(f"scheme is '{scheme}'; it must be one of {', '.join(SCHEMES)}")
    return SCHEMES[scheme](alpha)
