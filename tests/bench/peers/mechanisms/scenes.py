"""Mechanisms that fall: scenes, and the exact motion of rigid ones by an integrator of its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

import shellmb as sm
from shellmb.arrays import Floats
from shellmb.demos import heavy_top as top
from shellmb.demos.verification import chains
from shellmb.scene import (
    GROUND,
    Beam,
    GeneralSection,
    Line,
    Prismatic,
    Revolute,
    RigidBody,
    Scene,
    Spherical,
    Universal,
)
from tests.bench.peers.mechanisms.linkages import GRAVITY, CrankAndCoupler, FourBar, fall

# of the exact motion, from which those at the ends of steps are interpolated
SAMPLES = 4000
# the link of a chain whose end is looked at, if there are as many: the free end of a long one falls
# as if it were alone
SEEN = 10
# links of a chain: length, mass, small moment about their own axis
LENGTH, MASS, THIN = 0.2, 1.0, 1e-3
Z = (0.0, 0.0, 1.0)
START = np.pi / 3
# a flexible coupler: stiffness, of which extension [N] and the last number, bending in the plane
# [N m^2], count, and rotary inertia [kg m], which cables have none of: that of a square of 1 mm
STIFFNESS, ROTARY = (2.4e5, 1e5, 1e5, 2.0, 2.0, 2.0), 2e-7
ELEMENTS = 4


@dataclass(frozen=True)
class Mechanism:
    """A mechanism.

    Args:
        name: Short name.
        title: What it is.
        scene: Makes it.
        exact: The motion of its probe at ascending instants, m, shape (n,); None: of flexible ones
            nobody knows it, and finer runs of both codes stand in for it.
        steps: Steps of runs in shellmb by scheme, s.
        theirs: Steps of runs in other codes, s.
    """

    name: str
    title: str
    scene: Callable[[], Scene]
    exact: Callable[[Floats], Floats] | None
    steps: dict[str, tuple[float, ...]]
    theirs: tuple[float, ...]

    @property
    def bodies(self) -> int:
        """Number of bodies."""
        return len(self.scene().rigid_bodies)


def bar(name: str, start: Any, end: Any, mass: float) -> RigidBody:
    """A homogeneous bar between two points of the x-y plane."""
    a, b = np.array([*start, 0.0][:3]), np.array([*end, 0.0][:3])
    along = b - a
    length = float(np.linalg.norm(along))
    e = along / length
    J = mass * length**2 / 12 * (np.eye(3) - np.outer(e, e)) + THIN * np.outer(e, e)
    return RigidBody(name, mass, J.tolist(), position=tuple((a + b) / 2))


def _scene(name: str, dt: float, t_end: float, **parts: Any) -> Scene:
    """A scene under gravity along -y."""
    return Scene(name, loads=sm.Gravity((0.0, -GRAVITY, 0.0)), dt=dt, t_end=t_end, **parts)


def _probe(point: Any, body: str) -> Any:
    at: Any = tuple(map(float, point))
    return (sm.Probe("point", at, "position", 1, body=body),)


def chain(links: int, t_end: float) -> Scene:
    """Links in a row along x, let go."""
    ends = [(LENGTH * k, 0.0, 0.0) for k in range(links + 1)]
    names = [GROUND, *(f"link{k}" for k in range(links))]
    pairs = list(zip(names[1:], ends[:-1], ends[1:], strict=True))
    return _scene(
        "chain",
        rigid_bodies=[bar(name, a, b, MASS) for name, a, b in pairs],
        joints=[
            Revolute(f"hinge{k}", names[k], names[k + 1], at=ends[k], axis=Z) for k in range(links)
        ],
        probes=_probe(ends[min(links, SEEN)], names[min(links, SEEN)]),
        dt=t_end / 100,
        t_end=t_end,
    )


def chain_tip(links: int, time: Floats) -> Floats:
    """Height of the end of its tenth link, or of the last one, m."""
    links_ = [chains.Link.rod(MASS, LENGTH)] * links
    motion = chains.chain(links_, np.full(links, np.pi / 2), np.zeros(links), time, GRAVITY)
    return np.asarray(motion.hinges()[:, min(links, SEEN) - 1, 1])


def slider_crank(elements: int = 0) -> Scene:
    """A crank that falls from 60 degrees, and what hangs on it.

    Args:
        elements: Elements of the coupler, a slender beam of that mass; 0: it is rigid.
    """
    which = CrankAndCoupler()
    pin, slide = (np.array([*np.real(p), 0.0]) for p in which.points(START))
    one, two, three = which.masses
    coupler: dict[str, Any] = {"rigid_bodies": [bar("coupler", pin, slide, two)]}
    if elements:
        line, mass = Line(tuple(pin), tuple(slide)), two / which.coupler
        moments = ROTARY, 0.0, ROTARY
        section = GeneralSection(STIFFNESS, mass, second_moments=moments)
        beam = Beam("coupler", line, section, elements, up=Z, transverse_shear=False)
        coupler = {"rigid_bodies": [], "beams": [beam]}
    return _scene(
        "slider_crank",
        rigid_bodies=[
            bar("crank", (0, 0), pin, one),
            *coupler.pop("rigid_bodies"),
            RigidBody("slider", three, (THIN, THIN, THIN), position=tuple(slide)),
        ],
        **coupler,
        # 5 + 3 + 4 + 5 constraints: with revolute joints only, three would be redundant
        joints=[
            Revolute("bearing", GROUND, "crank", at=(0, 0, 0), axis=Z),
            Spherical("pin", "crank", "coupler", at=tuple(pin)),
            Universal("wrist", "slider", "coupler", at=tuple(slide), axis=Z, second_axis=(0, 1, 0)),
            Prismatic("guide", GROUND, "slider", at=tuple(slide), axis=(1, 0, 0)),
        ],
        probes=_probe(pin, "crank"),
        dt=1e-2,
        t_end=1.0,
    )


def four_bar() -> Scene:
    """A crank that falls from 60 degrees, with coupler and rocker."""
    which = FourBar()
    pin, end = (np.array([*np.real(p), 0.0]) for p in which.points(START))
    base, (one, two, three) = (which.base, 0.0, 0.0), which.masses
    return _scene(
        "four_bar",
        rigid_bodies=[
            bar("crank", (0, 0), pin, one),
            bar("coupler", pin, end, two),
            bar("rocker", base, end, three),
        ],
        joints=[
            Revolute("A", GROUND, "crank", at=(0, 0, 0), axis=Z),
            Spherical("B", "crank", "coupler", at=tuple(pin)),
            Universal("C", "rocker", "coupler", at=tuple(end), axis=Z, second_axis=(0, 1, 0)),
            Revolute("D", GROUND, "rocker", at=base, axis=Z),
        ],
        probes=_probe(pin, "crank"),
        dt=1e-2,
        t_end=1.0,
    )


def crank_end(which: CrankAndCoupler | FourBar, time: Floats) -> Floats:
    """Height of the end of the crank of a linkage that falls, m."""
    return np.asarray(which.crank * np.sin(fall(which.bars, START, time)))


def heavy_top() -> Scene:
    """The demo, its centre probed across its axis."""
    scene = top.scene(t_end=0.5)
    return replace(scene, probes=[p for p in scene.probes if p.name == "x"])


# ratio of one step to the next smaller one, in all codes alike: so much the fastest run below an
# error may take by chance
RATIO = 1.2


def sizes(t_end: float, fewest: int, most: int) -> tuple[float, ...]:
    """Steps that end at a time, from the largest to the smallest one, each over `RATIO`.

    Args:
        t_end: The time, s.
        fewest: Number of the largest steps until then.
        most: Number of the smallest ones.
    """
    count = 1 + round(np.log(most / fewest) / np.log(RATIO))
    return tuple(t_end / np.rint(np.geomspace(fewest, most, count)))


FINE = {"ep4": sizes(1.0, 25, 160), "ep": (2e-3,)}
COARSE = sizes(1.0, 200, 5000)
# of half a second of a fast spin, whose errors are near those asked for
QUICK = {"ep4": sizes(0.5, 125, 500), "ep": (5e-4,)}
QUICK_THEIRS = sizes(0.5, 400, 10000)

MECHANISMS = {
    m.name: m
    for m in (
        Mechanism("chain3", "chain of 3 links", lambda: chain(3, 1.0), lambda t: chain_tip(3, t),
                  FINE, COARSE),
        Mechanism("chain10", "chain of 10 links", lambda: chain(10, 1.0),
                  lambda t: chain_tip(10, t), FINE, COARSE),
        Mechanism("chain100", "chain of 100 links", lambda: chain(100, 0.5),
                  lambda t: chain_tip(100, t),
                  {"ep4": sizes(0.5, 20, 80), "ep": (2e-3,)}, sizes(0.5, 100, 2000)),
        Mechanism("slider_crank", "slider-crank", slider_crank,
                  lambda t: crank_end(CrankAndCoupler(), t), FINE, COARSE),
        Mechanism("flexible_slider_crank", "slider-crank, flexible", lambda: slider_crank(ELEMENTS),
                  None, FINE, COARSE),
        Mechanism("four_bar", "four-bar linkage", four_bar,
                  lambda t: crank_end(FourBar(), t), FINE, COARSE),
        Mechanism("heavy_top", "heavy top", heavy_top, lambda t: top.exact(t.tolist())[:, 0], QUICK,
                  QUICK_THEIRS),
    )
}  # fmt: skip


@cache
def exact_of(name: str) -> tuple[Floats, Floats]:
    """Instants [s] and the exact motion of a mechanism's probe there [m].

    Args:
        name: Its name.
    """
    mechanism = MECHANISMS[name]
    assert mechanism.exact is not None
    t = np.linspace(0.0, float(mechanism.scene().t_end or 0.0), SAMPLES + 1)
    return t, mechanism.exact(t)
