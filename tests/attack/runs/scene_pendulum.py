"""A pendulum of one rigid body: its kernels are the fastest to compile."""

from shellmb.scene import Gravity, Output, Probe, Revolute, RigidBody, Scene, Sine

PULL = 9.81


def swell(t):
    """How the weight grows; what it reads of the module counts."""
    return 1.0 + PULL * t


def scene(mass: float = 2.0, steps: int = 4, own: bool = True):
    arm = RigidBody("arm", mass, (0.01, 0.2, 0.2), com=(0.5, 0, 0))
    return Scene(
        "pendulum",
        rigid_bodies=arm,
        joints=Revolute("pin", "ground", "arm", at=(0, 0, 0), axis=(0, 1, 0)),
        loads=Gravity((0, 0, -PULL), time=swell if own else Sine(1.0)),
        probes=Probe("tip", "origin", component=2, body="arm"),
        scheme="ep",
        dt=1e-3,
        t_end=steps * 1e-3,
        output=Output(frames=steps + 1),
    )


def results(run):
    return {"steps": float(len(run.history) - 1)}


def check(results):
    assert results["steps"] == 4, "it takes four steps"
