"""The schemes by name. Tests of order, energy, momenta and constraints run over this list."""

from collections.abc import Callable
from typing import Any, cast

from shellmb.errors import SceneError
from shellmb.scene.lookup import listed
from shellmb.scene.schemes import Scheme as Named
from shellmb.schemes.base import END, Scheme
from shellmb.schemes.ed import EnergyDecaying
from shellmb.schemes.ep import EnergyPreserving, LinearDynamics
from shellmb.schemes.quadratic import QuadraticInTime, energy_decaying_3
from shellmb.schemes.rivals import EnergyDecayingAsPrinted, GeneralizedAlpha
from shellmb.schemes.static import Linear, Static

SCHEMES: dict[str, Callable[[float], Scheme]] = {
    "static": lambda alpha: Static(),
    "linear-statics": lambda alpha: Linear(),
    "linear-dynamics": lambda alpha: LinearDynamics(),
    "ep": lambda alpha: EnergyPreserving(),
    "ed": lambda alpha: EnergyDecaying(alpha),
    "ep4": lambda alpha: QuadraticInTime(),
    "ed3": energy_decaying_3,
    # rivals, for comparison
    "generalized-alpha": GeneralizedAlpha,
    "ed-printed": EnergyDecayingAsPrinted,
}

# what a scheme with states in between must say itself
BETWEEN = ("moved", "prescribed", "load_weight")


def make_scheme(scheme: str | Named, alpha: float) -> Scheme:
    """The scheme of that name, or the scheme itself where it is given as an object.

    Args:
        scheme: Name or scheme.
        alpha: Dissipation, for schemes that have it.
    """
    if not isinstance(scheme, str):
        return completed(scheme)
    return SCHEMES[scheme](alpha)


def completed(scheme: Named) -> Scheme:
    """A scheme with the defaults of `Scheme` that it does not have.

    Args:
        scheme: The scheme, of a class that may be a user's.

    Raises:
        SceneError: If it has states in between and not what they need.
    """
    kind, whole = type(scheme), cast(Any, scheme)
    if not issubclass(kind, Scheme):
        whole = object.__new__(type(kind.__name__, (kind, Scheme), {}))
        # of classes with slots, too: these stand beside what is in no slot
        held: Any = object.__getstate__(scheme)
        for values in held if isinstance(held, tuple) else (held,):
            for name, value in (values or {}).items():
                object.__setattr__(whole, name, value)
    missing = [m for m in BETWEEN if getattr(type(whole), m) is getattr(Scheme, m)]
    if missing and (*whole.stages,) != (END,):
        raise SceneError(
            f"scheme '{whole.name}' has the unknown states {listed(whole.stages)}; it must also "
            f"define {listed(missing)}, whose defaults know '{END}' alone (as `schemes/ed.py` does)"
        )
    return cast(Scheme, whole)
