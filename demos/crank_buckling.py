"""Lateral buckling of a beam that a crank and a link push up, all of them flexible.

A crank, at rest at both ends of half a turn, pushes the tip of a narrow cantilever up through a
link, in the plane in which the beam is stiff. Far beyond the load at which it may buckle, the beam
snaps sideways and swings to and fro. O. A. Bauchau et al., Validation of flexible multibody
dynamics beam formulations using benchmark problems, Multibody Syst. Dyn. 37 (2016) 29-48, sec. 3.3;
a history for comparison is in `demos/references/data/crank_buckling.csv`. Here the cantilever is a
beam, as there, or a shell.
"""

# KIND: mechanisms
# CI: shellmb run crank_buckling --t-end 0.19 --set aside=1e-8 --check --no-pictures
# CI: shellmb run crank_buckling --t-end 0.19 --set model=shell --check --no-pictures --out runs/cb

from typing import Any, Literal

import numpy as np

from shellmb.demos.references import tables
from shellmb.scene import (
    GROUND,
    Beam,
    Clamped,
    Driver,
    GeneralSection,
    Isotropic,
    Line,
    Offset,
    Output,
    Probe,
    Rectangle,
    Revolute,
    Scene,
    Shell,
    Spherical,
)

LENGTH, HEIGHT, THICKNESS = 1.0, 0.1, 0.01  # of the cantilever [m]
LINK, CRANK = 0.25, 0.05  # [m]
E, NU, DENSITY = 73e9, 0.3, 2680.0
TURN = 0.4  # time of half a turn of the crank [s]
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
# axial, shear across and along the height [N]; twist, bending in the plane and across it [N m^2]
CANTILEVER = GeneralSection(
    (73e6, 5.025e6, 23.40e6, 877.2, 60830.0, 608.3),
    mass_per_length=2.68,
    second_moments=(22.33e-6, 0.0, 2233e-6),
)


def _bar(axial: float, shear: float, twist: float, bending: float, mass: float, moment: float):
    stiffness = (axial, shear, shear, twist, bending, bending)
    return GeneralSection(stiffness, mass, second_moments=(moment / 2, 0.0, moment / 2))


LINK_SECTION = _bar(33.02e6, 10.81e6, 914.5, 1189.0, 1.212, 43.65e-6)
CRANK_SECTION = _bar(132.1e6, 43.22e6, 14630.0, 19020.0, 4.85, 698.3e-6)


def angle(t: float) -> float:
    """Angle of the crank [rad]."""
    return float(np.pi * (1 - np.cos(np.pi * min(t, TURN) / TURN)) / 2)


def scene(
    model: Literal["beam", "shell"] = "beam",
    aside: float = 1e-4,
    elements: int = 8,
    mesh: tuple[int, int] = (12, 2),
    scheme: str = "ed3",
    alpha: float = 0.5,
    dt: float = 1e-3,
    t_end: float = 2 * TURN,
) -> Scene:
    """The mechanism: the cantilever along x, its height along z, the link below its tip.

    Args:
        model: The cantilever as a beam or a shell.
        aside: How far the plane of crank and link is off that of the cantilever [m].
        elements: Elements of the cantilever as a beam.
        mesh: Its elements as a shell.
        scheme: Time scheme.
        alpha: Its dissipation.
        dt: Time step [s].
        t_end: End of the run [s].
    """
    tip, top = (LENGTH, 0.0, 0.0), (LENGTH, aside, 0.0)
    pin, bearing = (LENGTH, aside, -LINK), (LENGTH - CRANK, aside, -LINK)
    body: Any
    if model == "beam":
        body = {"supports": Clamped("start", body="cantilever")}
        own = [Beam("cantilever", Line((0, 0, 0), tip), CANTILEVER, elements, up=Z)]
        middle: Any = (LENGTH / 2, 0.0, 0.0)
    else:
        plane = Rectangle(LENGTH, HEIGHT, origin=(0, 0, -HEIGHT / 2), axis2=Z)
        section = Isotropic(E, NU, thickness=THICKNESS, density=DENSITY)
        body = {
            "shells": Shell("cantilever", plane, section, mesh=mesh),
            "supports": Clamped("left", body="cantilever"),
        }
        own, middle = [], (LENGTH / 2, 0.0, 0.0)
    place: Any = tip
    if aside:
        place = Offset(tip, (0.0, aside, 0.0))
    return Scene(
        "crank_buckling",
        **body,
        beams=[
            *own,
            Beam("link", Line(pin, top), LINK_SECTION, elements=2, up=Y),
            Beam("crank", Line(bearing, pin), CRANK_SECTION, elements=1, up=Y),
        ],
        joints=[
            Revolute("bearing", GROUND, "crank", at=bearing, axis=Y),
            Revolute("pin", "crank", "link", at=pin, axis=Y),
            Spherical("tip", "cantilever", "link", at=place, second_at=top),
        ],
        # about -y: the crank's end goes up first
        drivers=Driver("drive", "bearing", rotation=lambda t: -angle(t)),
        probes=[Probe(n, middle, component=k, body="cantilever") for k, n in ((1, "y"), (2, "z"))],
        scheme=scheme,
        alpha=alpha,
        dt=dt,
        t_end=t_end,
        output=Output(frames=81),
        units="m, kg, s",
    )


def results(run: Any) -> dict[str, float]:
    """Measure when the cantilever snaps and how far it swings first, here and in another code."""
    history = run.history
    t, y, z = (history[c].to_numpy() for c in ("t", "y", "z"))
    stored = tables.read("crank_buckling")
    before = stored[stored["t_s"] <= 0.1]
    apart = np.interp(before["t_s"], t, z) - before["z"]
    found = {
        "z_apart": float(np.abs(apart).max() / before["z"].max()),
        "snap": snap(t, y),
        "swing": float(np.abs(y[t <= SWUNG]).max()),
        "snap_of_other": snap(stored["t_s"].to_numpy(), stored["y"].to_numpy()),
        "swing_of_other": float(stored["y"].abs().max()),
    }
    (tip,) = (joint for joint in run.scene.joints if joint.name == "tip")
    found["aside"] = float(tip.second_at[1])
    found["shell"] = float(bool(run.scene.shells))
    for name in ("energy_balance_error", "constraint_max"):
        found[name] = run.summary[name]
    return found


# sideways displacement that counts as snapped [m], and time by which the first swing is over [s]
SNAPPED, SWUNG = 1e-3, 0.19


def snap(t: np.ndarray, y: np.ndarray) -> float:
    """Time at which the middle has gone sideways by `SNAPPED`, s; NaN if it has not."""
    gone = np.flatnonzero(np.abs(y) > SNAPPED)
    if not len(gone):
        return float("nan")
    k = gone[0]
    return float(np.interp(SNAPPED, np.abs(y[k - 1 : k + 1]), t[k - 1 : k + 1]))


def check(results: dict[str, float]) -> None:
    """Compare with the other code; with its offset the same snap, within a millisecond.

    A shell, which cannot warp and contract at its clamped edge, is stiffer and snaps 3 ms later.
    """
    assert results["z_apart"] < 0.01
    assert results["energy_balance_error"] < 1e-9
    assert results["constraint_max"] < 1e-10
    if np.isclose(results["aside"], 1e-8):
        later = results["snap"] - results["snap_of_other"]
        assert 0 < later < 5e-3 if results["shell"] else abs(later) < 1e-3
        assert abs(results["swing"] / results["swing_of_other"] - 1) < 0.05
    else:
        # the larger the offset, the earlier
        assert 0.11 < results["snap"] < results["snap_of_other"]
