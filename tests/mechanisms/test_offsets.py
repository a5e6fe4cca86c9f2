"""Places off a node at the end of rigid arms: statics, a physical pendulum, conservation."""

from dataclasses import replace
from typing import Any

from mpi4py import MPI

import numpy as np
import pytest

from shellmb.errors import SceneError
from shellmb.model.model import Model
from shellmb.running.execute import execute
from shellmb.scene import (
    GROUND,
    Beam,
    Clamped,
    Distance,
    Fixed,
    Gravity,
    Hinged,
    InitialVelocity,
    Isotropic,
    Line,
    Offset,
    PointForce,
    PointMoment,
    Probe,
    Rectangle,
    RectangularSection,
    Revolute,
    RigidBody,
    Scene,
    Shell,
    SoftSupport,
    Solver,
    Spherical,
    Spring,
    SurfaceForce,
    Weld,
)

WIDTH, HEIGHT, DENSITY, G = 0.04, 0.05, 2000.0, 10.0
MASS = WIDTH * HEIGHT * DENSITY
SCHEMES = [("ep", 0.0), ("ed", 0.0), ("ed", 0.5), ("ep4", 0.0), ("ed3", 0.5)]
# one of each kind every day
SLOW = [("ed", 0.0), ("ed3", 0.5)]
MARKED = [pytest.param(*s, marks=pytest.mark.slow if s in SLOW else ()) for s in SCHEMES]


def bar(E: float = 1e10, **more: Any) -> Beam:
    section = RectangularSection(E=E, nu=0.0, width=WIDTH, height=HEIGHT, density=DENSITY)
    return Beam("bar", Line((0, 0, 0), (1, 0, 0)), section, elements=2, **more)


def test_bracket_carries_the_weight_of_a_cantilever() -> None:
    """Force and moment about the end of the arm, which is rigid: the tip sinks by w L^4 / 8 EI."""
    arm = (-0.2, 0.1, 0.3)
    scene = Scene(
        "bracket",
        beams=bar(),
        joints=Weld("bracket", "bar", at=Offset("start", arm)),
        loads=Gravity((0, 0, -G)),
        probes=[Probe("tip", "end"), Probe("foot", Offset("start", arm), component="norm")],
        scheme="linear-statics",
    )
    last = execute(scene).history.iloc[-1]
    force, weight = np.array([last[f"bracket.F{k}"] for k in (1, 2, 3)]), [0, 0, -MASS * G]
    moment = np.array([last[f"bracket.M{k}"] for k in (1, 2, 3)])
    # on the ground, about the end of the arm
    assert np.allclose(force, weight, rtol=0, atol=1e-9)
    assert np.allclose(moment, np.cross((0.7, -0.1, -0.3), weight), rtol=0, atol=1e-9)
    inertia, A = WIDTH * HEIGHT**3 / 12, WIDTH * HEIGHT
    sinks = MASS * G * (1 / (8 * 1e10 * inertia) + 1 / (2 * 5 / 6 * 1e10 / 2 * A))
    # two quadratic elements under a distributed load
    assert last["tip"] == pytest.approx(-sinks, rel=2e-3)
    assert last["foot"] < 1e-12


ARM = np.array([0.25, 0.0, 0.1])
CENTER = np.array([0.5, 0.0, 0.0])


def pendulum(scheme: str, alpha: float, **more: Any) -> tuple[Scene, float]:
    """A stiff bar on a pin at the end of an arm, pushed out of rest, for half a period."""
    r = CENTER - ARM
    d = float(np.linalg.norm(r))
    about_center = MASS * (1 + HEIGHT**2) / 12
    omega = float(np.sqrt(MASS * G * d / (about_center + MASS * d**2)))
    half = np.pi / omega
    scene = Scene(
        "pendulum",
        # stiff: what it bends by its weight is nothing to the angle
        beams=bar(1e15, **more.pop("body", {})),
        joints=Revolute("pin", "bar", at=Offset("start", tuple(ARM)), axis=(0, 1, 0)),
        loads=Gravity(tuple(G * r / d)),
        initial=InitialVelocity(spin=(0, 1e-3 * omega, 0), about=tuple(ARM)),
        probes=Probe("turn", "start", "rotation", 1),
        scheme=scheme,
        alpha=alpha,
        dt=half / 20,
        t_end=half,
        **more,
    )
    return scene, 1e-3


# phase error over half a period of 40 steps in all: (omega dt)^2 / 12 of EP, of the others less
PHASE = {"ep": 8e-3, "ed": 2e-3, "ep4": 1e-5, "ed3": 1e-4}


@pytest.mark.parametrize(("scheme", "alpha"), MARKED)
def test_pendulum_on_an_arm_has_the_period_of_a_physical_one(scheme, alpha) -> None:
    scene, size = pendulum(scheme, alpha)
    turn = execute(scene).history["turn"].to_numpy() / size
    # forth and back: the largest angle, and zero after half the period
    assert turn[10] == pytest.approx(1.0, abs=PHASE[scheme])
    assert turn[-1] == pytest.approx(0.0, abs=PHASE[scheme])


def test_reduced_and_full_and_rigid_alike() -> None:
    found = {}
    for name, more in {
        "reduced": {},
        "full": {"solver": Solver(solve="full")},
        "rigid": {"body": {"model": "rigid"}},
    }.items():
        scene, size = pendulum("ep", 0.0, **more)
        found[name] = execute(scene).history["turn"].to_numpy() / size
    assert np.allclose(found["full"], found["reduced"], rtol=0, atol=1e-7)
    assert np.allclose(found["rigid"], found["reduced"], rtol=0, atol=1e-3)


RUBBER = Isotropic(E=2e6, nu=0.3, thickness=0.04, density=500.0)


def flap(scheme: str, alpha: float, joints: Any, **more: Any) -> Scene:
    """A soft plate with a weight on a rod that is tied to a lug on its upper face."""
    rod = RigidBody("rod", 0.2, (1e-3, 1e-3, 1e-3), position=(0.6, 0.2, 0.3))
    return Scene(
        "flap",
        Shell("plate", Rectangle(0.6, 0.4), RUBBER, mesh=(2, 1)),
        rigid_bodies=rod,
        joints=joints,
        loads=Gravity((0, 0, -9.81)),
        initial=InitialVelocity(spin=(0.0, 2.0, 0.0), about=(0.0, 0.0, LOWER)),
        scheme=scheme,
        alpha=alpha,
        dt=0.02,
        t_end=0.12,
        **more,
    )


LOWER = -RUBBER.thickness / 2
LUG = Distance("lug", "plate", "rod", at=Offset((0.6, 0.2, 0.0), 0.1), second_at="center")


HELD: dict[str, dict[str, Any]] = {
    "edge": {"supports": Hinged("left", body="plate", offset=LOWER)},
    "pins": {
        "joints": [
            Spherical(f"pin {k}", "plate", at=Offset(corner, LOWER))
            for k, corner in enumerate(("left-bottom", "left-top"))
        ]
    },
}


# pins have the kernels of the chain of all joints
HOW = [
    ("pins", *SCHEMES[0]),
    *(
        pytest.param("edge", *pair, marks=pytest.mark.slow if pair in SLOW else ())
        for pair in SCHEMES
    ),
]


@pytest.mark.parametrize(("held", "scheme", "alpha"), HOW)
def test_flap_on_its_lower_face_keeps_energy_and_momentum(held, scheme, alpha) -> None:
    more = dict(HELD[held])
    probes = [
        Probe(f"{name} {'xyz'[k]}", point, "position", k, body=body)
        for name, point, body in (
            ("lug", Offset((0.6, 0.2, 0.0), 0.1), "plate"),
            ("rod", "center", "rod"),
            ("pin", Offset("left-bottom", LOWER), "plate"),
        )
        for k in range(3)
    ]
    scene = flap(scheme, alpha, [*more.pop("joints", ()), LUG], probes=probes, **more)
    result = execute(scene)
    assert result.summary["energy_balance_error"] < 1e-9
    assert result.summary["linear_momentum_drift"] < 1e-9
    # EP has it exactly, the others to their order, without arms and without supports, too
    assert result.summary["angular_momentum_drift"] < (1e-9 if scheme == "ep" else 2e-3)
    assert result.summary["constraint_max"] < 1e-10
    last = result.history.iloc[-1]
    lug, rod, pin = (np.array([last[f"{n} {c}"] for c in "xyz"]) for n in ("lug", "rod", "pin"))
    # what is held is held, and the link keeps its length though its lug has moved
    assert np.allclose(pin, (0.0, 0.0, LOWER), rtol=0, atol=1e-11)
    assert np.linalg.norm(lug - (0.6, 0.2, 0.1)) > 0.05
    assert np.linalg.norm(lug - rod) == pytest.approx(0.2, rel=1e-10)


def strip(support: Any, **more: Any) -> Scene:
    """A strip that bends in a plane, one metre long and wide, held at both ends."""
    section = Isotropic(E=1e9, nu=0.0, thickness=0.05, shear_correction=1.0)
    return Scene(
        "strip",
        Shell("strip", Rectangle(1.0, 1.0), section, mesh=(4, 1)),
        supports=support,
        loads=SurfaceForce((0, 0, 100.0)),
        probes=[
            Probe("middle", (0.5, 0.0, 0.0)),
            Probe("membrane", (0.5, 0.0, 0.0), "membrane", 0),
        ],
        **more,
    )


def test_strip_on_hinges_at_its_lower_face_is_an_arch() -> None:
    """Hinges at `e = -h/2` hold the rotation of the ends, too: `N = q L^2 / 8 h`, linear by hand.

    `N` at the arm `e` bends by `N e`; the hinge stays where it is if half the elongation and `e`
    times the rotation of the end add up to zero.
    """
    h, q = 0.05, 100.0
    held = Hinged(("left", "right"), offset=-h / 2)
    last = execute(strip(held, scheme="linear-statics")).history.iloc[-1]
    D, shear = 1e9 * h**3 / 12, 0.5e9 * h
    # of four elements
    assert last["middle"] == pytest.approx(q / (192 * D) + q / (8 * shear), rel=5e-3)
    assert last["membrane"] == pytest.approx(q / (8 * h), rel=1e-2)


def test_strip_on_its_lower_face_slides_as_one_on_its_middle() -> None:
    """What holds one direction across an arm along it holds the same; the arm adds no moment."""
    found = []
    for offset in (0.0, -0.025):
        held = [
            SoftSupport(("left", "right"), offset=offset),
            Fixed("left-bottom", (0, 0, None)),
            Fixed("right-bottom", (None, 0, None)),
        ]
        found.append(execute(strip(held, scheme="linear-statics")).history.iloc[-1]["middle"])
    assert found[1] == pytest.approx(found[0], rel=1e-9)


def test_force_at_an_arm_is_a_force_and_a_moment() -> None:
    """To first order: `D x F` times the length of the arm, at a node of a shell."""
    at, arm, F = (1.0, 0.5, 0.0), 0.3, (5.0, -3.0, 2.0)
    couple = (-arm * F[1], arm * F[0], 0.0)
    found = []
    for loads in (PointForce(Offset(at, arm), F), (PointForce(at, F), PointMoment(at, couple))):
        scene = strip(Clamped("left"), scheme="linear-statics")
        found.append(execute(replace(scene, loads=loads)).history.iloc[-1]["middle"])
    assert found[1] == pytest.approx(found[0], rel=1e-9)


def test_spring_between_arms_pulls_at_their_ends() -> None:
    """A cantilever that a spring at its foot and a bracket at its end bends: a moment throughout.

    The spring is in line with the bar, a small way `a` above it: `F a L^2 / 2 EI` at the tip.
    """
    a, stretch = 0.1, 1e-3
    spring = Spring("spring", GROUND, "bar", (0, 0, a), Offset("end", (0, 0, a)), 1e3,
                    length=1.0 - stretch)  # fmt: skip
    scene = Scene(
        "bow", beams=bar(1e9), supports=Clamped("start"), force_elements=spring,
        probes=Probe("tip", "end"),
    )  # fmt: skip
    last = execute(scene).history.iloc[-1]
    EI = 1e9 * WIDTH * HEIGHT**3 / 12
    # the end of the bracket goes back by `a` times the rotation of the tip and eases the spring
    force = 1e3 * stretch / (1 + 1e3 * (a**2 / EI + 1 / (1e9 * WIDTH * HEIGHT)))
    assert last["tip"] == pytest.approx(force * a / (2 * EI), rel=1e-3)


PLATE = Shell("plate", Rectangle(1.0, 1.0), RUBBER, mesh=(2, 2))
ROD = RigidBody("rod", 1.0, (1.0, 1.0, 1.0))
WRONG = {
    "offset point: by is (0, 1); it must be a vector of three finite numbers, or one number": (
        lambda: Offset("a", (0, 1))
    ),
    "spherical joint 'pin': the offset (0.1, 0.0, 0.0) is 0.1 off the director (0, 0, 1) of "
    "'plate', whose nodes know no rotation about it; it must be along the director": lambda: plate(
        joints=Spherical("pin", "plate", at=Offset("left-top", (0.1, 0, 0)))
    ),
    "spherical joint 'pin': the offset is 0.1 and beam 'bar' has no single director; it must be a "
    "vector": lambda: plate(
        beams=bar(), joints=Spherical("pin", "bar", "plate", at=Offset("end", 0.1))
    ),
    "weld 'w': an offset is from a node of a shell or beam and rigid body 'rod' has none; give the "
    "coordinates of the point": lambda: plate(
        rigid_bodies=ROD, joints=Weld("w", "rod", at=Offset("center", (0, 0, 1)))
    ),
    "the ground has no point Offset(": lambda: plate(
        joints=Spherical("pin", GROUND, "plate", at=Offset((0, 0, 0), 0.1))
    ),
    "spherical joint 'pin': shell 'plate' has no point 'tip'": lambda: plate(
        joints=Spherical("pin", "plate", at=Offset("tip", 0.1))
    ),
    "probe 'p': quantity is 'bending' and at an Offset; at must be a node": lambda: plate(
        probes=Probe("p", Offset("left-top", 0.1), "bending", 0)
    ),
    "point force: it has no effect at": lambda: plate(
        loads=PointForce(Offset("left-top", 0.1), (1, 0, 0))
    ),
    "hinged edge 'left': offset is 0.1 and the directors of 'plate' have no inertia": lambda: Scene(
        "s", replace(PLATE, rotary_inertia=False), supports=Hinged("left", offset=0.1),
        scheme="ep", dt=1.0, t_end=1.0,
    ),
    "hinged edge: offset is 'x'; it must be a vector": lambda: Hinged("left", offset="x"),
    "point moment on 'plate': moment is (0.0, 1.0, 0.5), 0.5 of it about the director (0, 0, 1), "
    "about which a shell carries none; it must be across it, (0, 1, 0)": lambda: plate(
        loads=PointMoment("right-top", (0, 1, 0.5))
    ),
    # all of it is: there is no part that would do
    "about which a shell carries none; it must act on a rigid body": lambda: plate(
        loads=PointMoment("right-top", (0, 0, 2.0))
    ),
}  # fmt: skip


def plate(**more: Any) -> Scene:
    return Scene("s", PLATE, supports=Clamped("left", body="plate"), **more)


@pytest.mark.parametrize("message", WRONG)
def test_what_cannot_be_is_refused(message) -> None:
    with pytest.raises(SceneError) as caught:
        scene = WRONG[message]()
        if isinstance(scene, Scene):
            Model(scene, MPI.COMM_WORLD)
    assert message in str(caught.value)
