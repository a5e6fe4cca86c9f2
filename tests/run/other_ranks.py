"""Runs a scene to its middle, or goes on with it: `all` or `small`, `begin` or `end`, a folder.

In `all` are quadrilaterals of degree 3 and triangles (bubbles, Nedelec's shear forces), a beam, a
linear and a rigid body, joints, a motor with a controller, a stop, contact, an event that locks a
hinge. In `faces` plates slide on each other when the run stops.
"""

import sys
from dataclasses import replace
from pathlib import Path

from mpi4py import MPI

import scene_small

import shellmb as sm
from shellmb.errors import ConvergenceError
from shellmb.running.execute import execute
from shellmb.running.resume import resume
from shellmb.scene.control.sensors import Sensor
from shellmb.simulate.simulation import BaseObserver, Simulation

sys.path.append(str(Path(__file__).parents[2]))
from tests.contact.faces_ranks import sliding

STEPS = 12


def small() -> sm.Scene:
    """A strip and a spring that relax: their branches are beside the state."""
    scene = scene_small.scene(steps=6, sides=(4, 1))
    fading = sm.Prony(((0.3, 2e-3), (0.2, 0.1)))
    section = sm.Isotropic(E=210e9, nu=0.25, thickness=2e-3, density=7870.0, relaxation=fading)
    shell = replace(scene.shells[0], section=section)
    given = {"stiffness": 50.0, "length": 0.3, "relaxation": fading}
    cord = sm.Spring("cord", sm.GROUND, shell.name, (0, 0, 0.5), "right-top", **given)
    return replace(scene, shells=shell, force_elements=cord)


def everything() -> sm.Scene:
    """The event comes in the second half."""
    soft = sm.Isotropic(2e8, 0.3, thickness=0.01, density=1000.0)
    bar = sm.RectangularSection(2e8, 0.3, width=0.02, height=0.02, density=1000.0)
    quads = sm.Shell("quads", sm.Rectangle(1.0, 0.4), soft, mesh=(3, 2), degree=3)
    tris = sm.Shell("tris", sm.Cylinder(0.5, 1.0, (0, 60)), soft, mesh=(2, 3), cell="tri")
    slow = sm.Shell(
        "slow", sm.Rectangle(0.5, 0.4, origin=(0, 2, 0)), soft, mesh=(2, 2), model="floating-frame"
    )
    beam = sm.Beam("beam", sm.Line((1, 0.4, 0), (2, 0.4, 0)), bar, elements=5)
    ball = sm.RigidBody("ball", 0.5, (0.01, 0.02, 0.03), position=(2, 0.4, 0))
    joints = [
        sm.Revolute("hinge", sm.GROUND, "beam", at=(1, 0.4, 0), axis=(0, 1, 0)),
        sm.Spherical("end", "beam", "ball", at=(2, 0.4, 0)),
        sm.Spherical("corner", sm.GROUND, "slow", at=(0, 2, 0)),
    ]
    motor = sm.Motor("motor", "hinge", command=sm.Command("pid"))
    pid = sm.PID("pid", Sensor("hinge.rotation"), -0.01, 2.0, 5.0, 0.1, period=8e-3)
    ground = sm.Plane((0, 0, -0.02))
    return sm.Scene(
        "ranks",
        [quads, tris, slow],
        beams=beam,
        rigid_bodies=ball,
        joints=joints,
        force_elements=[motor, sm.JointStop("stop", "hinge", upper=0.02, stiffness=50.0)],
        controllers=pid,
        events=sm.Event("down", Sensor("tip") <= -0.03),
        locks=sm.Lock("hinge", when=Sensor("low") <= -0.02),
        contacts=sm.Contact("ground", ground, 1e4, "ball", at=(2, 0.4, 0), relative_damping=0.1),
        supports=[sm.Clamped("left", body="quads"), sm.Clamped("bottom", body="tris")],
        loads=[sm.Gravity(), sm.SurfaceForce((300.0, 0, 100.0), body="tris")],
        probes=[
            sm.Probe("tip", (1, 0.4, 0), component=2, body="quads"),
            sm.Probe("low", (2, 0.4, 0), component=2, body="beam"),
            sm.Probe("top", "left-top", component=0, body="tris"),
            sm.Probe("turned", (2, 0.4, 0), "rotation", component=1, body="ball"),
        ],
        scheme="ed",
        dt=8e-3,
        t_end=STEPS * 8e-3,
        output=sm.Output(frames=5, fields=("N", "Q")),
    )


class Stops(BaseObserver):
    """Ends a run as a step that fails."""

    def accepted(self, simulation: Simulation) -> None:
        if simulation.t > 0.45 * float(simulation.scene.t_end or 0.0):
            raise ConvergenceError("in the middle")


SCENES = {"all": everything, "small": small, "faces": lambda: sliding("ep")}

if __name__ == "__main__":
    name, what, out = sys.argv[1], sys.argv[2], Path(sys.argv[3])
    scene = SCENES[name]()
    if what == "begin":
        try:
            execute(scene, out, [Stops()], pictures=False)
        except ConvergenceError:
            sys.exit(0)
    run = resume(out, scene=scene, pictures=False)
    if MPI.COMM_WORLD.rank == 0:
        print(run.summary["ranks"])
