"""Schemes by their names: what a scene may have with each of them."""

from collections.abc import Callable
from typing import Annotated, Any, Literal, NamedTuple, Protocol

from pydantic import Field

from shellmb.scene.types import Name
from shellmb.scene.values.validate import Sentences, described

type Law = Literal["energy", "momentum", "angular momentum"]


class Scheme(Protocol):
    """A scheme object, as far as a scene knows it (`shellmb.schemes.base.Scheme`)."""

    @property
    def name(self) -> str: ...  # noqa: D102


@described("scheme")
class OwnScheme:
    """Members that each scheme object must have (`shellmb.schemes.base.Scheme`), to be checked."""

    name: Name
    title: str
    order: Annotated[int, Field(ge=0)]
    dynamic: bool
    stages: tuple[Name, ...]
    rates: tuple[Name, ...]
    conserves: frozenset[Law] | set[Law] | tuple[Law, ...]
    expand: Callable[..., Any]
    advance: Callable[..., Any]
    accelerations: tuple[Name, ...] = ()

    def _wrong(self) -> Sentences:
        if "f" not in self.stages:
            yield "stages", "one of them must be 'f', the state at the end of the step"
        if (self.dynamic and "v" not in self.rates) or "q" in self.rates:
            yield "rates", "one of them must be 'v', the velocities, and none 'q'"
        if not set(self.accelerations) <= set(self.rates) - {"v"}:
            yield "accelerations", "it must be names of rates other than 'v'"


class Traits(NamedTuple):
    """Traits of a scheme that others than the schemes themselves have to know.

    Args:
        dynamic: Whether it has velocities.
        jump: Whether it has a state j just after the step's beginning.
        alpha: Default of the dissipation that a scene's ``alpha`` sets; None: it takes none.
        ours: Whether it is one of the paper, or ours beyond it, for large displacements.
        quadratic: Whether it is quadratic in time.
        keeps_angular_momentum: Whether it keeps the angular momentum exactly.
        work: About how many times the work of the simplest one a step is.
    """

    dynamic: bool = True
    jump: bool = False
    alpha: float | None = None
    ours: bool = False
    quadratic: bool = False
    keeps_angular_momentum: bool = False
    work: int = 1


# defaults of alpha: what the studies use, and of generalized-alpha a spectral radius of 0.8, as is
# usual
SCHEMES = {
    "static": Traits(dynamic=False),
    "linear-statics": Traits(dynamic=False),
    "linear-dynamics": Traits(),
    "ep": Traits(ours=True, keeps_angular_momentum=True),
    "ed": Traits(jump=True, alpha=0.5, ours=True, work=3),
    "ep4": Traits(ours=True, quadratic=True, work=4),
    "ed3": Traits(alpha=0.5, ours=True, quadratic=True, work=4),
    "generalized-alpha": Traits(alpha=1 / 9),
    "ed-printed": Traits(jump=True, alpha=0.5, work=3),
}

# the simplest one for motions: taken where any of them will do
SIMPLEST = "ep"
# those of small displacements
LINEAR = ("linear-statics", "linear-dynamics")
OURS = tuple(name for name, traits in SCHEMES.items() if traits.ours)
# those in whose steps shells can touch
COMPLETE = ("static", *OURS)
# those that are taken backwards for derivatives, as a user's own are
REVERSIBLE = (*COMPLETE, "generalized-alpha")
# those that have dissipation, with its default
DISSIPATIVE = {n: traits.alpha for n, traits in SCHEMES.items() if traits.alpha is not None}


def dissipation(scheme: Any, alpha: float | None) -> float:
    """The ``alpha`` that a scheme works with: the given one; None: the default of its name."""
    if alpha is not None:
        return alpha
    return DISSIPATIVE.get(scheme, 0.0) if isinstance(scheme, str) else 0.0


def is_static(scheme: Any) -> bool:
    """Decide whether a scheme, or that of a name, has no velocities."""
    if isinstance(scheme, str):
        return not SCHEMES.get(scheme, Traits()).dynamic
    return not getattr(scheme, "dynamic", True)
