"""Shaft with an unbalanced disk, driven through its critical speed.

A tube of 6 m with a heavy disk in its middle, which is out of balance by 5 cm, turns in bearings
that hold its ends straight. It is driven up to 0.8 of the critical speed, kept there, and then
through it to 1.2 within a quarter of a second; it is bent by its weight all the while. O. A.
Bauchau et al., Validation of flexible multibody dynamics beam formulations using benchmark
problems, Multibody Syst. Dyn. 37 (2016) 29-48, sec. 3.4. No history of another code is at hand: the
shaft as a beam and as a shell, two tubes with their rims on the disk, are compared with one
another.
"""

# KIND: mechanisms
# CI: shellmb run critical_speed --t-end 1.3 --check --no-pictures
# CI: shellmb run critical_speed --set model=shell --t-end 0.2 --check --no-pictures --out runs/cs

from typing import Any, Literal

import numpy as np

from shellmb.scene import (
    GROUND,
    Beam,
    Cylinder,
    Cylindrical,
    Driver,
    GeneralSection,
    Gravity,
    Isotropic,
    Line,
    Output,
    Probe,
    Revolute,
    RigidBody,
    Scene,
    Shell,
    Weld,
)

LENGTH, INNER, OUTER = 6.0, 0.045, 0.05  # [m]
E, NU, DENSITY = 210e9, 0.3, 7800.0
MASS, INERTIA, OFFSET = 70.573, (2.0325, 1.0163, 1.0163), 0.05  # of the disk [kg], [kg m^2], [m]
CRITICAL = 60.0  # [rad/s]
RATES = (0.8 * CRITICAL, 1.2 * CRITICAL)
TIMES = (0.5, 1.0, 1.25)  # end of the first rise, begin and end of the second [s]
X, Z = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
# axial, twice shear [N]; twist, twice bending [N m^2]; [kg/m], [kg m]
SHAFT = GeneralSection(
    (313.4e6, 60.5e6, 60.5e6, 272.7e3, 354.5e3, 354.5e3),
    mass_per_length=11.64,
    second_moments=(13.17e-3, 0.0, 13.17e-3),
    size=2 * OUTER,
)


def _risen(t: float, duration: float) -> float:
    """Integral of a rise from 0 to 1 as half a cosine, which then stays at 1 [s]."""
    if t <= 0:
        return 0.0
    s = min(t, duration)
    return float((s - duration / np.pi * np.sin(np.pi * s / duration)) / 2 + max(t - duration, 0))


def turned(t: float) -> float:
    """Angle of the driven end [rad]."""
    first, start, end = TIMES
    return RATES[0] * _risen(t, first) + (RATES[1] - RATES[0]) * _risen(t - start, end - start)


def scene(
    model: Literal["beam", "shell"] = "beam",
    elements: int = 8,
    mesh: tuple[int, int] = (8, 12),
    scheme: str = "ep4",
    alpha: float = 0.0,
    dt: float = 2e-3,
    t_end: float = 2.5,
) -> Scene:
    """The shaft along x, its weight along -z.

    Args:
        model: The shaft as a beam or as two tubes.
        elements: Elements of the beam.
        mesh: Elements of each tube around it and along.
        scheme: Time scheme.
        alpha: Its dissipation.
        dt: Time step [s].
        t_end: End of the run [s].
    """
    middle, end = (LENGTH / 2, 0.0, 0.0), (LENGTH, 0.0, 0.0)
    disk = RigidBody("disk", MASS, INERTIA, com=(LENGTH / 2, OFFSET, 0.0))
    parts: dict[str, Any]
    if model == "beam":
        shaft = Beam("shaft", Line((0, 0, 0), end), SHAFT, elements=elements, up=Z)
        parts = {"beams": shaft, "rigid_bodies": disk}
        welds = [Weld("hub", "shaft", "disk", at=middle)]
        first = last = "shaft"
    else:
        section = Isotropic(E, NU, thickness=OUTER - INNER, density=DENSITY)
        tubes = [
            Shell(
                name,
                Cylinder((INNER + OUTER) / 2, LENGTH / 2, origin=(start, 0, 0), axis=X, start=Z),
                section,
                mesh=mesh,
            )
            for name, start in (("near", 0.0), ("far", LENGTH / 2))
        ]
        rims = {"start": (0.0, 0.0, 0.0), "end": end}
        hubs = [RigidBody(name, 0.0, (0.0, 0.0, 0.0), com=at) for name, at in rims.items()]
        parts = {"shells": tubes, "rigid_bodies": [disk, *hubs]}
        welds = [
            Weld("near rim", "start", "near", at=(0, 0, 0), second_at="bottom"),
            Weld("near hub", "disk", "near", at=middle, second_at="top"),
            Weld("far hub", "disk", "far", at=middle, second_at="bottom"),
            Weld("far rim", "end", "far", at=end, second_at="top"),
        ]
        first, last = "start", "end"
    return Scene(
        "critical_speed",
        **parts,
        joints=[
            Revolute("drive end", GROUND, first, at=(0, 0, 0), axis=X),
            Cylindrical("free end", GROUND, last, at=end, axis=X),
            *welds,
        ],
        drivers=Driver("drive", "drive end", rotation=turned),
        loads=Gravity((0, 0, -9.81)),
        probes=[Probe(n, middle, component=k, body="disk") for k, n in ((1, "y"), (2, "z"))],
        scheme=scheme,
        alpha=alpha,
        dt=dt,
        t_end=t_end,
        output=Output(frames=101),
        units="m, kg, s",
    )


# distance of the shaft from its axis at some times, with 12 elements of degree 3 and half the step;
# with the ones here the same to 1e-4 [s], [m]
ORBIT = {0.2: 0.00343, 0.4: 0.03807, 0.5: 0.08869, 1.0: 0.06168, 1.2: 0.1561, 1.3: 0.2556}


def results(run: Any) -> dict[str, float]:
    """Measure how far the middle of the shaft is from its axis at the times of `ORBIT`."""
    history = run.history
    t = history["t"].to_numpy()
    radius = np.hypot(history["y"], history["z"]).to_numpy()
    found = {f"radius_at_{at:g}": float(np.interp(at, t, radius)) for at in ORBIT if at <= t[-1]}
    for name in ("energy_balance_error", "constraint_max"):
        found[name] = run.summary[name]
    return found


def check(results: dict[str, float]) -> None:
    """Beam and shell turn alike, within one percent: half of one that the shell's mesh leaves."""
    assert results["energy_balance_error"] < 1e-9
    assert results["constraint_max"] < 1e-10
    for at, radius in ORBIT.items():
        if (found := results.get(f"radius_at_{at:g}")) is not None:
            assert abs(found / radius - 1) < 1e-2
