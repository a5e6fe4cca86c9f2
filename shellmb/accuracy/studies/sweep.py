"""Runs of a study: a full grid of choices, and a chain of finer ones for its reference."""

import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from math import prod
from typing import Any

from shellmb.accuracy.studies.choice import AXES, REFINED, Base, Choice
from shellmb.accuracy.studies.quantity import Quantity, parse_quantity
from shellmb.errors import SceneError
from shellmb.options.described import read
from shellmb.options.run import StudyOptions
from shellmb.running.loader import SceneModule
from shellmb.scene.schemes import SCHEMES, Traits

# schemes of references, the best first
PREFERRED = ("ep4", "ed")


@dataclass(frozen=True)
class Sweep(StudyOptions):
    """A study as it is requested; an empty axis keeps the scene's choice.

    Args:
        base: The scene.
        quantities: What is judged; none: see `default_quantity`.
        solution: A solution that is not ours, of the columns that are judged, with its `source` in
            words, its relative `uncertainty`, and its record by `take` of a quantity; None: as for
            `exact`.
        dissipations: Those of single schemes in place of `alpha`.

    Raises:
        SceneError: If a number is not possible.
    """

    base: Base
    quantities: tuple[Quantity, ...] = ()
    solution: Any = None
    dissipations: Mapping[str, tuple[float, ...]] = field(default_factory=dict)

    @property
    def known(self) -> bool:
        """Decide whether no run of ours is the reference."""
        return self.exact is not None or self.solution is not None

    def runs(self, chosen: Mapping[str, Any]) -> bool:
        """Decide whether a combination is not left out by `dissipations`."""
        only = self.dissipations.get(chosen.get("scheme", ""))
        return only is None or chosen.get("alpha") in only

    def __post_init__(self) -> None:
        """Check the numbers that no scene checks."""
        for name, least in (("repeat", 1), ("refine", 2)):
            if getattr(self, name) < least:
                raise SceneError(
                    f"study: {name} is {getattr(self, name)}; it must be at least {least}"
                )
        if self.exact is not None and (len(self.quantities) != 1 or self.quantities[0].is_curve):
            raise SceneError(
                f"study: exact is {self.exact:g}; it must be left out, or be the value of the one "
                "quantity that is named, which must be a number"
            )


def sweep_of(
    scene: str | SceneModule,
    parameters: Mapping[str, str],
    quantity: Iterable[str] = (),
    t_end: float | None = None,
    body: str | None = None,
    **options: Any,
) -> Sweep:
    """The study that options request.

    Args:
        scene: Name of a scene or its file, or what defines it.
        parameters: Values of parameters of a scene that is named.
        quantity: What is judged, each as `parse_quantity` takes it.
        t_end: Time at the end [s].
        body: The only body that gets mesh, degree, cell.
        options: Of `StudyOptions`; values may be texts; None: not given.

    Raises:
        SceneError: If one is impossible.
    """
    given = {name: value for name, value in options.items() if value is not None}
    schemes = dict[str, Any]()
    if "reference" in given:
        given["reference"] = _name(given["reference"], schemes)
    if (several := given.get("scheme")) is not None:
        several = several.split(",") if isinstance(several, str) else several
        several = several if isinstance(several, Iterable) else (several,)
        given["scheme"] = tuple(_name(scheme, schemes) for scheme in several)
    base = Base(scene, tuple(parameters.items()), t_end, body, schemes)
    # beside an exact value the error of a single run is whole
    if "exact" not in given and not any(given.get(axis) for axis in AXES):
        given = usual_axes(base) | given
    return Sweep(base, tuple(map(parse_quantity, quantity)), **read(StudyOptions, given))


def _name(scheme: Any, found: dict[str, Any]) -> Any:
    """Name of a scheme; one that is an object is taken down by it.

    Raises:
        SceneError: If two have one name.
    """
    if isinstance(scheme, str) or not hasattr(scheme, "expand"):
        return scheme
    name = str(scheme.name)
    if name in SCHEMES or found.setdefault(name, scheme) != scheme:
        raise SceneError(f"study: two schemes are called '{name}'; names must be different")
    return name


def usual_axes(base: Base) -> dict[str, Any]:
    """Default axes: mesh and step about those of the scene, in one round.

    Args:
        base: The scene.

    Raises:
        SceneError: If it is impossible.
    """
    own = base.complete(Choice())
    found: dict[str, Any] = {"repeat": 1}
    if own.mesh is not None:
        # a beam has one count
        factors, moving = (Fraction(1, 2), Fraction(1), Fraction(2)), (True, own.cell is not None)
        some = (_scaled(own, ("mesh",), moving, factor) for factor in factors)
        found["mesh"] = tuple(choice.mesh for choice in some if choice is not None)
    elif own.divide is not None:
        found["divide"] = (1, 2)
    if own.step_error is not None:
        found["step_error"] = tuple(own.step_error * f for f in (10.0, 1.0, 0.1))
    elif own.dt is not None and own.scheme not in ("static", "linear-statics"):
        found["dt"] = tuple(own.dt * f for f in (2.0, 1.0, 0.5))
    return found


@dataclass(frozen=True)
class Grid:
    """The choices of a sweep.

    Args:
        choices: All that are possible, coarse ones first.
        left_out: Others, each with the reason.
    """

    choices: tuple[Choice, ...]
    left_out: tuple[tuple[Choice, str], ...]

    def values(self, axis: str) -> list[Any]:
        """Different values of an axis, in the order of the grid."""
        return list(dict.fromkeys(getattr(c, axis) for c in self.choices))

    @property
    def swept(self) -> tuple[str, ...]:
        """Axes with several values."""
        return tuple(axis for axis in AXES if len(self.values(axis)) > 1)

    @property
    def named(self) -> tuple[str, ...]:
        """Axes by which a configuration is called: those swept, mesh and step."""
        return tuple(axis for axis in AXES if axis in (*self.swept, *REFINED))


def make_grid(sweep: Sweep) -> Grid:
    """All combinations of what is named.

    Raises:
        SceneError: If the scene cannot have some value, whatever the others are.
    """
    named = {axis: getattr(sweep, axis) for axis in AXES if getattr(sweep, axis)}
    found: dict[Choice, None] = {}
    left_out: list[tuple[Choice, str]] = []
    good: set[tuple[str, Any]] = set()
    first: dict[tuple[str, Any], str] = {}
    for chosen in _products(named):
        if not sweep.runs(chosen):
            continue
        try:
            complete = sweep.base.complete(Choice(**chosen))
        except SceneError as error:
            left_out.append((Choice(**chosen), str(error)))
            for item in chosen.items():
                first.setdefault(item, str(error))
            continue
        found[complete] = None
        good |= set(chosen.items())
    if not found:
        raise SceneError(left_out[0][1])
    for item, sentence in first.items():
        if item not in good:
            raise SceneError(sentence)
    if sweep.alpha and all(c.alpha is None for c in found):
        raise SceneError(
            f"study: alpha is {', '.join(f'{a:g}' for a in sweep.alpha)}; it must be left out "
            "where no scheme is 'ed'"
        )
    return Grid(tuple(sorted(found, key=cost)), tuple(left_out))


def _products(named: dict[str, tuple[Any, ...]]) -> Iterator[dict[str, Any]]:
    """All combinations; fixed steps and steps that follow their error are two kinds of one axis."""
    kinds: list[str] = [k for k in ("dt", "step_error") if k in named]
    others = [axis for axis in named if axis not in kinds]
    for kind in kinds or [""]:
        axes = [axis for axis in named if axis in (*others, kind)]
        for values in itertools.product(*(named[axis] for axis in axes)):
            yield dict(zip(axes, values, strict=True))


def cost(choice: Choice) -> float:
    """About what a run costs, relative to others of its scene."""
    elements = prod(choice.counts)
    stages = SCHEMES.get(choice.scheme or "", Traits()).work
    step = choice.step_error or choice.dt or 1.0
    return elements * stages * (choice.degree or 1) ** 2 / step


def chain(sweep: Sweep, grid: Grid) -> list[Choice]:
    """Choices for the reference: the finest first, then the next coarser one or two.

    It is finer in time and mesh if these are swept; if neither is, in time where the scene is
    dynamic, in its mesh where it is static.

    Raises:
        SceneError: If the scene cannot have the scheme that the reference is to have.
    """
    some = _of_scheme(sweep, grid)
    # fixed steps, where there are some
    some = [c for c in some if c.step_error is None] or some
    best = min(some, key=_fineness)
    time = "dt" if best.step_error is None else "step_error"
    axes = ("mesh", "divide", time)
    directions = [axis for axis in axes if len({getattr(c, axis) for c in some}) > 1]
    if not directions:
        dynamic = best.scheme not in ("static", "linear-statics")
        meshes = [axis for axis in ("divide", "mesh") if getattr(best, axis) is not None]
        directions = [time] if dynamic or not meshes else meshes[:1]
    counts = [len({m[k] for m in grid.values("mesh") if m}) for k in (0, 1)]
    # a count that is the same in all meshes stays
    moving = [n > 1 for n in counts] if "mesh" in grid.swept else [True, True]
    finest = replace(best, dt=min(c.dt for c in some if c.dt))
    if best.mesh is not None:
        finest = replace(finest, mesh=max((m for m in grid.values("mesh") if m), key=prod))
    if best.divide is not None:
        finest = replace(finest, divide=max(n for n in grid.values("divide") if n))
    factors = (Fraction(sweep.refine), Fraction(1), Fraction(1, sweep.refine))
    members = [_scaled(finest, directions, moving, factor) for factor in factors]
    return [m for m in members if m is not None]


def _of_scheme(sweep: Sweep, grid: Grid) -> Sequence[Choice]:
    """Configurations of the grid with the scheme of the reference, which may be one of no other."""
    if sweep.reference is None:
        for scheme in PREFERRED:
            if some := [c for c in grid.choices if c.scheme == scheme]:
                return some
        return grid.choices
    if some := [c for c in grid.choices if c.scheme == sweep.reference]:
        return some
    others = [replace(c, scheme=sweep.reference, alpha=None) for c in grid.choices]
    try:
        return [sweep.base.complete(choice) for choice in dict.fromkeys(others)]
    except SceneError as error:
        raise SceneError(f"study: reference is '{sweep.reference}': {error}") from None


def not_refined(sweep: Sweep, grid: Grid, finer: Sequence[Choice]) -> tuple[str, ...]:
    """Axes with one fineness in the grid and in the reference, whose error no run shows.

    Args:
        sweep: The study.
        grid: Its configurations.
        finer: Those of its reference; empty where that is no run of ours.
    """
    if not finer:
        return ()
    runs, first = (*grid.choices, *finer), grid.choices[0]
    found = []
    divided = len({c.divide for c in runs}) > 1
    if first.degree is not None and len({(c.mesh, c.divide) for c in runs}) == 1:
        found.append(f"the mesh ({first.label(('mesh', 'divide'))} in all runs)")
    elif first.mesh is not None and first.cell is not None and not divided:
        found += [
            f"elements along the {side} side of the mesh ({first.mesh[k]} in all runs)"
            for k, side in enumerate(("first", "second"))
            if len({c.mesh[k] for c in runs if c.mesh}) == 1
        ]
    if sweep.base.body is not None:
        found.append(f"the meshes of bodies other than '{sweep.base.body}'")
    steps = {(c.dt, c.step_error) for c in runs}
    if first.scheme not in ("static", "linear-statics") and len(steps) == 1:
        found.append(f"the step ({first.label(('dt',))} in all runs)")
    return tuple(found)


def _fineness(choice: Choice) -> tuple[float, ...]:
    """The most accurate first: exact, little dissipation, quadrilaterals, high degree, tight."""
    return (
        float(choice.model not in (None, "exact")),
        choice.alpha or 0.0,
        float(choice.cell == "tri"),
        -float(choice.degree or 0),
        choice.newton_tolerance or 0.0,
        float(choice.solve == "full"),
        choice.step_error or 0.0,
        choice.dt or 0.0,
    )


def _scaled(
    choice: Choice, directions: Sequence[str], moving: Sequence[bool], factor: Fraction
) -> Choice | None:
    """The choice finer by a factor, or coarser by one below 1; None if it cannot be."""
    times, over = factor.numerator, factor.denominator
    scaled: dict[str, Any] = {}
    rests = [0]
    if choice.step_error is not None:
        # the error is proportional to it; that of a step is so to its square at least
        scaled["step_error"] = choice.step_error * over**2 / times**2
    if choice.dt is not None:
        scaled["dt"] = choice.dt * over / times
    if choice.divide is not None and "divide" in directions:
        scaled["divide"], rest = divmod(choice.divide * times, over)
        rests.append(rest)
    if choice.mesh is not None and "mesh" in directions:
        both = zip(choice.mesh, moving, strict=True)
        counts = [divmod(n * times, over) if moves else (n, 0) for n, moves in both]
        scaled["mesh"] = tuple(n for n, _ in counts)
        rests += [rest for _, rest in counts]
    chosen = {axis: value for axis, value in scaled.items() if axis in directions}
    return None if any(rests) else replace(choice, **chosen)
