"""A string is tightened, pulled aside and released: statics first, then a motion from its state.

The first run is static: the string is stretched until it has the tension for its tone, then a force
pulls its middle aside. The second run starts from that state without the force. Prestress stays, so
the string swings with the frequency `sqrt(N/m)/(2 L)` of a string, and after a period its middle is
where it was released. The file is no scene, because it runs two of them: run it by

    python -m shellmb.demos.plucked_string
"""

# CI: python -m shellmb.demos.plucked_string

import tempfile
from pathlib import Path

import numpy as np

import shellmb as sm

LENGTH, RADIUS, E, DENSITY = 0.65, 2.5e-4, 3e9, 1140.0  # nylon [m], [Pa], [kg/m^3]
FREQUENCY = 110.0  # [Hz]
STRESS = DENSITY * (2 * LENGTH * FREQUENCY) ** 2
AREA = np.pi * RADIUS**2
PULLED = STRESS / E * LENGTH  # displacement of the end [m]
ASIDE = 2e-3  # displacement of the middle [m]
FORCE = 4 * STRESS * AREA * ASIDE / LENGTH
MIDDLE = (LENGTH / 2, 0.0, 0.0)


def string(pull, **more):
    """The string, its end moved by `pull`."""
    return sm.Scene(
        "string",
        beams=sm.Beam(
            "string",
            sm.Line((0, 0, 0), (LENGTH, 0, 0)),
            sm.CircularSection(E=E, nu=0.3, radius=RADIUS, density=DENSITY),
            elements=16,
        ),
        # ends that bend freely; the first one holds the twist
        joints=sm.Universal(
            "nut", "ground", "string", at=(0, 0, 0), axis=(0, 1, 0), second_axis=(0, 0, 1)
        ),
        supports=sm.Fixed("end", displacement=(pull, 0, 0)),
        probes=sm.Probe("middle", MIDDLE, component=2),
        units="m, kg, s",
        **more,
    )


def tightened(out):
    """The static run: until t = 1 the end is pulled, then the middle is."""
    aside = sm.PointForce(MIDDLE, (0, 0, FORCE), time=lambda t: max(t - 1.0, 0.0))
    scene = string(lambda t: PULLED * min(t, 1.0), loads=aside, scheme="static", dt=0.25, t_end=2.0)
    return sm.run(scene, out, pictures=False)


def released(run, out, scheme="ep4", steps=80):
    """The motion over one period, from the end of the static run."""
    period = 1 / FREQUENCY
    scene = string(PULLED, start=sm.FromRun(run), scheme=scheme, dt=period / steps, t_end=period)
    return sm.run(scene, out, pictures=False)


def main():
    """Run both, and compare with the string's equation."""
    with tempfile.TemporaryDirectory() as folder:
        still = tightened(Path(folder) / "tightened")
        motion = released(still, Path(folder) / "released")
        z, energy = motion.history["middle"].to_numpy(), motion.history["total_energy"].to_numpy()
        half = len(z) // 2
        print(f"pulled aside by {1e3 * z[0]:.4f} mm; expected {1e3 * ASIDE:.4f} mm")
        print(f"after half a period {1e3 * z[half]:.4f} mm, after a period {1e3 * z[-1]:.4f} mm")
        print(f"energy {energy[0]:.6g} J, changed by {np.ptp(energy) / energy[0]:.1e} of it")
        # the string is stretched by 1e-3 of its tension as it is pulled aside, and bends a little
        assert abs(z[0] / ASIDE - 1) < 0.02
        assert z[0] == still.history["middle"].iloc[-1]
        assert abs(z[half] / z[0] + 1) < 0.05
        assert abs(z[-1] / z[0] - 1) < 0.05
        assert np.ptp(energy) < 1e-9 * energy[0]


if __name__ == "__main__":
    main()
