"""Free decay of a struck cantilever plate: the damping of its modes against theory.

Kelvin and Voigt's damping of the section (a time) and damping in proportion to the mass (a rate)
make each mode decay by `(rate + time w^2)/2`: high ones by the strains, low ones by the mass. A
pulse at the tip excites several; frequencies and decays are taken from what the tip does then
(matrix pencil), and the account says where the energy went.
"""

# KIND: vibrations and motion
# CI: shellmb run damped_plate --check --t-end 0.25

import numpy as np

from shellmb.scene import (
    Clamped,
    EdgeForce,
    Isotropic,
    Output,
    Probe,
    Rectangle,
    Scene,
    Shell,
    Table,
)

LENGTH, WIDTH, THICKNESS = 0.4, 0.05, 2e-3  # [m]
YOUNG, DENSITY = 210e9, 7850.0
PULSE = 4e-3  # [s]
# of a cantilever, squared they are w L^2 sqrt(m/(E I))
ROOTS = (1.875104, 4.694091)
# modes that the tip's motion is taken apart into
TAKEN = 4


def scene(
    time: float = 2e-4, rate: float = 2.6, force: float = 2.0, dt: float = 1e-3, t_end: float = 0.4
):
    """The plate.

    Args:
        time: Damping time of the section [s].
        rate: Damping in proportion to the mass [1/s].
        force: Largest force of the pulse [N].
        dt: Time step [s].
        t_end: End [s].
    """
    steel = Isotropic(
        YOUNG, 0.0, thickness=THICKNESS, density=DENSITY, stiffness_damping=time, mass_damping=rate
    )
    pulse = Table((0.0, PULSE / 2, PULSE), (0.0, 1.0, 0.0))
    return Scene(
        "damped_plate",
        Shell("plate", Rectangle(LENGTH, WIDTH), steel, mesh=(6, 1)),
        supports=Clamped("left"),
        loads=EdgeForce("right", (0, 0, force / WIDTH), time=pulse),
        probes=Probe("tip", (LENGTH, 0, 0), component=2),
        scheme="ep4",
        dt=dt,
        t_end=t_end,
        output=Output(frames=41),
        units="m, kg, s",
    )


def results(run):
    """Frequencies and decays of the first modes, measured and by theory, and the account."""
    history, section = run.history, run.scene.shells[0].section
    free = history["t"].to_numpy() > PULSE * (1 + 1e-9)
    t, tip = history["t"].to_numpy()[free], history["tip"].to_numpy()[free]
    poles = pencil(tip, t[1] - t[0])
    speed = np.sqrt(YOUNG / DENSITY) * THICKNESS / np.sqrt(12) / LENGTH**2
    found = {"energy_balance_error": run.summary["energy_balance_error"]}
    for number, root in enumerate(ROOTS, start=1):
        omega = root**2 * speed
        decay = (section.mass_damping + section.damping_times[1] * omega**2) / 2
        pole = poles[np.argmin(np.abs(poles - (1j * omega - decay)))]
        found[f"frequency_{number}"] = float(pole.imag / (2 * np.pi))
        found[f"frequency_{number}_theory"] = float(np.sqrt(omega**2 - decay**2) / (2 * np.pi))
        found[f"decay_{number}"] = float(-pole.real)
        found[f"decay_{number}_theory"] = float(decay)
    energy, work = history["total_energy"].to_numpy()[free], history["work_terms"].to_numpy()[free]
    found["taken_by_damping"] = float((work[0] - work[-1]) / energy[0])
    found["largest_damping_power"] = float(np.max(np.diff(work)))
    return found


def pencil(values, dt):
    """Exponents of a sum of damped vibrations, complex, 1/s.

    Y. Hua, T. K. Sarkar, IEEE Trans. Acoust. Speech Signal Process. 38 (1990) 814-824.
    """
    n = len(values)
    rows = np.lib.stride_tricks.sliding_window_view(values, n // 2 + 1)
    kept = np.linalg.svd(rows, full_matrices=False)[2][: 2 * TAKEN]
    shifted = np.linalg.lstsq(kept[:, :-1].T, kept[:, 1:].T, rcond=None)[0]
    roots = np.linalg.eigvals(shifted)
    return np.log(roots.astype(complex)) / dt


def check(results):
    """A strip bends as a beam; the mesh and shear leave a few parts in a thousand."""
    assert results["energy_balance_error"] < 1e-9
    for number in (1, 2):
        for what, near in (("frequency", 3e-3), ("decay", 1e-2)):
            found, exact = results[f"{what}_{number}"], results[f"{what}_{number}_theory"]
            assert abs(found / exact - 1) < near
    assert results["largest_damping_power"] < 0
    assert 0.5 < results["taken_by_damping"] < 1
