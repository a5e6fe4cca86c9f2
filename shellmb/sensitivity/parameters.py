"""Parameters of a scene function by which a run is differentiated, and the scenes beside it."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from numbers import Real
from typing import Any

from shellmb.errors import SceneError
from shellmb.options.described import read
from shellmb.options.run import Options
from shellmb.running.loader import (
    check_function,
    check_names,
    check_values,
    load,
    parameters_by_name,
    scene_of,
)
from shellmb.scene import FromMode, Scene
from shellmb.scene.checks.schemes import jumps
from shellmb.scene.fingerprint import differences, fingerprint

# relative distance of the scenes at both sides: the error of central differences, its square, and
# the round-off of forces over it are both below 1e-7 of the derivative
STEP = 1e-5
# least size over the value: differences of 1e-10 of a value leave six digits of what depends on it
LEAST = 1e-5
# with bodies in modes and starts from modes: eigenvectors are known to ten digits
REDUCED = 1e-4
# how a parameter is given a value, in Python and in a command
VALUE = "values={{'{name}': ...}} (--set {name}=...)"


@dataclass(frozen=True)
class Parameter:
    """A parameter by which a run is differentiated.

    Args:
        name: Its name in the scene function.
        value: Its value.
        step: Distance of the values at both sides.
        share: That distance over the size of the parameter.
    """

    name: str
    value: float
    step: float
    share: float = STEP

    @property
    def size(self) -> float:
        """Size of the parameter: its value, or what stands for it where that does not tell."""
        return self.step / self.share

    @property
    def sides(self) -> tuple[float, float]:
        """Values at both sides, the larger one first."""
        return self.value + self.step, self.value - self.step

    @property
    def width(self) -> float:
        """Distance of both sides as the numbers have it."""
        above, below = self.sides
        return above - below

    def apart(self, share: float) -> Parameter:
        """The parameter with both sides at another distance, over its size."""
        return replace(self, step=self.size * share, share=share)

    def widened(self, scene: Scene) -> Parameter:
        """The parameter with differences as wide as a scene needs."""
        modal = any(body.modes for body in scene.bodies)
        modal = modal or any(isinstance(start, FromMode) for start in scene.starts)
        return self.apart(REDUCED) if modal else self

    @contextmanager
    def named(self) -> Iterator[None]:
        """Errors of scenes at both sides name the self.

        Raises:
            SceneError: If such a scene is impossible.
        """
        try:
            yield
        except SceneError as error:
            above, below = self.sides
            raise SceneError(
                f"sensitivities: the scene is not possible on both sides of '{self.name}' = "
                f"{self.value:g}, at {below!r} and {above!r}: {error}"
            ) from error

    def without_effect(self, base: Scene, side: Scene) -> str:
        """Sentence about a parameter on both sides of which the scene is the same.

        Args:
            base: The scene at its value.
            side: The scene on either side.
        """
        name, (above, below) = self.name, self.sides
        if not independent(base, side):
            return (
                f"the scene is the same at '{name}' = {below:.9g} and {above:.9g}, and another one "
                f"at {self.value:g}: its derivatives are zero if the scene is a smooth function of "
                "it; one with a kink there, such as abs, has none"
            )
        return (
            f"nothing depends on '{name}' between {below:.9g} and {above:.9g}: its derivatives are "
            f"zero; if this difference is too small to count, scales={{'{name}': ...}} (--scale "
            f"{name}=...) gives a larger one"
        )


@dataclass(frozen=True)
class Differentiated:
    """A scene function at given values of its parameters.

    Args:
        make: The function.
        name: What its run directory is called.
        given: Values of its parameters; defaults are left out.
        options: What replaces choices of the scene.
        results: What it measures, if its module says so.
    """

    make: Callable[..., Scene]
    name: str
    given: Mapping[str, Any]
    options: Options
    results: Callable[..., dict[str, float]] | None = None

    def scene(self, **changed: float) -> Scene:
        """The scene with some values changed.

        Args:
            changed: New values by name.

        Raises:
            SceneError: If it is impossible.
        """
        given, who = {**self.given, **changed}, f"sensitivities: scene '{self.name}'"
        check_values(self.make, given, who, VALUE)
        return self.options.apply(scene_of(self.make, given, who, "its function"))

    def base(self) -> Scene:
        """The scene at the given values, which the function makes alike whenever it is called.

        Raises:
            SceneError: If it is impossible, or random.
        """
        scene, again = self.scene(), self.scene()
        others = differences(*(fingerprint(made, whole=True) for made in (scene, again)))
        if others:
            path, first, second = others[0]
            raise SceneError(
                f"sensitivities: scene '{self.name}' differs between two calls of its function, "
                f"{path} is {first} and then {second}; give its random numbers a seed within the "
                "function"
            )
        return scene

    def check_known(self, names: Mapping[str, Any] | Sequence[str]) -> None:
        """Refuse parameters that the function does not have."""
        check_names(self.make, names, f"sensitivities: scene '{self.name}'")

    def parameters(
        self, names: Sequence[str], scales: Mapping[str, float] | None = None
    ) -> tuple[Parameter, ...]:
        """The parameters with their values and the distances of both sides.

        Args:
            names: Their names.
            scales: Sizes by which steps are chosen; of others their values.

        Raises:
            SceneError: If one is unknown, named twice, no number, or zero without a scale.
        """
        if isinstance(names, str):
            names = [names]
        if not names:
            raise SceneError("sensitivities: no parameter is named; name at least one")
        self.check_known(names)
        sizes = _sizes(names, scales or {})
        signature, found = parameters_by_name(self.make, "sensitivities"), list[Parameter]()
        for name in names:
            if any(p.name == name for p in found):
                raise SceneError(f"sensitivities: parameter '{name}' is named twice; name it once")
            default = signature[name].default if name in signature else inspect.Parameter.empty
            value = self.given.get(name, default)
            if value is inspect.Parameter.empty:
                raise SceneError(
                    f"sensitivities: parameter '{name}' has no value; give it a default, or a "
                    f"value by {VALUE.format(name=name)}"
                )
            if isinstance(value, bool) or not isinstance(value, Real):
                raise SceneError(
                    f"sensitivities: parameter '{name}' is {value!r:.40}; it must be a number"
                )
            scale = sizes.get(name, abs(float(value)))
            if not (math.isfinite(value) and math.isfinite(scale) and scale > 0):
                raise SceneError(
                    f"sensitivities: parameter '{name}' is {value:g}, which gives no size of "
                    f"differences; give its size, as in scales={{'{name}': 1.0}} (--scale "
                    f"{name}=1.0)"
                )
            least = LEAST * abs(float(value))
            if scale < least:
                raise SceneError(
                    f"sensitivities: scales gives '{name}' the size {scale:g}, and its value is "
                    f"{value:g}; differences would be round-off of it: give a size of at least "
                    f"{least:.3g}"
                )
            found.append(Parameter(name, float(value), STEP * scale))
        return tuple(found)

    def beside(self, base: Scene, parameter: Parameter) -> tuple[Scene, Scene]:
        """Scenes at both sides of a parameter.

        Args:
            base: The scene itself.
            parameter: The parameter.

        Raises:
            SceneError: If one is impossible, or its steps are others.
        """
        found = []
        for value in parameter.sides:
            with parameter.named():
                scene = self.scene(**{parameter.name: value})
            held = _held(scene)
            for name, ours in _held(base).items():
                its = held.get(name)
                if ours != its:
                    raise SceneError(
                        f"sensitivities: parameter '{parameter.name}' changes {name} from {ours} "
                        f"to {its}; steps and choices of the run are fixed, so it must not"
                    )
            for ours, its in zip(jumps(base), jumps(scene), strict=False):
                if ours != its:
                    raise SceneError(
                        f"sensitivities: parameter '{parameter.name}' moves the jump of a load or "
                        f"motion at t = {ours:g}, which steps do not follow; use a `Ramp`, or "
                        "compare runs (`sweep`)"
                    )
            found.append(scene)
        return found[0], found[1]


def differentiated(
    scene: Callable[..., Scene] | str, given: Mapping[str, Any] | None, **options: Any
) -> Differentiated:
    """A scene function that is to be differentiated.

    Args:
        scene: The function, the name of a bundled scene, or the path of a Python file.
        given: Values of its parameters; of a scene that is named, as texts or not.
        options: Of `Options`, what replaces choices of the scene.

    Raises:
        SceneError: If it is no function, or has no such parameters.
    """
    chosen = Options(**read(Options, options))
    values = dict(given or {})
    if isinstance(scene, str):
        module = load(scene)
        texts = {name: str(v) for name, v in values.items() if isinstance(v, str)}
        known = {**values, **{name: module.value(name, text) for name, text in texts.items()}}
        made = Differentiated(module.module.scene, module.name, known, chosen, module.results)
    else:
        check_function(scene, "sensitivities")
        made = Differentiated(scene, getattr(scene, "__name__", "scene"), values, chosen)
    made.check_known(made.given)
    return made


def _sizes(names: Sequence[str], scales: Mapping[str, Any]) -> dict[str, float]:
    """Sizes of parameters, of those that have one.

    Raises:
        SceneError: If one is no number, or of another parameter.
    """
    for name, size in scales.items():
        if name not in names:
            raise SceneError(
                f"sensitivities: scales has '{name}', which is no parameter here; parameters are "
                + ", ".join(f"'{n}'" for n in names)
            )
        if isinstance(size, bool) or not isinstance(size, Real):
            raise SceneError(
                f"sensitivities: scales gives '{name}' the size {size!r:.40}; it must be a number"
            )
        if not math.isfinite(size) or size == 0:
            raise SceneError(
                f"sensitivities: scales gives '{name}' the size {size:g}; it must be finite, and "
                "not zero"
            )
    return {name: abs(float(size)) for name, size in scales.items()}


def _held(scene: Scene) -> dict[str, Any]:
    """Steps and choices of a run, which no parameter may change, by their names."""
    names = ("scheme_name", "alpha", "dt", "t_end", "assemble", "redundant")
    path = scene.path
    found = {name: getattr(scene, name) for name in names} | {"path": type(path).__name__}
    if path is None:
        return found
    return found | {f"{f.name} of path": getattr(path, f.name) for f in fields(path)}


def independent(above: Scene, below: Scene) -> bool:
    """Decide whether both scenes describe the same physics: nothing depends on the parameter."""
    return fingerprint(above, whole=True) == fingerprint(below, whole=True)
