"""The lowest frequency of a shell or beam by itself: how fast it may spin without stiffening."""

from __future__ import annotations

from typing import Any

import numpy as np

from shellmb.model.model import Model
from shellmb.preprocessing.modal.isolated import SHIFT, IsolatedBody
from shellmb.scene import Beam, Scene
from shellmb.scene.schemes import SIMPLEST
from shellmb.system.eigenvalues import eigenpairs

# of a beam with both ends free over that of one with an end clamped, 22.37/3.516
CLAMPED = 6.36


def lowest_frequency(model: Model, name: str) -> float:
    """Lowest angular frequency of a body with its supports, rad/s; collective.

    Without supports that of the free body, and where it has joints, which may hold it as a clamp
    does, 1/6.36 of that: so much less it is of a beam.

    Args:
        model: A model with it.
        name: Its name in the scene.
    """
    scene = model.scene
    body: Any = scene.body(name)
    if isinstance(body, Beam) and body.curve.shell is not None:
        # it swings with the shell that it runs along
        return lowest_frequency(model, body.curve.shell)
    supports = tuple(s for s in scene.supports if scene.bodies_of(s)[0].name == name)
    parts: dict[str, Any] = {"beams" if isinstance(body, Beam) else "shells": body}
    parts |= {"supports": supports, "scheme": SIMPLEST, "dt": 1.0, "t_end": 1.0}
    isolated = IsolatedBody(Scene(f"{name} alone", **parts), model.comm)
    shift = -SHIFT * isolated.scale
    found, _ = eigenpairs(isolated.K, isolated.M, 7, shift, symmetric=True)
    elastic = [value for value in found.real if value > 1e-3 * isolated.scale]
    held = not supports and any(name in (j.first, j.second) for j in scene.joints)
    return float(np.sqrt(elastic[0])) / (CLAMPED if held else 1.0)
