"""Derivatives know no units: of gears, belts and own bodies, forwards and backwards.

Kind: a size that is hidden in a difference, a tolerance or a scale. Relative derivatives are
numbers without units; a scene in mm and t has those of the same in m and kg.
"""

from typing import Any

from mpi4py import MPI

import numpy as np
import pytest
import ufl
from dolfinx import fem, mesh

import shellmb as sm

# a rack hardly feels how stiff a strip is: such derivatives have the digits of the states
TIGHT: dict[str, Any] = {"newton": "full", "newton_tolerance": 1e-13}
# a metre and a kilogram in the units of a scene: m and kg; mm and t
UNITS = [(1.0, 1.0), (1e3, 1e-3)]
QUIET = [pytest.param(s, marks=pytest.mark.slow) for s in ("ed", "ed3", "ep4")]
Z = (0.0, 0.0, 1.0)


def train(units: Any, scheme: str, inertia=0.2, ratio=-0.4, radius=0.3, torque=0.4, E=7e9) -> Any:
    """A motor, gears, a crossed belt and a rack; the last wheel carries a strip."""
    m, kg = units
    moments = {"a": inertia, "b": 0.5, "c": 0.3}
    wheels = [
        sm.RigidBody(name, kg, (kg * m**2 * each,) * 3, position=(0.5 * m * k, 0.1 * m, 0.0))
        for k, (name, each) in enumerate(moments.items())
    ]
    rack = sm.RigidBody("rack", 2 * kg, (0.1 * kg * m**2,) * 3, position=(0.0, m, 0.0))
    joints = [sm.Revolute(f"on_{w.name}", sm.GROUND, w.name, axis=Z, at=w.position) for w in wheels]
    start = (1.2 * m, -0.1 * m, 0.0)
    return sm.Scene(
        "train",
        sm.Shell(
            "strip",
            sm.Rectangle(0.4 * m, 0.2 * m, origin=start),
            sm.Isotropic(E * kg / m, 0.3, thickness=4e-3 * m, density=2e3 * kg / m**3),
            mesh=(2, 1),
        ),
        rigid_bodies=[*wheels, rack],
        joints=[
            *joints,
            sm.Prismatic("slide", sm.GROUND, "rack", at=(0.0, m, 0.0), axis=(1, 0, 0)),
            sm.Weld("mount", "c", "strip", at=wheels[2].position, second_at="left"),
        ],
        couplings=[
            sm.Gear("gear", "on_a", "on_b", ratio=ratio),
            sm.Belt("belt", "on_b", "on_c", radii=(radius * m, 0.2 * m), crossed=True),
            sm.Gear("pinion", "on_c", "slide", ratio=0.15 * m),
        ],
        force_elements=sm.Motor("motor", "on_a", lambda a, rate, t: torque * kg * m**2 + 0 * a),
        loads=sm.Gravity((0, 0, -9.81 * m)),
        probes=[
            sm.Probe("rack", "center", body="rack", component=0),
            sm.Probe("tip", "right-top", body="strip", component=2),
        ],
        scheme=scheme,
        alpha=1.0 if scheme in ("ed", "ed3") else None,
        dt=0.02,
        t_end=0.06,
    )


def block(units: Any, scheme: str, stiffness=4e5, density=1e3, width=0.25, push=50.0) -> Any:
    """A solid of a user's own that is clamped, weighed and pushed."""
    m, kg = units

    def space(comm: MPI.Comm) -> Any:
        corners = [np.zeros(3), np.array([m, width * m, 0.25 * m])]
        return fem.functionspace(
            mesh.create_box(comm, corners, [2, 1, 1], mesh.CellType.hexahedron),
            ("Lagrange", 1, (3,)),
        )

    def green(u: Any) -> Any:
        G = (ufl.grad(u) + ufl.grad(u).T + ufl.grad(u).T * ufl.grad(u)) / 2
        return ufl.as_vector([G[0, 0], G[1, 1], G[2, 2], 2 * G[0, 1], 2 * G[0, 2], 2 * G[1, 2]])

    C = np.diag([1, 1, 1, 0.5, 0.5, 0.5]) + np.pad(np.ones((3, 3)), (0, 3))
    body = sm.OwnBody(
        "block",
        space,
        strain=green,
        energy=stiffness * kg / m * C,
        mass=lambda v, w: density * kg / m**3 * ufl.dot(v, w),
        points={"tip": (m, width * m, 0.25 * m)},
        regions={"left": lambda x: np.isclose(x[0], 0.0, atol=1e-6 * m)},
    )
    moving = scheme != "static"
    return sm.Scene(
        "solid",
        own_bodies=body,
        supports=sm.Clamped("left", body="block"),
        loads=[
            sm.Gravity((0.0, 0.0, -9.81 * m)),
            sm.PointForce("tip", (0, push * kg * m, 0), body="block"),
        ],
        probes=[
            sm.Probe("side", "tip", body="block", component=1),
            sm.Probe("tip", "tip", body="block", component=2),
        ],
        scheme=scheme,
        alpha=1.0 if scheme in ("ed", "ed3") else None,
        dt=5e-3 if moving else None,
        t_end=0.015 if moving else None,
    )


CASES = {
    train: {"inertia": 0.2, "ratio": -0.4, "radius": 0.3, "torque": 0.4, "E": 7e9},
    block: {"stiffness": 4e5, "density": 1e3, "width": 0.25, "push": 50.0},
}


@pytest.mark.parametrize("make", CASES)
@pytest.mark.parametrize("scheme", ["ep", *QUIET])
def test_relative_derivatives_are_the_same(make: Any, scheme: str) -> None:
    values = CASES[make]
    found = []
    for units in UNITS:

        def scene(units: Any = units, **given: float) -> sm.Scene:
            return make(units, scheme, **given)

        names = tuple(values)
        made = _with(scene, values)
        forth = sm.sensitivities(made, names, columns="probes", **TIGHT)
        probes = [probe.name for probe in made().probes]

        def number(history: Any, probes: Any = probes, units: Any = units) -> float:
            return float(sum(np.sum((history[name] / units[0]) ** 2) for name in probes))

        back = sm.adjoint(made, number, parameters=names, **TIGHT)
        columns = [forth.history[name][probe] / units[0] for name in names for probe in probes]
        run = [forth.run.history[probe] / units[0] for probe in probes]
        found.append((columns, run, [back.parameters[name] for name in names]))
        # and both ways are the same
        for k, name in enumerate(names):
            pairs = zip(run, columns[len(probes) * k :], strict=False)
            wanted = sum(2 * float(x.to_numpy() @ dx.to_numpy()) for x, dx in pairs)
            assert back.parameters[name] == pytest.approx(wanted, rel=1e-6), name
    (columns, run, back), other = found
    for one, its in zip([*columns, *run], [*other[0], *other[1]], strict=True):
        size = np.abs(one).max()
        assert size
        np.testing.assert_allclose(its.to_numpy(), one.to_numpy(), atol=1e-6 * size)
    np.testing.assert_allclose(other[2], back, rtol=1e-6)


def _with(scene: Any, values: dict[str, float]) -> Any:
    """A scene function with parameters that have names and defaults."""
    names = ", ".join(f"{name}={value!r}" for name, value in values.items())
    given = ", ".join(f"{name}={name}" for name in values)
    return eval(f"lambda {names}: scene({given})", {"scene": scene})
