"""Schemes by their names: what a scene may have with each of them."""

from typing import Any, Protocol


class Scheme(Protocol):
    """A scheme object, as far as a scene knows it (`shellmb.schemes.base.Scheme`)."""

    @property
    def name(self) -> str: ...  # noqa: D102


# name -> whether it has velocities, and whether it has a state j just after the step's beginning
SCHEMES = {
    "static": (False, False),
    "linear-statics": (False, False),
    "linear-dynamics": (True, False),
    "ep": (True, False),
    "ed": (True, True),
    "ep4": (True, False),
    "ed3": (True, False),
    "generalized-alpha": (True, False),
    "ed-printed": (True, True),
}

# those of small displacements
LINEAR = ("linear-statics", "linear-dynamics")

# those that are quadratic in time
QUADRATIC = ("ep4", "ed3")

# those that keep the angular momentum exactly
KEEP_ANGULAR_MOMENTUM = ("ep",)

# those that take their dissipation from a scene's `alpha`, with its default: what the studies use,
# and of generalized-alpha a spectral radius of 0.8, as is usual
DISSIPATIVE = {"ed": 0.5, "ed3": 0.5, "generalized-alpha": 1 / 9, "ed-printed": 0.5}


def dissipation(scheme: Any, alpha: float | None) -> float:
    """The ``alpha`` that a scheme works with: the given one; None: the default of its name."""
    if alpha is not None:
        return alpha
    return DISSIPATIVE.get(scheme, 0.0) if isinstance(scheme, str) else 0.0


def is_static(scheme: Any) -> bool:
    """Decide whether a scheme, or that of a name, has no velocities."""
    if isinstance(scheme, str):
        return not SCHEMES.get(scheme, (True, True))[0]
    return not getattr(scheme, "dynamic", True)
