"""Scene functions whose parameters are of every kind, small enough for many whole runs."""

import math

import numpy as np

import shellmb as sm
from shellmb.options.run import Options

# schemes in which sections may be damped
DAMPED = ("ep", "ed", "ep4", "ed3")
STATIC = ("static", "linear-statics")
STEEL = {"E": 210e9, "nu": 0.3, "density": 7800.0}
Z = (0.0, 0.0, 1.0)


def plate(
    scheme="ep",
    alpha=None,
    thickness=4e-3,
    E=210e9,
    density=7800.0,
    length=1.0,
    force=400.0,
    frequency=20.0,
    speed=2.0,
    damping=2e-4,
    dt=2e-3,
    steps=4,
):
    """A clamped strip in large motion: material, size, load, time function, initial velocity."""
    damped = sm.ShellDamping(bending=damping) if scheme in DAMPED else None
    more = {} if damped is None else {"stiffness_damping": damped}
    steel = sm.Isotropic(E, 0.3, thickness=thickness, density=density, **more)
    strip = sm.Shell("strip", sm.Rectangle(length, 0.2), steel, mesh=(3, 1))
    load = sm.EdgeForce("right", (0, 0, force), time=lambda t: 1 + math.sin(frequency * t))
    motion = {} if scheme in STATIC else {"initial": sm.InitialVelocity((0, 0, speed))}
    chosen = {} if alpha is None else {"alpha": alpha}
    return sm.Scene(
        "plate",
        strip,
        supports=sm.Clamped("left"),
        loads=load,
        probes=(
            sm.Probe("tip", (length, 0.1, 0), component=2),
            sm.Probe("moment", (length / 3, 0.1, 0), quantity="bending", component=0),
        ),
        scheme=scheme,
        dt=dt,
        t_end=steps * dt,
        **motion,
        **chosen,
    )


def vault(scheme="ep", radius=1.0, thickness=0.01, force=2e3, gravity=9.81, dt=2e-3, steps=3):
    """A curved panel from equilibrium: the directors of the reference depend on the radius."""
    panel = sm.Shell(
        "panel",
        sm.Cylinder(radius, 0.5, angles=(0, 60)),
        sm.Isotropic(1e9, 0.3, thickness=thickness, density=1000.0),
        mesh=(3, 1),
    )
    return sm.Scene(
        "vault",
        panel,
        supports=sm.Clamped("left"),
        loads=(
            sm.Gravity((0, 0, -gravity)),
            sm.EdgeForce("right", (force, 0, 0), time=lambda t: 1 + 200 * t),
        ),
        probes=[sm.Probe(f"corner_{k}", "right-top", component=k) for k in (0, 2)],
        scheme=scheme,
        dt=dt,
        t_end=steps * dt,
        **({} if scheme in STATIC else {"start": "equilibrium"}),
    )


def mechanism(
    scheme="ep",
    alpha=None,
    stiffness=40.0,
    viscosity=0.3,
    cord=2e3,
    mass=0.5,
    arm=1.0,
    rate=3.0,
    radius=0.01,
    dt=5e-3,
    steps=4,
):
    """A driven rigid crank, a beam on a hinge with spring and damper, a cord to the ground."""
    section = sm.CircularSection(radius=radius, **STEEL)
    beam = sm.Beam("beam", sm.Line((arm, 0, 0), (arm + 1.0, 0, 0)), section, elements=2)
    crank = sm.RigidBody("crank", mass, (0.1, 0.1, 0.1), position=(arm / 2, 0, 0))
    chosen = {} if alpha is None else {"alpha": alpha}
    ends = (arm, 1.0, 0), (arm + 1.0, 0, 0)
    return sm.Scene(
        "mechanism",
        beams=beam,
        rigid_bodies=crank,
        joints=(
            sm.Revolute("pivot", sm.GROUND, "crank", at=(0, 0, 0), axis=Z),
            sm.Revolute("hinge", "crank", "beam", at=(arm, 0, 0), axis=Z),
        ),
        drivers=sm.Driver("motor", "pivot", rotation=lambda t: rate * t + t * t),
        force_elements=(
            sm.JointSpring("spring", "hinge", stiffness=stiffness, rest=0.2),
            sm.JointDamper("damper", "hinge", damping=viscosity),
            sm.Spring("cord", sm.GROUND, "beam", *ends, stiffness=cord, length=1.0),
        ),
        loads=sm.Gravity((0, -9.81, 0)),
        probes=sm.Probe("end", (arm + 1.0, 0, 0), body="beam", component=1),
        scheme=scheme,
        dt=dt,
        t_end=steps * dt,
        **chosen,
    )


def skid(stiffness=2e5, friction=0.3, speed=2.0, dt=1e-3, steps=30):
    """A ball that strikes the ground and slides on it."""
    return sm.Scene(
        "skid",
        rigid_bodies=sm.RigidBody("ball", 1.0, (0.1, 0.1, 0.1), position=(0, 0, 0.02)),
        contacts=sm.Contact(
            "ground",
            sm.Plane(normal=Z),
            stiffness=stiffness,
            body="ball",
            at="center",
            friction=friction,
            slip_speed=0.05,
            smoothing=1e-3,
        ),
        initial=sm.InitialVelocity((0.5, 0, -speed)),
        loads=sm.Gravity((0, 0, -9.81)),
        probes=sm.Probe("x", "center", body="ball", component=0),
        scheme="ep",
        dt=dt,
        t_end=steps * dt,
    )


OBSTACLES = {
    "plane": lambda p: sm.Plane((p, 0, 0), (-1, 0, 0)),
    "ball": lambda p: sm.Ball((p + 1, 0.1, 0), 1.005),
    "hollow": lambda p: sm.Ball((p - 1, 0.1, 0), 1.005, inside=True),
    "rod": lambda p: sm.Rod((p + 1, 0.1, 0), Z, 1.005),
    "tube": lambda p: sm.Rod((p - 1, 0.05, 0), Z, 1.005, inside=True),
    "box": lambda p: sm.Box((p + 0.5, 0.1, 0), (1, 1, 1), (1, 0.2, 0), (-0.2, 1, 0), 0.05),
}


def knock(kind="plane", scheme="ep4", place=0.1, stiffness=1e4, dt=0.01, steps=20, **more):
    """A ball on a spring that meets an obstacle for a few steps."""
    bodies = [sm.RigidBody("ball", 1.0, (0.02, 0.02, 0.02))]
    if "obstacle_body" in more:
        at = (place + 0.5, 0, 0)
        bodies.append(sm.RigidBody("wall", 3.0, (0.02, 0.03, 0.025), position=at))
    return sm.Scene(
        "knock",
        rigid_bodies=bodies,
        force_elements=sm.Spring(
            "spring", sm.GROUND, "ball", (-1, 0, 0), (0, 0, 0), stiffness=30.0, length=1.0
        ),
        contacts=sm.Contact(
            "touch",
            OBSTACLES[kind](place),
            stiffness=stiffness,
            body="ball",
            radius=0.01,
            **{"smoothing": 1e-3} | more,
        ),
        initial=sm.InitialVelocity((1.0, 0.3, 0.1), (0, 0, 5.0), body="ball"),
        probes=[sm.Probe(f"x{k}", "center", component=k, body="ball") for k in range(3)],
        scheme=scheme,
        dt=dt,
        t_end=steps * dt,
    )


def stopped(turns=True, scheme="ep4", limit=0.1, stiffness=1e4, dt=0.01, steps=20, **more):
    """A body on a joint with a spring that meets a stop for a few steps."""
    joint = sm.Revolute if turns else sm.Prismatic
    moves = {"spin": (0, 0, 1.0)} if turns else {"velocity": (0, 0, 1.0)}
    given = {"smoothing": 1e-3} | more
    return sm.Scene(
        "stopped",
        rigid_bodies=sm.RigidBody("body", 1.0, (0.5, 0.5, 1.0)),
        joints=joint("joint", sm.GROUND, "body", at=(0, 0, 0), axis=Z),
        force_elements=(
            sm.JointSpring("spring", "joint", stiffness=30.0),
            sm.JointStop("stop", "joint", upper=limit, stiffness=stiffness, **given),
        ),
        initial=sm.InitialVelocity(**moves),
        probes=sm.Probe("x", (0, 1.0, 0), component=0 if turns else 2, body="body"),
        scheme=scheme,
        dt=dt,
        t_end=steps * dt,
    )


def carried(stiffness=2e4, friction=0.3, speed=3.0, height=0.02, scheme="ep", dt=1e-3, steps=30):
    """A ball that strikes a box on a body that turns, which it moves."""
    ball = sm.RigidBody("ball", 2.0, (8e-3, 8e-3, 8e-3), position=(0.02, 0.01, 0.13))
    carrier = sm.RigidBody("carrier", 3.0, (0.02, 0.03, 0.025), position=(0, 0, -0.1))
    return sm.Scene(
        "carried",
        rigid_bodies=(ball, carrier),
        contacts=sm.Contact(
            "touch",
            sm.Box((0, 0, height - 0.05), (0.3, 0.3, 0.1), rounding=0.01),
            stiffness=stiffness,
            body="ball",
            radius=0.1,
            friction=friction,
            slip_speed=0.05,
            smoothing=1e-3,
            obstacle_body="carrier",
        ),
        initial=(
            sm.InitialVelocity((0.5, 0.3, -speed), (0, 0, 5.0), body="ball"),
            sm.InitialVelocity(spin=(1.0, -2.0, 3.0), body="carrier"),
        ),
        scheme=scheme,
        dt=dt,
        t_end=steps * dt,
    )


def controlled(gain=120.0, integral=200.0, mass=1.0, target=0.8, dt=5e-3, steps=8):
    """A rigid arm that a sampled PID controller lifts, every other step."""
    arm = sm.RigidBody(
        "arm", mass, (0.01, 0.1, 0.1), position=(0.5, 0, 0), points={"tip": (1, 0, 0)}
    )
    return sm.Scene(
        "controlled",
        rigid_bodies=arm,
        joints=sm.Revolute("shoulder", sm.GROUND, "arm", at=(0, 0, 0), axis=(0, -1, 0)),
        force_elements=sm.Motor("motor", "shoulder", command=sm.Command("pid")),
        controllers=sm.PID(
            "pid", sm.Sensor("shoulder.rotation"), target, gain, integral, 25.0, period=2 * dt
        ),
        loads=sm.Gravity((0, 0, -9.81)),
        probes=sm.Probe("tip", "tip", body="arm", component=2),
        scheme="ep4",
        dt=dt,
        t_end=steps * dt,
    )


def heated(
    scheme="ep", strain=1e-3, curvature=0.3, thickness=4e-3, E=210e9, length=1.0, dt=2e-3, steps=4
):
    """A clamped strip and a rod whose strains without stress grow."""

    def grows(t):
        return t / (dt * steps)

    strip = sm.Shell(
        "strip",
        sm.Rectangle(length, 0.2),
        sm.Isotropic(E, 0.3, thickness=thickness, density=7800.0),
        mesh=(3, 1),
        natural=sm.NaturalStrain((strain, strain, 0), (curvature, 0, 0), time=grows),
    )
    rod = sm.Beam(
        "rod",
        sm.Line((0, 1, 0), (length, 1, 0)),
        sm.CircularSection(radius=0.01, **STEEL),
        elements=2,
        natural=sm.BeamNaturalStrain(strain, (0.1, curvature, 0)),
    )
    return sm.Scene(
        "heated",
        strip,
        beams=rod,
        supports=(sm.Clamped("left", body="strip"), sm.Clamped("start", body="rod")),
        probes=(
            sm.Probe("tip", (length, 0.1, 0), body="strip", component=2),
            sm.Probe("end", (length, 1, 0), body="rod", component=2),
        ),
        scheme=scheme,
        dt=dt,
        t_end=steps * dt,
    )


def balloon(
    scheme="ep",
    pressure=5.0,
    exponent=1.4,
    ambient=1.0,
    swelling=1.0,
    thickness=0.02,
    radius=1.0,
    fluid=False,
    dt=0.02,
    steps=3,
):
    """An eighth of a sphere, blown up by a gas or by a fluid that is pumped in."""
    skin = sm.Isotropic(1e3, 0.3, thickness=thickness, density=1.0)
    octant = sm.Sphere(radius, polar=(0, 90), azimuth=(0, 90))
    filling = (
        {"change": lambda t: swelling * t}
        if fluid
        else {"gas": sm.Gas(pressure, exponent, ambient)}
    )
    planes = (("left", (0, 1, 0)), ("right", (1, 0, 0)), ("top", Z))
    return sm.Scene(
        "balloon",
        sm.Shell("ball", octant, skin, mesh=(2, 2)),
        supports=[sm.SymmetryPlane(*plane) for plane in planes],
        volumes=sm.EnclosedVolume("inside", **filling),
        probes=(
            sm.Probe("pole", "pole", component=2),
            sm.Probe("rim", "left-top", component=0),
        ),
        scheme=scheme,
        dt=dt,
        t_end=steps * dt,
    )


def panels(
    scheme="ep",
    stiffness=5.0,
    viscosity=0.02,
    thickness=2e-3,
    width=0.3,
    force=60.0,
    rigid=False,
    dt=2e-3,
    steps=4,
):
    """Two panels on a hinge of edges with spring and damper."""
    skin = sm.Isotropic(70e9, 0.3, thickness=thickness, density=2700.0)
    first, second = (
        sm.Shell(name, sm.Rectangle(0.4, width, origin=(x, 0, 0)), skin, mesh=(2, 2))
        for name, x in (("first", 0.0), ("second", 0.4))
    )
    return sm.Scene(
        "panels",
        (first, second),
        joints=sm.EdgeHinge(
            "hinge", "first", "second", at="right", second_at="left", rigid_angle=rigid
        ),
        force_elements=(
            sm.JointSpring("spring", "hinge", stiffness=stiffness, rest=0.5),
            sm.JointDamper("damper", "hinge", damping=viscosity),
        ),
        supports=sm.Clamped("left", body="first"),
        loads=sm.EdgeForce("right", (0, 0, force), body="second"),
        probes=sm.Probe("tip", (0.8, width, 0), body="second", component=2),
        scheme=scheme,
        dt=dt,
        t_end=steps * dt,
    )


def meeting(
    scheme="ep",
    stiffness=1e8,
    thickness=5e-3,
    E=70e9,
    speed=0.5,
    shift=0.017,
    friction=0.0,
    dt=1e-4,
    steps=10,
):
    """Two free plates, one of which turns, that strike each other."""
    section = sm.Isotropic(E, 0.3, thickness=thickness, density=2700.0)
    low, high = (
        sm.Shell(name, sm.Rectangle(0.2, 0.2, origin=origin), section, mesh=(2, 2))
        for name, origin in (("low", (0, 0, 0)), ("high", (shift, 0.024, 2.6e-3)))
    )
    return sm.Scene(
        "meeting",
        (low, high),
        contacts=sm.Contact(
            "touch",
            sm.Faces("low", 5e-3),
            stiffness,
            body="high",
            smoothing=2e-5,
            friction=friction,
            slip_speed=0.1 if friction else None,
        ),
        initial=(
            sm.InitialVelocity((0, 0, speed / 2), body="low"),
            sm.InitialVelocity((0, 0, -speed / 2), (1, 2, -1), body="high"),
        ),
        probes=sm.Probe("corner", "right-top", body="high", component=2),
        scheme=scheme,
        dt=dt,
        t_end=steps * dt,
    )


def fading(scheme="ep", g=0.3, tau=4e-3, angle=25.0, stiffness=300.0, length=0.1, force=3.0):
    """A laminate whose plies relax, on a spring that does so from the start on."""
    series = sm.Prony([(g, tau), (0.1, 0.02)])
    shear = {name: 0.7e9 for name in ("G12", "G13", "G23")}
    ply = sm.PlyMaterial(8e9, 2e9, nu12=0.3, density=1200.0, relaxation=series, **shear)
    plies = sm.Laminate((sm.Ply(ply, 2e-3, angle), sm.Ply(ply, 2e-3, -50.0)))
    return sm.Scene(
        "fading",
        sm.Shell("strip", sm.Rectangle(0.6, 0.1), plies, mesh=(2, 1), direction=(1, 0, 0)),
        supports=sm.Clamped("left"),
        force_elements=sm.Spring(
            "cord",
            sm.GROUND,
            "strip",
            (0.6, 0, 0.12),
            (0.6, 0, 0),
            stiffness,
            length=length,
            relaxation=sm.Prony([(g, tau)], relaxed=False),
        ),
        loads=sm.EdgeForce("right", (0.0, 0, force)),
        probes=[sm.Probe(f"u{k}", "right-top", body="strip", component=k) for k in (0, 2)],
        scheme=scheme,
        dt=3e-3,
        t_end=0.012,
    )


def plucked(
    scheme="ep",
    amplitude=0.02,
    velocity=0.5,
    shape=0.01,
    thickness=4e-3,
    length=1.0,
    dt=2e-3,
    steps=4,
):
    """A strip that starts from a given shape and, beside it, its first mode."""
    strip = sm.Shell(
        "strip",
        sm.Rectangle(length, 0.2),
        sm.Isotropic(210e9, 0.3, thickness=thickness, density=7800.0),
        mesh=(3, 1),
    )

    def bent(x):
        return np.array([0 * x[0], 0 * x[0], shape * x[0] ** 2])

    return sm.Scene(
        "plucked",
        strip,
        supports=sm.Clamped("left"),
        start=(sm.FromShape(bent), sm.FromMode(1, amplitude, velocity)),
        probes=sm.Probe("tip", (length, 0.1, 0), component=2),
        scheme=scheme,
        dt=dt,
        t_end=steps * dt,
    )


def modal_plate(scheme="ep", thickness=4e-3, E=210e9, length=1.0, force=100.0, frequency=20.0):
    """The strip in four modes about its support."""
    made = plate(scheme, None, thickness, E, length=length, force=force, frequency=frequency)
    return Options(model="modal:4").apply(made)


def modal_mechanism(scheme="ep", stiffness=40.0, mass=0.5, arm=1.0, rate=3.0, radius=0.01):
    """The mechanism with its beam in modes, of which a round section makes two of each."""
    given = {"stiffness": stiffness, "mass": mass, "arm": arm, "rate": rate, "radius": radius}
    return Options(model="modal:4").apply(mechanism(scheme, **given))
