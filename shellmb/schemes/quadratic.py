"""Schemes quadratic in time, eqs. (Q1)-(Q6): energy preserving of order 4, decaying of order 3.

All of them stands on this page: edit a number, and it acts. `forms.steps.path` says
where the equations come from. A step of length h goes from `q_i, v_i` to the unknown `q_f, v_f`;
its rows are tested with P0 = 1 and P1 = 2 tau - 1.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from dolfinx import fem

from shellmb.arrays import Floats
from shellmb.forms.steps.path import Holding, Path, PathRow
from shellmb.schemes.base import (
    END,
    Levels,
    LocalError,
    Motion,
    Named,
    Rotations,
    Scheme,
    Stage,
    Values,
    end_velocity,
)
from shellmb.schemes.notation import D, De, H, PathPage, lin, quad, x, y, z
from shellmb.schemes.pieces import START, START_RATE, Pieces, halves

# unknown velocities at the end, times the step
RATE = "v"


def path_of(q_i: Any, q_f: Any, hv_i: Any, hv_f: Any, alpha: Any) -> Path:
    """Mean, chord, bow and mean velocity of the path, eq. (Q1), for numbers and expressions alike.

    Args:
        q_i: State at the start.
        q_f: State at the end.
        hv_i: Velocity at the start times the step.
        hv_f: Velocity at the end times the step.
        alpha: Dissipation.
    """
    chord = q_f - q_i
    bow = ((1 + alpha) * hv_f - (1 - alpha) * hv_i - 2 * alpha * chord) / 12
    mean, mean_velocity = (q_i + q_f) / 2 - bow, ((1 - alpha) * hv_i + (1 + alpha) * hv_f) / 4
    return Path(q_i, q_f, hv_i, hv_f, alpha, mean, chord, bow, mean_velocity, (P0, P1))


# A strain's own path has the mean <s>, the ends e_i and e_f, and the bow s_i + s_f - 2 <s>.
MEAN = lin(x) + (quad(x, x) - quad(z, z) + quad(D, D) / 4) / 2 - quad(D, y) / 6
CHANGE = lin(D) + quad(x + z, D)
BOW = 2 * lin(z) + 2 * quad(x + z, z) + quad(D, y) / 3


def strains(alpha: float) -> tuple[Floats, Floats]:
    """Strains of which `S_0` and `S_1` are the stresses, eq. (Q3)."""
    return MEAN, (CHANGE + alpha * BOW) / 2


# Rows: h^2 M acceleration + S_0.(...) + S_1.(...) + lambda.(...) = loads                 (Q2), (Q4)
P0 = PathRow(
    stresses=(De(x), H(y) / 3),
    holding=Holding(De(x), H(y), lambda g, path: g.value(path.end)),
    # of what has no inertia, eq. (Q6)
    massless=Holding(De(x), H(D) / 2, lambda g, path: g.value(path.end)),
    inertia=lambda path: path.end_velocity - path.start_velocity,
    works=lambda path: path.chord,
    load=lambda tau: 1.0,
)
P1 = PathRow(
    stresses=(H(D) / 6, De(x + z) / 3),
    holding=Holding(De(x + z), H(D) / 6, lambda g, path: g.change(path.end, path.end_velocity)),
    massless=Holding(De(x + z / 4), H(D) / 6, lambda g, path: g.value(path.at(0.5))),
    inertia=lambda path: path.end_velocity + path.start_velocity - 2 * path.chord,
    works=lambda path: 6 * path.bow,
    load=lambda tau: 2 * tau - 1,
)
# with less dissipation the error of fourth order is the larger one in steps of practical length
LEAST_ALPHA = 0.1


@dataclass(frozen=True)
class QuadraticInTime(Scheme):
    """State and velocity quadratic over a step, stresses linear, eqs. (Q1)-(Q5).

    Unknown are the state and the velocity at the end of a step, `q_f` and `h v_f`. Energy is kept
    exactly for `alpha = 0`, and falls in every step for `alpha > 0` by

        alpha [ 2 v_2.M v_2 + (e_i + e_f - 2<s>).C (e_i + e_f - 2<s>)/2 ]                    (Q5)

    with the mean `<s>` of the path that a strain is assumed to take (`forms.steps.path`), which is
    not the mean of the strain of the path of the state.

    Constraints hold at the end of a step for positions and velocities. For linear systems this is
    the family of the paper's energy decaying scheme (Gauss' method with two stages, Radau IIA); in
    large motions it keeps its order, and stiff strains do not hinder a spinning body.

    Args:
        alpha: Dissipation, from 0 (none) to 1 (asymptotic annihilation).
        name: Name in the registry.
    """

    alpha: float = 0.0
    name: str = "ep4"
    dynamic: bool = True
    stages: tuple[str, ...] = (END, RATE)
    rates: tuple[str, ...] = ("v",)
    scaled: tuple[str, ...] = ("v",)
    balance: tuple[str, ...] = (END, RATE)
    # of `S_0 + S_1 P1` and `lambda_0 + 3 lambda_1 P1` from tau = 0 to 1
    slopes: tuple[float, float] = (2.0, 6.0)

    @property
    def title(self) -> str:
        """Title in words."""
        kind = "decaying (ED3)" if self.alpha > 0 else "preserving (EP4)"
        return f"energy {kind}, quadratic in time"

    @property
    def rotations(self) -> Rotations:
        """Accuracy for rotating bodies."""
        # 1.5 rad: rational functions that vibrations are multiplied by turn by 0.6 % less (alpha =
        # 0) to 1.6 % less there, and lose 5 % (alpha = 1)
        return Rotations(1.5, slows=self.alpha > 0)

    @property
    def local_error(self) -> LocalError:
        """Error of one step."""
        if self.alpha == 0:
            return LocalError(5, 1 / 720)
        return LocalError(4, max(self.alpha, LEAST_ALPHA) / 72)

    @property
    def order(self) -> int:
        """Order of accuracy in time, also in large motions."""
        return 3 if self.alpha > 0 else 4

    @property
    def conserves(self) -> frozenset[str]:
        """Linear momentum always, energy without dissipation, angular momentum to the order."""
        return frozenset({"momentum"} | ({"energy"} if self.alpha == 0 else set()))

    @property
    def page(self) -> PathPage:
        """The equations as numbers."""
        return PathPage(path_of, strains, BOW, (P0, P1))

    def expand(self, levels: Levels, dt: fem.Constant) -> dict[str, Stage]:
        """Rows are no sub-intervals here: see `page`."""
        return {}

    @property
    def pieces(self) -> Pieces | None:
        """Both halves of the path."""
        names = START, END, START_RATE, RATE
        q_i, q_f, hv_i, hv_f = np.eye(4)
        middle = path_of(q_i, q_f, hv_i, hv_f, self.alpha).at(0.5).tolist()
        return halves(dict(zip(names, middle, strict=True)), END, RATE, self.alpha)

    @property
    def rolling(self) -> tuple[tuple[float, float], ...]:
        """Instants and weights for forces that depend on velocities, exact to degree 2.

        A body that spins evenly turns as fast along its path as by its velocities where
        `P2 - alpha P1` vanishes: at Gauss' two points, and with alpha = 1 at Radau's. In between it
        is off by `(w h)^2/12`, so that what rolls would slip there.
        """
        root = (self.alpha**2 + 3) ** 0.5
        early, late = (self.alpha - root) / 3, (self.alpha + root) / 3
        share = late / (late - early)
        return ((1 + early) / 2, share), ((1 + late) / 2, 1 - share)

    def load_weight(self, stage: str, tau: float) -> float:
        """The test functions P0 and P1."""
        return (P0 if stage == END else P1).load(tau)

    def prescribed(
        self, stage: str, motion: Motion, t: float, dt: float, rates: Mapping[str, Values]
    ) -> Values:
        """The motion at the end, and its velocity there times the step."""
        if stage == END:
            return motion(t + dt)
        return dt * end_velocity(motion, t, dt)

    def advance(
        self, q: Values, rates: Named, unknown: Named, dt: float, tangent: Any
    ) -> dict[str, Values]:
        """Velocity at the end."""
        return {"v": unknown[RATE] / dt}

    def first_guess(self, stage: str, q: Values, scaled: Mapping[str, Values]) -> Values | float:
        """A straight path: the bow of a very long step would lead astray."""
        return q if stage == END else (1 - self.alpha) / (1 + self.alpha) * scaled["v"]

    def resultants(self, start: Values, unknown: Mapping[str, Values]) -> Values:
        """Resultants of the state at the end from those at the start and of the rows, eq. (Q3)."""
        a = self.alpha
        return (2 * unknown[RATE] + (1 - a) * start + 2 * a * unknown[END]) / (1 + a)

    def path(self, q: Any, scaled: Mapping[str, Any], unknown: Mapping[str, Any]) -> Path:
        """The path of a step; arguments as of `moved`."""
        return path_of(q, unknown[END], scaled["v"], unknown[RATE], self.alpha)

    def moved(
        self, q: Any, scaled: Mapping[str, Any], unknown: Mapping[str, Any]
    ) -> dict[str, Any]:
        """Displacement on which forces of each row do work: the chord, and six times the bow."""
        return dict(zip((END, RATE), self.path(q, scaled, unknown).moved, strict=True))

    def dissipation(self) -> tuple[float, str | None]:
        """There is no jump; what alpha damps is (Q5)."""
        return self.alpha, None


def energy_decaying_3(alpha: float) -> QuadraticInTime:
    """ED3 with a dissipation; without any it is the scheme that preserves energy."""
    return QuadraticInTime(alpha, "ed3")
