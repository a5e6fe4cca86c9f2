"""Static scenes in which something can move freely: the motion is named before any step."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from mpi4py import MPI

import numpy as np
import pytest
import ufl

from shellmb.errors import SceneError
from shellmb.preprocessing.checked_model import checked_model
from shellmb.running.natural_modes.vibration import natural_modes
from shellmb.scene import (
    GROUND,
    Beam,
    Clamped,
    Cylindrical,
    Distance,
    Driver,
    EdgeForce,
    Fixed,
    FollowerForce,
    Gravity,
    Hinged,
    Isotropic,
    Join,
    JointDamper,
    JointSpring,
    Line,
    Lock,
    Motor,
    PointForce,
    Prismatic,
    Rectangle,
    RectangularSection,
    Revolute,
    RigidBody,
    Scene,
    Screw,
    Shell,
    SoftSupport,
    Spherical,
    Spring,
    SymmetryPlane,
    Weld,
)
from shellmb.simulate.simulation import Simulation

SECTION = Isotropic(E=1e5, nu=0.3, thickness=0.05, density=1.0)
PLATE = Shell("plate", Rectangle(1.0, 0.5), SECTION, mesh=(2, 1))
SECOND = Shell("second", Rectangle(1.0, 0.5, origin=(1.0, 0, 0)), SECTION, mesh=(2, 1))
UPRIGHT = replace(SECOND, surface=Rectangle(1.0, 0.5, origin=(1.0, 0, 0), axis1=(0, 0, 1)))
BEAM = Beam(
    "beam",
    Line((0, 0, 0), (1, 0, 0)),
    RectangularSection(E=1e5, nu=0.3, density=1.0, width=0.1, height=0.1),
    elements=2,
)
ROD = RigidBody("rod", mass=1.0, inertia=(1.0, 1.0, 1.0), position=(0.5, 0.0, 0.0))
FURTHER = replace(ROD, name="further", position=(1.5, 0.0, 0.0))
ABOUT_Y: dict[str, Any] = {"at": (0, 0, 0), "axis": (0, 1, 0)}
PIN = Revolute("pin", GROUND, "rod", **ABOUT_Y)
AROUND = EdgeForce("top", (0, 0, 1.0), body="plate")
PUSH = EdgeForce("right", (0, 0, 1.0), body="plate")
WEIGHT = Gravity((0, 0, -9.81))
X, Y, Z = np.eye(3).tolist()


def pendulum(**more: Any) -> dict[str, Any]:
    """A rigid rod on a pin at the ground."""
    return {"rigid_bodies": ROD, "joints": PIN, "loads": WEIGHT} | more


def plate(*supports: Any, **more: Any) -> dict[str, Any]:
    """A plate with a load at its right edge."""
    return {"shells": PLATE, "supports": supports, "loads": PUSH} | more


def slider(joint: type, **more: Any) -> dict[str, Any]:
    """A rigid rod on a joint along x."""
    made = joint("guide", GROUND, "rod", at=(0, 0, 0), axis=X, **more)
    return {"rigid_bodies": ROD, "joints": made, "loads": WEIGHT}


def bed(axes: tuple[int, ...], stiffness: float = 10.0) -> Shell:
    """The plate on an elastic foundation along some axes."""

    def term(point: Any) -> Any:
        return -stiffness * sum(point.u[k] * point.du[k] for k in axes)

    return replace(PLATE, terms=(term,))


def squared(point: Any) -> Any:
    """A foundation whose force is zero with its slope where the plate stands."""
    return -ufl.dot(point.u, point.u) * ufl.dot(point.u, point.du)


FIRST_CLAMPED = Clamped("left", body="plate")
HALF = SymmetryPlane("left", X, body="plate")
JOINED = Join("plate", "second", "right", "left")

# what the scene is, and what the message says of it
FREE: dict[str, tuple[dict[str, Any], str]] = {
    "along a hinged beam": (
        {"beams": BEAM, "supports": Hinged("start"), "loads": PointForce("end", (1.0, 0, 0))},
        "beam 'beam' can turn about x, y and z through (0, 0, 0); add",
    ),
    "oblique to a hinged beam": (
        {"beams": BEAM, "supports": Hinged("start"), "loads": PointForce("end", (1.0, 0, 1.0))},
        "beam 'beam' can turn about x, y and z through (0, 0, 0); add",
    ),
    "a beam on two hinges spins": (
        {"beams": BEAM, "supports": (Hinged("start"), Hinged("end")), "loads": WEIGHT},
        "beam 'beam' can turn about x through (0.5, 0, 0); add",
    ),
    "a plane of symmetry": (
        plate(HALF),
        "shell 'plate' can translate along y and z and turn about x; add",
    ),
    "an oblique plane of symmetry": (
        plate(SymmetryPlane("left", (1, 1, 0))),
        "shell 'plate' can translate along z and (0.7071, -0.7071, 0) and turn about "
        "(0.7071, 0.7071, 0); add",
    ),
    "soft supports": (
        plate(SoftSupport(("left", "right")), loads=AROUND),
        "shell 'plate' can translate along x and y and turn about z; add",
    ),
    "a single point": (
        plate(Fixed("left-bottom", displacement=(0, 0, 0))),
        "shell 'plate' can turn about x, y and z through (0, 0, 0); add",
    ),
    "one component": (
        plate(Fixed("left", displacement=(0, None, 0))),
        "shell 'plate' can translate along y and turn about y; add",
    ),
    "a hinged edge": (
        plate(Hinged("left")),
        "shell 'plate' can turn about y through (0, 0.25, 0); add",
    ),
    "a hinged edge, linear": (
        plate(Hinged("left"), scheme="linear-statics"),
        "shell 'plate' can turn about y through (0, 0.25, 0); add",
    ),
    "a smooth join": (
        plate(HALF, shells=(PLATE, SECOND), joins=JOINED),
        "shell 'plate' can translate along y and z and turn about x; "
        "shell 'second' can translate along y and z and turn about x; add",
    ),
    "a kinked join": (
        plate(Hinged("left", body="plate"), shells=(PLATE, UPRIGHT), joins=JOINED),
        "shell 'plate' can turn about y through (0, 0.25, 0); "
        "shell 'second' can turn about y through (0, 0.25, 0); add",
    ),
    "a pendulum": (pendulum(), "rigid body 'rod' can turn about y through (0, 0, 0); add"),
    "a pendulum that hangs": (
        pendulum(rigid_bodies=replace(ROD, position=(0, 0, -0.5))),
        "rigid body 'rod' can turn about y through (0, 0, 0); add",
    ),
    "a damper": (
        pendulum(force_elements=JointDamper("damper", "pin", damping=1.0)),
        "rigid body 'rod' can turn about y",
    ),
    "a motor of constant torque": (
        pendulum(force_elements=Motor("motor", "pin", law=lambda x, rate, t: 3.0)),
        "rigid body 'rod' can turn about y",
    ),
    "a spring without slope": (
        pendulum(force_elements=JointSpring("spring", "pin", potential=lambda x: 5.0 * x**4)),
        "rigid body 'rod' can turn about y",
    ),
    "a force that turns along": (
        pendulum(loads=FollowerForce((1.0, 0, 0), (0, 0, 5.0), body="rod")),
        "rigid body 'rod' can turn about y",
    ),
    "a lock that is not on yet": (
        pendulum(locks=Lock("pin", active=(0.5, 1.0))),
        "rigid body 'rod' can turn about y",
    ),
    "a joint that does not act yet": (
        pendulum(joints=(PIN, Weld("hold", GROUND, "rod", at=(1, 0, 0), active=(0.5, 1.0)))),
        "rigid body 'rod' can turn about y",
    ),
    "a spring across": (
        pendulum(
            force_elements=Spring("s", GROUND, "rod", (0.5, 1, 0), (0.5, 0, 0), stiffness=9.0)
        ),
        "rigid body 'rod' can turn about y",
    ),
    "a chain": (
        pendulum(
            rigid_bodies=(ROD, FURTHER),
            joints=(PIN, Revolute("second pin", "rod", "further", at=(1, 0, 0), axis=Y)),
        ),
        "rigid body 'rod' can turn about y through (0, 0, 0); "
        "rigid body 'further' can translate along z and turn about y; add",
    ),
    "a prismatic joint": (slider(Prismatic), "rigid body 'rod' can translate along x; add"),
    "a cylindrical joint": (
        slider(Cylindrical),
        "rigid body 'rod' can translate along x and turn about x; add",
    ),
    "a screw": (
        slider(Screw, pitch=np.pi),
        "rigid body 'rod' can turn about x through (0.5, 0, 0) while it moves by 0.5 m per radian",
    ),
    "a rod about a shell's director": (
        plate(
            Clamped("left"),
            rigid_bodies=ROD,
            joints=Weld("weld", "rod", "plate", at=(1.0, 0.5, 0)),
        ),
        "rigid body 'rod' can turn about z through (1, 0.5, 0); add",
    ),
    "a plate on a beam's hinge": (
        {
            "shells": PLATE,
            "beams": replace(BEAM, curve=Line((-1, 0, 0), (0, 0, 0))),
            "supports": Clamped("start", body="beam"),
            "joints": Spherical("ball", "beam", "plate", at="end", second_at=(0, 0, 0)),
            "loads": WEIGHT,
        },
        "shell 'plate' can turn about x, y and z through (0, 0, 0); add",
    ),
    "a foundation along z": (
        plate(shells=bed((2,))),
        "shell 'plate' can translate along x and y and turn about z; add",
    ),
    "a foundation without slope": (
        plate(shells=replace(PLATE, terms=(squared,))),
        "shell 'plate' can move freely; add",
    ),
    "many bodies": (
        pendulum(
            rigid_bodies=[replace(ROD, name=f"rod{k}") for k in range(5)],
            joints=[Revolute(f"pin{k}", GROUND, f"rod{k}", **ABOUT_Y) for k in range(5)],
        ),
        "rigid body 'rod2' can turn about y through (0, 0, 0), and 2 more bodies can move; add",
    ),
}


@pytest.mark.parametrize("case", FREE)
def test_what_nothing_holds_is_named(case: str) -> None:
    options, said = FREE[case]
    with pytest.raises(SceneError) as error:
        checked_model(Scene("s", **options), MPI.COMM_WORLD)
    assert str(error.value).startswith("statics: nothing holds these motions: ")
    assert said in str(error.value)


RODS = [
    # six rods that hold a body as the legs of a Stewart platform do
    Distance(f"leg{k}", GROUND, "rod", at=(*a, -1.0), second_at=(*b, 0.0))
    for k, (a, b) in enumerate(
        [
            ((1.0, 0.0), (0.9, 0.4)),
            ((1.0, 0.2), (0.1, 0.5)),
            ((-0.5, 0.9), (0.1, 0.5)),
            ((-0.5, 0.8), (-0.2, -0.4)),
            ((-0.5, -0.9), (-0.2, -0.4)),
            ((-0.4, -0.9), (0.9, 0.4)),
        ]
    )
]
HELD: dict[str, dict[str, Any]] = {
    "clamped": plate(Clamped("left")),
    "a quarter of a plate": plate(
        HALF, SymmetryPlane("bottom", Y), SoftSupport("right"), loads=AROUND
    ),
    "a beam on two hinges that does not spin": {
        "beams": BEAM,
        "supports": Hinged("start"),
        "joints": Revolute("hinge", GROUND, "beam", at=(1, 0, 0), axis=Y),
        "loads": WEIGHT,
    },
    "a spring": pendulum(force_elements=JointSpring("spring", "pin", stiffness=1e-3)),
    "a spring between points": pendulum(
        force_elements=Spring("s", GROUND, "rod", (0.5, 0, 1), (0.5, 0, 0), stiffness=9.0)
    ),
    "a motor": pendulum(force_elements=Motor("motor", "pin", law=lambda x, rate, t: 3.0 - x)),
    "a driver": pendulum(drivers=Driver("driver", "pin", rotation=lambda t: 0.1 * t)),
    "a lock": pendulum(locks=Lock("pin", active=(0.0, 1.0))),
    "a foundation": plate(shells=bed((0, 1, 2))),
    "a soft foundation": plate(shells=bed((0, 1, 2), 1e-6)),
    "a foundation and a support": plate(HALF, Fixed("left", (None, 0, None)), shells=bed((2,))),
    "six legs": {"rigid_bodies": ROD, "joints": RODS, "loads": WEIGHT},
    "a plate at a clamped one": plate(FIRST_CLAMPED, shells=(PLATE, SECOND), joins=JOINED),
}


@pytest.mark.parametrize("case", HELD)
def test_what_is_held_is_accepted(case: str) -> None:
    checked_model(Scene("s", **HELD[case]), MPI.COMM_WORLD)


def test_in_time_everything_may_move() -> None:
    options = plate(HALF) | {"scheme": "ep", "dt": 0.1, "t_end": 0.1}
    checked_model(Scene("s", **options), MPI.COMM_WORLD)


# loads and the modulus stay as they are while the body grows
@pytest.mark.filterwarnings("ignore:shell 'plate'. edge force causes stresses")
def test_the_size_of_a_scene_does_not_matter() -> None:
    """Nanometres to light seconds: what is free is free, what is held is held."""
    for size in (1e-12, 1e-3, 1e9):
        section = replace(SECTION, thickness=0.05 * size)
        small = replace(PLATE, surface=Rectangle(size, 0.5 * size), section=section)
        checked_model(Scene("s", **plate(Clamped("left"), shells=small)), MPI.COMM_WORLD)
        with pytest.raises(SceneError, match=r"'plate' can turn about y through \(0, "):
            checked_model(Scene("s", **plate(Hinged("left"), shells=small)), MPI.COMM_WORLD)


@pytest.mark.parametrize("size", [1e-9, 1.0, 1e9])
def test_coordinates_are_in_the_unit_of_the_scene(size: float) -> None:
    """Two bodies on a hinge and a slide, and one at the only place that there is."""
    bodies = [
        RigidBody(name, 1.0, (size**2,) * 3, position=(k * size, 0, 0))
        for k, name in enumerate(("arm", "head"))
    ]
    hinge = Revolute("hinge", GROUND, "arm", at=(0, 0, 0), axis=(0, 1, 0))
    slide = Prismatic("slide", "arm", "head", at=(size, 0, 0), axis=X)
    springs = [
        JointSpring("around", "hinge", stiffness=size**2, coordinate="rotation"),
        JointSpring("along", "slide", stiffness=1.0, coordinate="translation"),
    ]
    both: dict[str, Any] = {"rigid_bodies": bodies, "joints": [hinge, slide]}
    checked_model(Scene("s", force_elements=springs, **both), MPI.COMM_WORLD)
    with pytest.raises(SceneError, match="'head' can translate along x; add"):
        checked_model(Scene("s", force_elements=springs[:1], **both), MPI.COMM_WORLD)
    model, _ = checked_model(
        Scene("s", rigid_bodies=bodies[0], scheme="ep", dt=1.0, t_end=1.0), MPI.COMM_WORLD
    )
    # its radius of gyration, of three equal moments
    assert model.length == pytest.approx(size * np.sqrt(1.5))


def test_a_motion_is_refused_before_steps_are_made_ready(monkeypatch: pytest.MonkeyPatch) -> None:
    def read(forms: Any) -> None:
        raise AssertionError("forms of steps were read")

    monkeypatch.setattr("shellmb.system.assembly.blocks.together", read)
    with pytest.raises(SceneError, match="nothing holds"):
        Simulation(Scene("s", **FREE["a plane of symmetry"][0]))


def test_the_tangent_is_singular_along_what_is_named_and_nothing_else() -> None:
    """As many rigid modes as the message names motions, by the eigenvalues of the whole tangent."""
    for case, count in (("soft supports", 3), ("a hinged edge", 1), ("clamped", 0)):
        options = (FREE | HELD)[case]
        options = options[0] if isinstance(options, tuple) else options
        assert natural_modes(Scene("s", **options), count=5).rigid == count


TWO_RANKS = """
from test_mechanisms_static import FREE, MPI, Scene, SceneError, checked_model

for case in ("a kinked join", "a rod about a shell's director", "a foundation along z"):
    options, said = FREE[case]
    try:
        checked_model(Scene("s", **options), MPI.COMM_WORLD)
    except SceneError as error:
        found = MPI.COMM_WORLD.gather(said in str(error))
        print(*(found or []), end=" ")
"""


@pytest.mark.mpi
def test_all_ranks_say_the_same(mpirun) -> None:
    source = f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r})\n{TWO_RANKS}"
    assert mpirun(2, "-c", source).split() == ["True"] * 6
