"""The schemes by name. Tests of order, energy, momenta and constraints run over this list."""

import inspect
from collections.abc import Callable, Sequence
from dataclasses import fields
from functools import wraps
from typing import Any, cast

import numpy as np
from dolfinx import fem

from shellmb.errors import SceneError, ShellmbError
from shellmb.model.user_forms import place_of
from shellmb.scene.lookup import listed
from shellmb.scene.schemes import OwnScheme
from shellmb.scene.schemes import Scheme as Given
from shellmb.scene.values.validate import in_words, show
from shellmb.schemes.base import END, Levels, Named, Scheme, Stage, Tangent, Values
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
# functions that a user's scheme may have
FUNCTIONS = (*BETWEEN, "expand", "advance", "jump", "first_guess", "resultants", "dissipation")


def make_scheme(scheme: str | Given, alpha: float) -> Scheme:
    """The scheme of that name, or the scheme itself where it is given as an object.

    Args:
        scheme: Name or scheme.
        alpha: Dissipation, for schemes that have it.
    """
    if not isinstance(scheme, str):
        return completed(scheme)
    return SCHEMES[scheme](alpha)


def completed(scheme: Given) -> Scheme:
    """A scheme with the defaults of `Scheme` that it does not have.

    Args:
        scheme: The scheme, of a class that may be a user's.

    Raises:
        SceneError: If it lacks a member, or has states in between and not what they need.
    """
    kind: Any = type(scheme)
    bundled = {name: type(make(1.0)) for name, make in SCHEMES.items()}
    if kind in bundled.values():
        return cast(Scheme, scheme)
    if not issubclass(kind, bundled.get(scheme.name, kind)):
        raise SceneError(
            f"scheme '{scheme.name}': a bundled scheme has this name; it must have another one"
        )
    members = ((f.name, getattr(scheme, f.name, None)) for f in fields(OwnScheme))
    OwnScheme(**{key: value for key, value in members if value is not None})
    if not issubclass(kind, Scheme):
        kind = type(kind.__name__, (kind, Scheme), {})
    ours = [getattr(one, name) for one in (Scheme, *bundled.values()) for name in FUNCTIONS]
    own = {name: inspect.getattr_static(kind, name) for name in FUNCTIONS}
    told = {n: _told(n, of) for n, of in own.items() if inspect.isfunction(of) and of not in ours}
    kind = type(kind.__name__, (kind,), told)
    whole: Any = object.__new__(type(kind.__name__, (_Checked, kind), {}))
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


def _told(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """A user's function of a scheme, whose errors name the scheme and it."""

    @wraps(function)
    def told(self: Any, *args: Any, **named: Any) -> Any:
        try:
            return function(self, *args, **named)
        except ShellmbError:
            raise
        except (Exception, SystemExit) as error:
            raise SceneError(
                f"{place_of(function, error)}scheme '{self.name}': {name} fails "
                f"({in_words(error)}); it must be as `shellmb.schemes.base.Scheme.{name}`"
            ) from error

    return told


class _Checked(Scheme):
    """A user's scheme that refuses what its own functions return where it is something else."""

    def expand(self, levels: Levels, dt: fem.Constant) -> dict[str, Stage]:
        """Stages, one for each name, with velocities and their rates if there are any."""
        found = super().expand(levels, dt)

        needed = ("span", "rate", "velocity") if self.dynamic else ("span",)

        def full(stage: Any) -> bool:
            return None not in [getattr(stage, name, None) for name in needed]

        right = "a Stage, with rate and velocity where there are velocities,"
        return self._whole("expand", found, self.stages, full, right)

    def advance(
        self, q: Values, rates: Named, unknown: Named, dt: float, tangent: Tangent
    ) -> dict[str, Values]:
        """Rates at the end of the step, an array for each name."""
        found, shape = super().advance(q, rates, unknown, dt, tangent), np.shape(q)
        right = f"an array of the shape of q, {shape},"
        return self._whole("advance", found, self.rates, lambda v: np.shape(v) == shape, right)

    def _whole(
        self, who: str, found: Any, names: Sequence[str], good: Callable[[Any], bool], right: str
    ) -> Any:
        wrong = not isinstance(found, dict) or set(found) != set(names)
        if wrong or not all(map(good, found.values())):
            raise SceneError(
                f"scheme '{self.name}': {who} returns {show(found)}; it must return a dict with "
                f"{right} for each of {listed(names)}"
            )
        return found
