"""Hinged cylindrical roof under a point load at its middle: snap-through and snap-back.

The load grows to a limit point, falls, below zero for the thinner roofs, and grows again; the
thinner ones go back in displacement, too, and one of them loops. Equilibria are followed by arc
length. Problem 3.8 of Sze, Liu and Lo, Finite Elem. Anal. Des. 40 (2004) 1551-1569, whose curves
(ABAQUS S4R elements) the check compares with, point by point.

A quarter is modelled between two planes of symmetry, as there. It does not see paths without
symmetry: the whole thin roof (`--set whole=True`) has a bifurcation before its limit point.

`python -m shellmb.demos.hinged_roof` draws all six.
"""

# KIND: statics and paths
# CI: shellmb run hinged_roof --mesh 6x6 --check
# CI: shellmb run hinged_roof --set thickness=6.35 --set plies=90/0/90 --check --out r4
# CI: shellmb run hinged_roof --set thickness=6.35 --set plies=0/90/0 --check --no-pictures --out r5
# CI: shellmb run hinged_roof --set thickness=6.35 --set whole=True --check --no-pictures --out r7
# CI: mpiexec -n 2 shellmb run hinged_roof --mesh 4x4 --set thickness=6.35 --check --no-pictures

import math
from pathlib import Path
from typing import Any, Literal

import numpy as np
from scipy.interpolate import CubicSpline

from shellmb.scene import (
    Cylinder,
    Hinged,
    Isotropic,
    Laminate,
    LinearSection,
    PathFollowing,
    PlyMaterial,
    PointForce,
    Probe,
    Scene,
    Shell,
    Support,
    SymmetryPlane,
)

Plies = Literal["isotropic", "0/90/0", "90/0/90"]

# mm, N, N/mm^2; the table's loads are fractions of the largest one
RADIUS, HALF_LENGTH, HALF_ANGLE, FORCE = 2540.0, 254.0, 0.1, 3000.0
ISOTROPIC = {"E": 3102.75, "nu": 0.3}
PLY = PlyMaterial(E1=3300.0, E2=1100.0, nu12=0.25, G12=660.0, G13=660.0, G23=660.0)
MIDDLE = (0.0, 0.0, RADIUS)

# our limit loads from the tabulated ones, which lie on the curve but not at its very extremes
LIMIT_TOLERANCE = 0.02
# distance of a tabulated point from our curve, relative to the ranges of load and displacement: the
# scatter of S4R on a 16x16 mesh (docs/reference/literature.md: 0.5 to 2 %)
CURVE_TOLERANCE = 0.01
# a path ends at its last load to the tolerance of Newton's method
ENDED = 1e-9


def section(thickness: float, plies: Plies) -> LinearSection:
    """The section: isotropic, or three equal plies, 0 degrees being along the axis of the roof.

    Args:
        thickness: Thickness [mm].
        plies: The stacking.
    """
    if plies == "isotropic":
        return Isotropic(thickness=thickness, **ISOTROPIC)
    # the shell's own 1-direction is the hoop; along the axis the curves agree with the tables,
    # along the hoop they are those of the other stacking
    angles = [float(angle) + 90.0 for angle in plies.split("/")]
    return Laminate.from_stacking(PLY, thickness / len(angles), angles)


def scene(
    thickness: float = 12.7,
    plies: Plies = "isotropic",
    load_end: float = 1.0,
    branches: Literal["ignore", "detect", "switch"] = "detect",
    whole: bool = False,
) -> Scene:
    """The roof, or a quarter of it: straight edges hinged, curved edges free.

    Args:
        thickness: Thickness, 12.7 or 6.35 for the tables [mm].
        plies: Isotropic, or the stacking of the laminate.
        load_end: Load factor at which the path ends.
        branches: What to do at bifurcations.
        whole: Whether all of the roof is modelled.
    """
    angle = math.degrees(HALF_ANGLE)
    supports: tuple[Support, ...]
    if whole:
        first, length, angles, parts = -HALF_LENGTH, 2 * HALF_LENGTH, (-angle, angle), 1
        supports = (Hinged(("left", "right")),)
    else:
        first, length, angles, parts = 0.0, HALF_LENGTH, (0.0, angle), 4
        left, bottom = SymmetryPlane("left", (1, 0, 0)), SymmetryPlane("bottom", (0, 1, 0))
        supports = (Hinged("right"), left, bottom)
    surface = Cylinder(
        RADIUS, length, angles=angles, origin=(0.0, first, 0.0), axis=(0, 1, 0), start=(0, 0, 1)
    )
    return Scene(
        "hinged_roof",
        Shell("roof", surface, section(thickness, plies), mesh=(8, 8)),
        supports=supports,
        loads=PointForce(MIDDLE, (0.0, 0.0, -FORCE / parts)),
        probes=Probe("w", MIDDLE, component=2),
        scheme="static",
        dt=0.05,
        t_end=50.0,
        path=PathFollowing(load_end=load_end, branches=branches),
        units="mm, t, s",
    )


def tabulated(thickness: float, plies: str) -> np.ndarray:
    """Load factors and deflections [mm] of the table, shape (n, 2).

    Raises:
        KeyError: If the table has no such roof.
    """
    from shellmb.demos.references import tables

    name = f"h={thickness:g} " + (plies if plies == "isotropic" else f"[{plies}]")
    data = tables.read("sze38_hinged_roofs")
    rows = data[data["case"] == name]
    if rows.empty:
        raise KeyError(f"no roof '{name}'; the table has {', '.join(data['case'].unique())}")
    return rows[["P_over_Pmax", "minus_W_C"]].to_numpy(float)


def smooth(curve: np.ndarray, scale: np.ndarray, count: int = 20_000) -> np.ndarray:
    """Points of the cubic spline through the points of a curve, by their distance.

    Args:
        curve: Points, shape (n, 2).
        scale: What counts as one in each direction, shape (2,).
        count: How many.
    """
    steps = np.linalg.norm(np.diff(curve / scale, axis=0), axis=1)
    distance = np.concatenate([[0.0], np.cumsum(steps)])
    return np.asarray(CubicSpline(distance, curve)(np.linspace(0.0, distance[-1], count)))


def extremes(load: np.ndarray) -> np.ndarray:
    """Places where a sequence turns round."""
    step = np.sign(np.diff(load))
    return np.flatnonzero(step[1:] * step[:-1] < 0) + 1


def turning_loads(table: np.ndarray, scale: np.ndarray) -> list[tuple[float, float]]:
    """Extreme loads of the table, each as tabulated and as a spline through the points has it.

    The true one lies between or near them; loops that are tabulated too coarsely for a spline are
    taken as tabulated.
    """
    points = table[extremes(table[:, 0]), 0]
    spline = smooth(table, scale)
    turns = spline[extremes(spline[:, 0]), 0]
    found = []
    for value in points:
        nearest = turns[np.argmin(np.abs(turns - value))]
        found.append((float(value), float(nearest)))
    return found


def results(run: Any) -> dict[str, float]:
    """Limit loads, and how far the tabulated points are from our curve."""
    shell = run.scene.shell()
    thickness, own = shell.section.thickness, shell.section
    plies = "isotropic"
    if isinstance(own, Laminate):
        plies = "/".join(f"{ply.angle - 90.0:g}" for ply in own.plies)
    limits = [p for p in run.simulation.path.points if p.kind == "limit point"]
    found = {f"limit_load_{k}": p.load_factor for k, p in enumerate(limits, start=1)}
    others = [p for p in run.simulation.path.points if p.kind == "bifurcation"]
    found |= {f"bifurcation_{k}": p.load_factor for k, p in enumerate(others, start=1)}
    found["bifurcations"] = float(len(others))
    found["unstable_at_end"] = float(run.history["unstable"].iloc[-1])
    found["steps"] = float(run.simulation.step)
    found["iterations"] = float(run.simulation.iterations)
    found["end"] = float(run.history["load_factor"].iloc[-1])
    try:
        table = tabulated(round(thickness, 6), plies)
    except KeyError:
        return found
    scale = np.ptp(table, axis=0)
    history = run.history
    ours = np.column_stack([history["load_factor"], -history["w"]])
    curve = CubicSpline(history["t"], ours)(np.linspace(0.0, history["t"].iloc[-1], 20_000))
    passed = table[table[:, 0] <= found["end"] + ENDED]
    gaps = [np.linalg.norm((curve - point) / scale, axis=1).min() for point in passed]
    found["curve_error"] = float(max(gaps))
    wanted = turning_loads(table, scale)
    found["limit_points_expected"] = float(len(wanted))
    if len(wanted) == len(limits):
        # distance from the range between both readings of the table
        errors = [
            max(min(pair) - p.load_factor, p.load_factor - max(pair), 0.0) / abs(p.load_factor)
            for p, pair in zip(limits, wanted, strict=True)
        ]
        found["limit_load_error"] = max(errors)
        found["first_limit_load_error"] = errors[0]
    return found


def check(results: dict[str, float]) -> None:
    """The tabulated curve all along, its limit loads within 2 %, none missed, none invented."""
    assert results["end"] >= 1.0 - ENDED
    # what became unstable on the way is stable again, else something was missed
    assert results["unstable_at_end"] == 0
    assert results["curve_error"] < CURVE_TOLERANCE
    assert results["limit_load_error"] < LIMIT_TOLERANCE


def main() -> None:
    """Run all six roofs and draw them over the tabulated points."""
    from matplotlib.figure import Figure

    from shellmb.running.execute import execute

    made = Figure(figsize=(7.0, 6.4), layout="constrained")
    kinds: tuple[Plies, ...] = ("isotropic", "0/90/0", "90/0/90")
    for row, thickness in enumerate((12.7, 6.35)):
        axes = made.add_subplot(2, 1, row + 1)
        for colour, plies in zip(("C0", "C1", "C2"), kinds, strict=True):
            run = execute(scene(thickness, plies), results=results)
            t = np.linspace(0.0, run.history["t"].iloc[-1], 2000)
            columns = run.history[["w", "load_factor"]].to_numpy()
            curve = CubicSpline(run.history["t"], columns)(t)
            axes.plot(-curve[:, 0], curve[:, 1], color=colour, linewidth=1.2, label=plies)
            table = tabulated(thickness, plies)
            axes.plot(table[:, 1], table[:, 0], "o", color=colour, markersize=3, mfc="white")
            numbers = ", ".join(f"{k} {v:.4g}" for k, v in run.results.items())
            print(f"h = {thickness:g}, {plies}: {numbers}")
        axes.axhline(0.0, color="0.8", linewidth=0.8, zorder=0)
        axes.set(ylabel="P / 3000 N", title=f"h = {thickness:g} mm", ylim=(-0.2, 1.1))
        axes.legend(title="ours; points: Sze et al.", fontsize=8, title_fontsize=8)
    axes.set_xlabel("deflection of the middle [mm]")
    target = Path(__file__).parent / "figures" / "hinged_roofs.png"
    made.savefig(target, dpi=100)
    print(target)


if __name__ == "__main__":
    main()
