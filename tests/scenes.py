"""Plates that many tests have: free or clamped, of any section, in any scheme."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from shellmb.scene import Clamped, EdgeForce, Isotropic, Rectangle, Scene, Shell

# wave speed one: with dt = 0.1 the step resolves the elements' own frequencies, about 20 rad/s
SOFT = Isotropic(E=1.0, nu=0.3, thickness=0.2, density=1.0)
# what is said of a plate and not of a scene
OF_PLATES = {"size", *(f.name for f in fields(Shell))} - {f.name for f in fields(Scene)}


def plate(
    section: Any = SOFT, size: tuple[float, float] = (1.0, 0.5), name: str = "plate", **more: Any
) -> Shell:
    """A rectangular plate of 2 x 1 elements, or as `surface` and `mesh` say."""
    return Shell(name, section=section, **{"surface": Rectangle(*size), "mesh": (2, 1)} | more)


def plate_scene(scheme: str = "ep", alpha: float | None = None, **given: Any) -> Scene:
    """A plate by itself, free unless supports are given; what is said of plates is the plate's."""
    own = {name: given.pop(name) for name in OF_PLATES & given.keys()}
    return Scene("plate", plate(**own), scheme=scheme, alpha=alpha, **given)


def cantilever(
    force: tuple[float, float, float], scheme: str = "ep", alpha: float | None = None, **given: Any
) -> Scene:
    """A plate that is clamped at its left and pulled at its right edge."""
    held = {"supports": Clamped("left"), "loads": EdgeForce("right", force)}
    return plate_scene(scheme, alpha, **held, **given)
