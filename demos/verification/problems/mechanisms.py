"""Rigid bodies and joints: tops, pendulums, a driven slider-crank, and orders of accuracy."""

import math
from collections.abc import Iterator

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats
from shellmb.demos import heavy_top, slider_crank
from shellmb.demos.references.rigid import free_top
from shellmb.demos.verification.cases import Check, case
from shellmb.demos.verification.chains import Link, chain
from shellmb.demos.verification.motion import ENERGY, LARGE, QUADRATIC, SCHEMES, order, title
from shellmb.running.execute import execute
from shellmb.scene import (
    GROUND,
    Gravity,
    InitialVelocity,
    Joint,
    RigidBody,
    Scene,
    Spherical,
    Universal,
)
from shellmb.simulate.simulation import BaseObserver, Simulation

CONSTRAINT, SOLVER = 1e-10, 1e-10

# a body near the unstable rotation about its middle axis: it turns over
TOP, SPIN = (1.0, 2.0, 3.0), (0.05, 2.0, 0.1)
LINKS = (Link.rod(1.0, 1.0), Link.rod(0.5, 0.8))
ANGLES = (1.5, 2.2)


class RigidPath(BaseObserver):
    """Positions and axes of a rigid body after every step, the start included.

    Args:
        body: Its name.

    Attributes:
        time: Instants, s.
        positions: Its centre of mass at each, shape (3,), m.
        axes: Its axes d1, d2, d3 at each, as columns, shape (3, 3).
    """

    def __init__(self, body: str) -> None:
        self.body = body
        self.time: list[float] = []
        self.positions: list[Floats] = []
        self.axes: list[Floats] = []

    def start(self, simulation: Simulation) -> None:
        """Take the start."""
        self.accepted(simulation)

    def accepted(self, simulation: Simulation) -> None:
        """Take the new state."""
        rigid = simulation.model.rigid
        assert rigid is not None
        described = rigid.bodies[rigid.index[self.body]]
        q = simulation.problem.levels[rigid.name].q.x.array
        here = np.zeros(12)
        owned = rigid.node_mesh.mesh.topology.index_map(1).size_local
        if np.any(rigid.node_mesh.item[:owned] == rigid.index[self.body]):
            here[:3] = described.center + q[rigid.local(self.body, "u")]
            here[3:] = described.axes.T.ravel() + q[rigid.local(self.body, "w")]
        simulation.model.comm.Allreduce(MPI.IN_PLACE, here)
        self.time.append(simulation.t)
        self.positions.append(here[:3])
        self.axes.append(here[3:].reshape(3, 3).T)


def path_of(scene: Scene, body: str) -> RigidPath:
    """Motion of a rigid body of a scene, run to its end."""
    path = RigidPath(body)
    Simulation(scene).run([path])
    return path


def free_body(scheme: str, alpha: float, steps: int, t_end: float = 12.0) -> Scene:
    """A free body that tumbles."""
    return Scene(
        "free_top",
        rigid_bodies=(RigidBody("top", mass=1.0, inertia=TOP),),
        initial=(InitialVelocity(spin=SPIN),),
        scheme=scheme,
        alpha=alpha,
        dt=t_end / steps,
        t_end=t_end,
    )


def double_pendulum(scheme: str, alpha: float, steps: int, t_end: float = 1.0) -> Scene:
    """Two rods that fall in the x-y plane, the lower one over the top."""
    bodies: list[RigidBody] = []
    joints: list[Joint] = []
    x, y = 0.0, 0.0
    for name, above, link, angle in zip("ab", (GROUND, "a"), LINKS, ANGLES, strict=True):
        right, up = math.sin(angle), -math.cos(angle)
        bodies.append(
            RigidBody(
                name,
                mass=link.mass,
                inertia=(link.inertia, 1e-4 * link.inertia, link.inertia),
                position=(x + link.center * right, y + link.center * up, 0.0),
                rotation=(0.0, 0.0, angle),
            )
        )
        at = (x, y, 0.0)
        # nothing holds the rods in the plane: they have no reason to leave it
        if name == "a":
            joints.append(Spherical("top", above, name, at=at))
        else:
            across = (right, up, 0.0)
            joints.append(
                Universal("middle", above, name, at=at, axis=(0, 0, 1), second_axis=across)
            )
        x, y = x + link.length * right, y + link.length * up
    return Scene(
        "double_pendulum",
        rigid_bodies=tuple(bodies),
        joints=tuple(joints),
        loads=(Gravity((0.0, -9.81, 0.0)),),
        scheme=scheme,
        alpha=alpha,
        dt=t_end / steps,
        t_end=t_end,
    )


def pendulum_centers(time: Floats) -> Floats:
    """Exact centres of mass of the double pendulum, shape (n, 2, 2), m."""
    return chain(LINKS, ANGLES, (0.0, 0.0), time).centers()


@case("mechanisms/heavy top")
def heavy_tops() -> Iterator[Check]:
    """Centre of mass against the equations of motion, and the stored history."""
    for scheme, alpha in SCHEMES:
        scene = heavy_top.scene(dt=5e-4, t_end=0.1).with_options(scheme=scheme, alpha=alpha)
        run = execute(scene, results=heavy_top.results)
        found, name = run.results, f"{title(scheme, alpha)}, dt=5e-4 s"
        source = "equations of motion in quaternions by scipy's DOP853, 1e-13"
        yield Check(f"{name}, error of the centre [m]", found["error"], 0.0, source, 1e-4)
        yield Check(
            f"{name}, distance from the stored history to 0.04 s [m]",
            found["error_against_history"],
            0.0,
            "mb_sef_py, whose own error is 5.4e-3 m there",
            heavy_top.HISTORY_ERROR,
        )
        energy = found["energy_balance_error"]
        yield Check(f"{name}, energy balance error", energy, 0.0, "eqs. (20), (33)", ENERGY)
        constraint = found["constraint_max"]
        yield Check(f"{name}, constraint violation", constraint, 0.0, "none", CONSTRAINT)


@case("mechanisms/free top")
def free_tops() -> Iterator[Check]:
    """Axes of a free body that turns over, against Jacobi's elliptic functions."""
    for scheme, alpha in (("ep", 0.0), ("ed", 1.0), *QUADRATIC):
        path = path_of(free_body(scheme, alpha, 600), "top")
        exact = free_top(TOP, SPIN, path.time).rotation
        yield Check(
            f"{title(scheme, alpha)}, 600 steps in 12 s, error of the axes",
            float(np.abs(np.array(path.axes) - exact).max()),
            0.0,
            "angular velocity by elliptic functions, integrated to 1e-11",
            # second order at 0.04 rad per step, ten times that by the unstable axis
            5e-3,
        )


@case("mechanisms/double pendulum")
def double_pendulums() -> Iterator[Check]:
    """Centres of mass against the equations of motion in angles."""
    for scheme, alpha in (("ep", 0.0), ("ed", 1.0), *QUADRATIC):
        path = path_of(double_pendulum(scheme, alpha, 400), "b")
        exact = pendulum_centers(np.array(path.time))[:, 1]
        yield Check(
            f"{title(scheme, alpha)}, 400 steps in 1 s, error of the lower centre [m]",
            float(np.abs(np.array(path.positions)[:, :2] - exact).max()),
            0.0,
            "Lagrange's equations by scipy's DOP853, 1e-13",
            1e-3,
        )


@case("mechanisms/slider-crank")
def slider_cranks() -> Iterator[Check]:
    """Driven crank: exact positions, the torque of the rigid motion, deflection of a coupler."""
    for flexible, schemes in ((False, ("ep", "ed", "ep4", "ed3")), (True, ("ep",))):
        for scheme in schemes:
            scene = slider_crank.scene(flexible=flexible, t_end=0.2).with_options(scheme=scheme)
            found = execute(scene, results=slider_crank.results).results
            name = f"{title(scheme, 1.0)}, {'flexible' if flexible else 'rigid'} coupler"
            if flexible:
                yield Check(
                    f"{name}, deflection relative to the largest",
                    found["deflection_error"],
                    0.0,
                    "simply supported beam under the inertia of the rigid motion",
                    0.1,
                )
            else:
                error = found["slider_error"]
                yield Check(f"{name}, slider [m]", error, 0.0, "exact kinematics", SOLVER)
                yield Check(
                    f"{name}, torque relative to the largest",
                    found["torque_error"],
                    0.0,
                    "exact; mean over a step",
                    2e-2 if scheme == "ep" else 2e-3,
                )
            energy = found["energy_balance_error"]
            yield Check(f"{name}, energy balance error", energy, 0.0, "eqs. (20), (33)", ENERGY)


@case("mechanisms/order")
def orders() -> Iterator[Check]:
    """Second order in large rotations, as of shells (`dynamics/order`); 4 and 3 in EP4 and ED3."""
    for scheme, alpha in SCHEMES:

        def top(n: int, scheme: str = scheme, alpha: float = alpha) -> float:
            scene = heavy_top.scene(dt=0.05 / n, t_end=0.05)
            path = path_of(scene.with_options(scheme=scheme, alpha=alpha), "top")
            return float(np.abs(path.positions[-1] - heavy_top.exact([0.0, 0.05])[-1]).max())

        def fall(n: int, scheme: str = scheme, alpha: float = alpha) -> float:
            path = path_of(double_pendulum(scheme, alpha, n, 0.5), "b")
            exact = pendulum_centers(np.array([0.0, 0.5]))[-1, 1]
            return float(np.abs(path.positions[-1][:2] - exact).max())

        for name, error, counts in (
            ("heavy top", top, (40, 60, 90)),
            ("double pendulum", fall, (20, 30, 45)),
        ):
            yield Check(
                f"{name}, {title(scheme, alpha)}, by regression",
                order(error, counts),
                float(LARGE[scheme]),
                "theory; reference by scipy",
                0.2,
                "at least",
            )
