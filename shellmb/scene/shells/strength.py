"""Strengths of materials, and criteria of failure as utilisations of plies.

The utilisation is the inverse of the reserve factor: if all stresses grow by the factor
`1/utilisation`, the criterion is just met. It is linear in the load whatever the criterion: where
that is `a R^2 + b R = 1` with quadratic `a` and linear `b`, its positive root gives
`1/R = (b + sqrt(b^2 + 4a))/2`, which is zero without load.
"""

from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from shellmb.arrays import Floats
from shellmb.scene.types import Positive
from shellmb.scene.values.validate import described

# largest utilisation beside stresses that stay, and reserve factor of what is hardly loaded
MOST = 1000.0
TINY = np.finfo(float).tiny

Interaction = Annotated[float, Field(gt=-1, lt=1, allow_inf_nan=False)]


@described("strength")
class Strength:
    """Strengths of a ply's material, or of a metal; each criterion needs some of them.

    All are positive, those of compression, too.

    Args:
        Xt: Along the fibres in tension [Pa].
        Xc: Along the fibres in compression [Pa].
        Yt: Across the fibres in tension [Pa].
        Yc: Across the fibres in compression [Pa].
        S12: In-plane shear [Pa].
        S13: Shear between plies along the fibres [Pa].
        S23: Shear between plies across the fibres; of Hashin the transverse shear strength [Pa].
        e1t: Strain along the fibres in tension.
        e1c: Strain along the fibres in compression.
        e2t: Strain across the fibres in tension.
        e2c: Strain across the fibres in compression.
        g12: Engineering shear strain in the plane.
        yield_stress: Yield stress of an isotropic material [Pa].
        f12: Interaction of Tsai and Wu, `F12/sqrt(F11 F22)`.
        p12t: Slope of Puck's envelope where tension across the fibres begins.
        p12c: Slope of Puck's envelope where compression across the fibres begins.
    """

    _: KW_ONLY
    Xt: Positive | None = None
    Xc: Positive | None = None
    Yt: Positive | None = None
    Yc: Positive | None = None
    S12: Positive | None = None
    S13: Positive | None = None
    S23: Positive | None = None
    e1t: Positive | None = None
    e1c: Positive | None = None
    e2t: Positive | None = None
    e2c: Positive | None = None
    g12: Positive | None = None
    yield_stress: Positive | None = None
    f12: Interaction = -0.5
    p12t: Positive = 0.3
    p12c: Positive = 0.25


@dataclass(frozen=True)
class Criterion:
    """A criterion of failure.

    Args:
        needs: Names of the strengths that it needs.
        modes: Names of its modes of failure.
        by_mode: Utilisations by mode from stresses and strains 11, 22, 12, 13, 23 of a ply.
        across: Whether it needs stresses 13 and 23.
        wrong: Says what is wrong with strengths, if anything is.
    """

    needs: tuple[str, ...]
    modes: tuple[str, ...]
    by_mode: Callable[[Floats, Floats, Any], list[Any]]
    across: bool = False
    wrong: Callable[[Any], str] = lambda k: ""

    def beside(self, grows: Floats, stays: Floats, strength: Any) -> Floats:
        """Utilisations by mode where some stresses stay as they are, shape (..., modes).

        The largest one, `v`, is the inverse of the factor by which the others may grow. All
        criteria are of degree one, so it solves `U(grows + v stays) = v`. It is `MOST` at most, and
        where those that stay meet the criterion alone.

        Args:
            grows: Stresses and strains that grow, as of `utilisations`, shape (2, ..., 5).
            stays: Those that stay.
            strength: Strengths with all that it needs.
        """

        def largest(both: Floats) -> Floats:
            stress, strain = both
            return np.asarray(self.utilisations(stress, strain, strength).max(axis=-1))

        def excess(v: Floats, *parts: Floats) -> Floats:
            first, second = np.reshape(parts, (2, 2, 5, -1)).swapaxes(2, 3)
            return largest(first + v[:, None] * second) - v

        from scipy.optimize.elementwise import find_root

        parts = np.moveaxis(np.stack([grows, stays]), -1, 2).reshape(20, -1)
        alone, beside = largest(grows).ravel(), largest(stays).ravel()
        # a sum has no more than both for convex criteria
        top = np.minimum(1.000001 * alone / np.maximum(1 - beside, 1e-9), MOST)
        top = np.where(excess(top, *parts) > 0, MOST, top)
        root = find_root(excess, (0 * top, top), args=tuple(parts))
        v = np.where((beside < 1) & root.success, root.x, MOST).reshape(grows.shape[1:-1])[
            ..., None
        ]
        stress, strain = grows + v * stays
        found = self.utilisations(stress, strain, strength)
        return np.asarray(found * v / np.maximum(found.max(axis=-1, keepdims=True), TINY))

    def utilisations(self, stress: Floats, strain: Floats, strength: Any) -> Floats:
        """Utilisations by mode, shape (..., modes).

        Args:
            stress: Stresses 11, 22, 12, 13, 23 in the ply's axes, shape (..., 5).
            strain: Strains likewise, engineering shears.
            strength: Strengths with all that it needs.
        """
        found = self.by_mode(np.moveaxis(stress, -1, 0), np.moveaxis(strain, -1, 0), strength)
        return np.stack(np.broadcast_arrays(*found), axis=-1)


def _signed(value: Floats, tension: float, compression: float) -> tuple[Floats, Floats]:
    return np.maximum(value / tension, 0.0), np.maximum(-value / compression, 0.0)


def _root(a: Any, b: Any) -> Any:
    """Inverse of the positive root R of `a R^2 + b R = 1`."""
    return (b + np.sqrt(b**2 + 4 * a)) / 2


def _stress(s: Floats, e: Floats, k: Any) -> list[Any]:
    return [*_signed(s[0], k.Xt, k.Xc), *_signed(s[1], k.Yt, k.Yc), abs(s[2]) / k.S12]


def _strain(s: Floats, e: Floats, k: Any) -> list[Any]:
    return [*_signed(e[0], k.e1t, k.e1c), *_signed(e[1], k.e2t, k.e2c), abs(e[2]) / k.g12]


def _tsai_hill(s: Floats, e: Floats, k: Any) -> list[Any]:
    X, Y = np.where(s[0] > 0, k.Xt, k.Xc), np.where(s[1] > 0, k.Yt, k.Yc)
    return [np.sqrt((s[0] / X) ** 2 - s[0] * s[1] / X**2 + (s[1] / Y) ** 2 + (s[2] / k.S12) ** 2)]


def _tsai_hill_wrong(k: Any) -> str:
    X, Y = min(k.Xt, k.Xc), max(k.Yt, k.Yc)
    return "" if Y < 2 * X else f"has a strength {Y:.4g} across and {X:.4g} along the fibres"


def _tsai_wu(s: Floats, e: Floats, k: Any) -> list[Any]:
    F11, F22, F66 = 1 / (k.Xt * k.Xc), 1 / (k.Yt * k.Yc), 1 / k.S12**2
    both = 2 * k.f12 * np.sqrt(F11 * F22) * s[0] * s[1]
    a = F11 * s[0] ** 2 + F22 * s[1] ** 2 + F66 * s[2] ** 2 + both
    return [_root(a, (1 / k.Xt - 1 / k.Xc) * s[0] + (1 / k.Yt - 1 / k.Yc) * s[1])]


def _hashin(s: Floats, e: Floats, k: Any) -> list[Any]:
    """Z. Hashin, J. Appl. Mech. 47 (1980) 329-334, in plane stress."""
    shear = (s[2] / k.S12) ** 2
    tension = [np.sqrt((v / t) ** 2 + shear) for v, t in ((s[0], k.Xt), (s[1], k.Yt))]
    slope = ((k.Yc / (2 * k.S23)) ** 2 - 1) / k.Yc
    pressed = _root((s[1] / (2 * k.S23)) ** 2 + shear, slope * s[1])
    return [
        np.where(s[0] >= 0, tension[0], 0.0),
        np.maximum(-s[0] / k.Xc, 0.0),
        np.where(s[1] >= 0, tension[1], 0.0),
        np.where(s[1] < 0, pressed, 0.0),
    ]


def _puck(s: Floats, e: Floats, k: Any) -> list[Any]:
    """A. Puck and H. Schuermann, Compos. Sci. Technol. 58 (1998) 1045-1067, of plane stress.

    Fibres fail at their strengths, without the share of stresses across them.
    """
    S, p = k.S12, k.p12c
    RA = S / (2 * p) * (np.sqrt(1 + 2 * p * k.Yc / S) - 1)
    p23 = p * RA / S
    shear, across = abs(s[2]), s[1]
    # where modes B and C meet: -s22/|s12| = RA/(S sqrt(1 + 2 p23))
    B = -across * S * np.sqrt(1 + 2 * p23) <= RA * shear
    A = np.sqrt((shear / S) ** 2 + ((1 - k.p12t * k.Yt / S) * across / k.Yt) ** 2)
    pressed = np.where(across < 0, -across, 1.0)
    C = ((shear / (2 * (1 + p23) * S)) ** 2 + (across / k.Yc) ** 2) * k.Yc / pressed
    return [
        *_signed(s[0], k.Xt, k.Xc),
        np.where(across >= 0, A + k.p12t * across / S, 0.0),
        np.where((across < 0) & B, (np.sqrt(shear**2 + (p * across) ** 2) + p * across) / S, 0.0),
        np.where((across < 0) & ~B, C, 0.0),
    ]


def _puck_wrong(k: Any) -> str:
    slope = k.p12t * k.Yt
    return "" if slope < k.S12 else f"has p12t Yt = {slope:.4g}, and S12 = {k.S12:.4g}"


def _von_mises(s: Floats, e: Floats, k: Any) -> list[Any]:
    shear = s[2] ** 2 + s[3] ** 2 + s[4] ** 2
    return [np.sqrt(s[0] ** 2 + s[1] ** 2 - s[0] * s[1] + 3 * shear) / k.yield_stress]


def _between(s: Floats, e: Floats, k: Any) -> list[Any]:
    return [np.hypot(s[3] / k.S13, s[4] / k.S23)]


FIBRE = ("fibre tension", "fibre compression")
FIVE = (*FIBRE, "matrix tension", "matrix compression", "shear")
IN_PLANE = ("Xt", "Xc", "Yt", "Yc", "S12")

CRITERIA: dict[str, Criterion] = {
    "max-stress": Criterion(IN_PLANE, FIVE, _stress),
    "max-strain": Criterion(("e1t", "e1c", "e2t", "e2c", "g12"), FIVE, _strain),
    "tsai-hill": Criterion(IN_PLANE, ("ply",), _tsai_hill, wrong=_tsai_hill_wrong),
    "tsai-wu": Criterion(IN_PLANE, ("ply",), _tsai_wu),
    "hashin": Criterion((*IN_PLANE, "S23"), FIVE[:4], _hashin),
    "puck": Criterion(
        IN_PLANE, (*FIBRE, "matrix A", "matrix B", "matrix C"), _puck, wrong=_puck_wrong
    ),
    "interlaminar": Criterion(("S13", "S23"), ("between plies",), _between, across=True),
    "von-mises": Criterion(("yield_stress",), ("yield",), _von_mises, across=True),
}
