"""A wing box of four joined shells, bent and twisted at its tip: beam theory and Bredt's formulae.

Two skins and two spars are joined along their edges and clamped at the root, corners included. The
tip carries the shear flow that beam theory has for a vertical force, and that of Bredt for a
torque. Small displacements superpose: bending is what both spars have in common, twist what they
have not. Root and tip disturb the walls over about their width: rates are taken between stations.
"""

# KIND: statics and paths
# CI: shellmb run wing_box --check
# CI: shellmb run wing_box --set nu=0 --check --no-pictures --out runs/ci-wing-no-contraction

import numpy as np

from shellmb.scene import (
    Clamped,
    EdgeForce,
    Isotropic,
    Join,
    Output,
    Probe,
    Rectangle,
    Scene,
    Shell,
)

SPAN, CHORD, HEIGHT = 4.0, 0.6, 0.2  # [m]
SKIN, SPAR = 2e-3, 3e-3  # [m]
E = 70e9  # [Pa]
FORCE, TORQUE = 1000.0, 500.0  # upwards [N], about the x axis [N m]

# second moment of area of the walls [m^4]
INERTIA = 2 * CHORD * SKIN * (HEIGHT / 2) ** 2 + 2 * SPAR * HEIGHT**3 / 12
# stations between which rates are taken [m]
STATIONS = (SPAN / 2, 3 * SPAN / 4)


def flow_in_skin(y):
    """Shear flow of the force in the upper skin along +y, at a distance from its middle [N/m]."""
    return -FORCE / INERTIA * SKIN * y * HEIGHT / 2


def flow_in_spar(z):
    """Shear flow of the force in a spar along +z, at a height over its middle [N/m]."""
    of_skin = SKIN * CHORD / 2 * HEIGHT / 2
    return FORCE / INERTIA * (of_skin + SPAR * ((HEIGHT / 2) ** 2 - z**2) / 2)


def shear_area():
    """The energy of the force's flow over all walls is `F^2 / (2 G A)`; A [m^2]."""
    y = np.linspace(-CHORD / 2, CHORD / 2, 2001)
    z = np.linspace(-HEIGHT / 2, HEIGHT / 2, 2001)
    # of two skins and two spars, times G
    energy = np.trapezoid(flow_in_skin(y) ** 2, y) / SKIN
    energy += np.trapezoid(flow_in_spar(z) ** 2, z) / SPAR
    return FORCE**2 / (2 * energy)


def scene(nu: float = 0.3, nx: int = 16, ny: int = 4, nz: int = 4):
    """The box.

    Args:
        nu: Poisson's ratio.
        nx: Elements along the span.
        ny: Across the skins.
        nz: Across the spars.
    """
    skin, spar = (
        Isotropic(E, nu, thickness=SKIN, density=2700.0),
        Isotropic(E, nu, thickness=SPAR, density=2700.0),
    )
    low = (0.0, -CHORD / 2, -HEIGHT / 2)
    up, aft = (0.0, -CHORD / 2, HEIGHT / 2), (0.0, CHORD / 2, -HEIGHT / 2)
    shells = [
        Shell("lower", Rectangle(SPAN, CHORD, low), skin, mesh=(nx, ny)),
        Shell("upper", Rectangle(SPAN, CHORD, up), skin, mesh=(nx, ny)),
        Shell("front", Rectangle(SPAN, HEIGHT, low, axis2=(0, 0, 1)), spar, mesh=(nx, nz)),
        Shell("rear", Rectangle(SPAN, HEIGHT, aft, axis2=(0, 0, 1)), spar, mesh=(nx, nz)),
    ]
    joins = [
        Join("lower", "front", "bottom", "bottom"),
        Join("lower", "rear", "top", "bottom"),
        Join("upper", "front", "bottom", "top"),
        Join("upper", "rear", "top", "top"),
    ]
    # Bredt: the same all around
    around = TORQUE / (2 * CHORD * HEIGHT)

    def along(axis, flow):
        return lambda x: np.outer(np.eye(3)[axis], flow(x))

    tip = {
        "lower": along(1, lambda x: around - flow_in_skin(x[1])),
        "upper": along(1, lambda x: -around + flow_in_skin(x[1])),
        "front": along(2, lambda x: -around + flow_in_spar(x[2])),
        "rear": along(2, lambda x: around + flow_in_spar(x[2])),
    }
    half, stations = CHORD / 2, (*STATIONS, SPAN)
    # of each wall the middle, and the axis along which it goes as the box twists
    middles = {"front": (-half, 0.0, 2), "rear": (half, 0.0, 2)}
    middles |= {"lower": (0.0, -HEIGHT / 2, 1), "upper": (0.0, HEIGHT / 2, 1)}
    probes = [
        Probe(f"{name}_{k}", (x, y, z), component=axis, body=name)
        for name, (y, z, axis) in middles.items()
        for k, x in enumerate(stations)
    ]
    probes.append(Probe("flow", (SPAN / 2, half, 0.0), "membrane", 2, body="rear"))
    return Scene(
        "wing_box",
        shells,
        joins=joins,
        supports=[Clamped("left", body=s.name) for s in shells],
        loads=[EdgeForce("right", flow, body=name) for name, flow in tip.items()],
        probes=probes,
        scheme="linear-statics",
        output=Output(fields=("N", "energy_density")),
        units="m, kg, s",
    )


def results(run):
    """Deflection of the tip, rate of twist and shear flow over those of beam theory and Bredt."""
    last = run.history.iloc[-1]
    front, rear, lower, upper = (
        np.array([last[f"{name}_{k}"] for k in range(3)])
        for name in ("front", "rear", "lower", "upper")
    )
    nu = run.scene.shell("lower").section.nu
    shear_modulus = E / (2 * (1 + nu))
    deflection = (front[-1] + rear[-1]) / 2
    bent = FORCE * SPAN**3 / (3 * E * INERTIA)
    sheared = FORCE * SPAN / (shear_modulus * shear_area())
    # without ribs the section becomes a lozenge: what the flow works on is the mean of both angles
    angles = (rear - front) / CHORD, (lower - upper) / HEIGHT
    twist = (angles[0] + angles[1]) / 2
    rate = (twist[1] - twist[0]) / (STATIONS[1] - STATIONS[0])
    around = 2 * (CHORD / SKIN + HEIGHT / SPAR)
    bredt = TORQUE * around / (4 * (CHORD * HEIGHT) ** 2 * shear_modulus)
    flow = flow_in_spar(0.0) + TORQUE / (2 * CHORD * HEIGHT)
    return {
        "nu": nu,
        "deflection": float(deflection),
        "deflection_over_beam": float(deflection / (bent + sheared)),
        "sheared_share": float(sheared / (bent + sheared)),
        "twist_rate": float(rate),
        "twist_over_bredt": float(rate / bredt),
        "flow_over_theory": float(last["flow"] / flow),
    }


def check(results):
    """Beam theory and Bredt, but for what the clamped root does.

    It keeps the skins from contracting, which makes the box stiffer where they would, and the
    section from warping, which fades over several chords. Spars of 4 elements have the parabola of
    the flow to 0.6 %.
    """
    assert abs(results["deflection_over_beam"] - 1) < (1e-2 if results["nu"] else 1e-3)
    assert abs(results["twist_over_bredt"] - 1) < 4e-3
    assert abs(results["flow_over_theory"] - 1) < 1e-2
