"""One configuration of a study: what is chosen in place of the scene's own choices."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from shellmb.options.described import of_today
from shellmb.options.run import Options
from shellmb.running.loader import SceneModule, load
from shellmb.scene import Scene
from shellmb.scene.schemes import DISSIPATIVE, OURS

# in this order choices are named, and vary from the slowest to the fastest in the grid
AXES = (
    *("model", "scheme", "alpha", "cell", "degree", "solve", "newton_tolerance", "mesh", "divide"),
    *("dt", "step_error"),
)
# what a run is the more accurate for, and what its curve in the picture is drawn over
REFINED = ("mesh", "divide", "dt", "step_error")


@dataclass(frozen=True)
class Choice(Options):
    """A configuration, complete: of its axes what is None does not apply to the scene.

    The mesh is that of shells; without shells that of beams, and 1. There is none where one is read
    from a file, which is only divided.
    """

    @property
    def counts(self) -> tuple[int, int]:
        """Elements along both sides; of meshes from files in place of one."""
        along, across = self.mesh or (1, 1)
        times = self.divide or 1
        return along * times, across * times

    def to_dict(self) -> dict[str, Any]:
        """Plain values, those that apply."""
        return {k: getattr(self, k) for k in AXES if getattr(self, k) is not None}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Choice:
        """The choice from its plain values."""
        mesh = values.get("mesh")
        read = of_today(Options, values)
        return cls(**{**read, "mesh": None if mesh is None else tuple(mesh)})

    def without(self, *names: str) -> Choice:
        """A copy with some choices left out."""
        return replace(self, **dict.fromkeys(names))

    def label(self, names: tuple[str, ...] = AXES) -> str:
        """Some of its choices in words, "ED alpha = 0.5, 8x4, dt = 0.002 s"."""
        return ", ".join(_words(self, name) for name in AXES if name in names and _says(self, name))


def _says(choice: Choice, name: str) -> bool:
    # alpha is said with the scheme
    return getattr(choice, name) is not None and not (name == "alpha" and choice.scheme)


# how choices are written
WORDS = {
    "alpha": "alpha = {}",
    "cell": "{}",
    "model": "{}",
    "degree": "degree {}",
    "solve": "{} system",
    "newton_tolerance": "Newton tolerance {}",
    "step_error": "step error {:g}",
    "mesh": "{0[0]}x{0[1]}",
    "divide": "mesh divided by {}",
    "dt": "dt = {:g} s",
}


def _words(choice: Choice, name: str) -> str:
    value = getattr(choice, name)
    if name == "scheme":
        dissipation = "" if choice.alpha is None else f" alpha = {choice.alpha:g}"
        return (value.upper() if value in OURS else value) + dissipation
    return "mesh as it is" if (name, value) == ("divide", 1) else WORDS[name].format(value)


@dataclass(frozen=True)
class Base:
    """The scene that is swept.

    Args:
        scene: Name of a demo, path of a Python file, or what defines the scene.
        parameters: Values of the scene's parameters as text, of one that is named.
        t_end: Time at the end, s; None: that of the scene.
        body: The only shell or beam that gets mesh, degree and cell; None: all of them.
        schemes: Schemes that are objects, by their names.
    """

    scene: str | SceneModule
    parameters: tuple[tuple[str, str], ...] = ()
    t_end: float | None = None
    body: str | None = None
    schemes: Mapping[str, Any] = field(default_factory=dict)

    @cached_property
    def module(self) -> SceneModule:
        """Module that defines the scene.

        Raises:
            SceneError: If there is no such scene.
        """
        return self.scene if isinstance(self.scene, SceneModule) else load(self.scene)

    def build(self, choice: Choice) -> Scene:
        """The scene with a choice.

        Raises:
            SceneError: If it is impossible.
        """
        scene = self.module.build(dict(self.parameters))
        options = replace(choice, t_end=self.t_end, body=self.body)
        if options.scheme == scene.scheme_name:
            # the scene's own stays as it is: it may be an object that no name stands for
            options = replace(options, scheme=None)
        else:
            options = replace(options, scheme=self.schemes.get(str(options.scheme), options.scheme))
        if (choice.scheme or scene.scheme_name) not in DISSIPATIVE:
            # of several schemes some have no dissipation
            options = replace(options, alpha=None)
        return options.apply(scene)

    def complete(self, choice: Choice) -> Choice:
        """The choice with the scene's own where it has none.

        Raises:
            SceneError: If the scene with it is impossible.
        """
        scene = self.build(choice)
        found: dict[str, Any] = {
            "scheme": scene.scheme_name,
            "alpha": scene.dissipation if scene.scheme_name in DISSIPATIVE else None,
            "solve": scene.solver.solve,
            "newton_tolerance": scene.solver.tolerance,
            "dt": scene.dt,
            "step_error": scene.step_control.step_error,
        }
        meshed = [b for b in scene.meshed if self.body in (None, b.name)]
        if meshed:
            first = meshed[0]
            found["degree"] = first.degree
            # only where it is chosen: most studies are of exact bodies
            found["model"] = choice.model
            found["cell"] = first.cell
            found["mesh"], found["divide"] = choice.mesh, choice.divide
            if any(b.refined_times is not None for b in meshed):
                # there is no other choice of a mesh
                found["divide"] = choice.divide or 1
            elif choice.divide is None:
                found["mesh"] = (*first.sides, 1)[:2]
        return Choice(**found)
