"""Lateral buckling of a narrow cantilever plate: critical load, and the branch behind it.

The plate of section 6.1 of the paper under a dead force at the middle of its free end, in its
plane. Followed by arc length, the plate bends in its plane until an eigenvalue of the stiffness
passes zero while the load still grows: a bifurcation. There the path leaves on the branch on which
the plate bends sideways and twists; the load goes on growing, and the branch is stable.

Loads are multiples of `4.0126 sqrt(EI GJ)/L^2`, the critical load of a beam (Bessel functions;
Timoshenko and Gere, Theory of Elastic Stability, art. 6.3). The plate's is 4 % above it because its
clamped edge warps and contracts less; a Ritz solution for the Kirchhoff plate says so, too. Behind
it the plate is stiffer than a beam with a constant torsional stiffness, its fibres becoming helices
(Wagner); with that a rod agrees. A beam model agrees with the exact rod without it.

`python -m shellmb.demos.lateral_plate` draws both.
"""

# KIND: statics and paths
# CI: shellmb run lateral_plate --check
# CI: shellmb run lateral_plate --set model=beam --check --no-pictures --out runs/ci-lateral-beam
# CI: shellmb run lateral_plate --set branches=detect --check --no-pictures --out runs/ci-lateral

from pathlib import Path
from typing import Any, Literal

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from shellmb.demos.references.beams import lateral_buckling
from shellmb.demos.references.lateral import Strip, beam_critical_load, plate_critical_load, rod_tip
from shellmb.scene import (
    Beam,
    Clamped,
    Isotropic,
    Line,
    PathFollowing,
    PointForce,
    Probe,
    Rectangle,
    RectangularSection,
    Scene,
    Shell,
    StepControl,
)

# the plate of the paper's section 6.1 [m, Pa]
LENGTH, HEIGHT, THICKNESS, E, NU = 1.0, 0.08, 2e-3, 210e9, 0.25
# loads over the critical one at which branches are compared
RATIOS = (1.05, 1.1, 1.2, 1.3, 1.4)


def strip(thickness: float) -> Strip:
    """Strip as analytic solutions know it."""
    return Strip(LENGTH, HEIGHT, thickness, E, NU)


def unit_load(thickness: float) -> float:
    """Critical load of a beam that is rigid in the plane of the load [N]."""
    own = strip(thickness)
    return float(lateral_buckling() * np.sqrt(own.weak * own.torsion) / LENGTH**2)


def scene(
    model: Literal["shell", "beam"] = "shell",
    branches: Literal["ignore", "detect", "switch"] = "switch",
    side: Literal[1, -1] = 1,
    thickness: float = THICKNESS,
    load_end: float = 1.5,
) -> Scene:
    """The plate in the x-z plane, clamped at x = 0, its free end pulled down.

    Args:
        model: Shell or beam elements.
        branches: What to do at the bifurcation.
        side: To which side it buckles.
        thickness: Thickness [m].
        load_end: Last load, over the critical load of a beam.
    """
    load = (0.0, 0.0, -unit_load(thickness))
    parts: dict[str, Any]
    if model == "shell":
        surface = Rectangle(LENGTH, HEIGHT, axis2=(0.0, 0.0, 1.0))
        end: Any = (LENGTH, 0.0, HEIGHT / 2)
        parts = {
            "shells": Shell("plate", surface, Isotropic(E, NU, thickness=thickness), mesh=(16, 2))
        }
        clamped = Clamped("left")
    else:
        line = Line((0.0, 0.0, HEIGHT / 2), (LENGTH, 0.0, HEIGHT / 2))
        section = RectangularSection(E, NU, width=thickness, height=HEIGHT)
        end = "end"
        parts = {"beams": Beam("plate", line, section, elements=8, up=(0.0, 0.0, 1.0))}
        clamped = Clamped("start")
    return Scene(
        "lateral_plate",
        supports=clamped,
        loads=PointForce(end, load),
        probes=(Probe("sideways", end, component=1), Probe("down", end, component=2)),
        scheme="static",
        dt=0.1,
        # the unit of arc length is the plate's stiff motion in its plane: it bends far more
        t_end=2000.0,
        step_control=StepControl(max_dt=40.0),
        path=PathFollowing(load_end=load_end, branches=branches, side=side, turn_deg=20.0),
        **parts,
        units="m, kg, s",
    )


def results(run: Any) -> dict[str, float]:
    """Critical load and branch, beside those of plate, beam and rod."""
    points = run.simulation.path.points
    history, shell = run.history, bool(run.scene.shells)
    if shell:
        thickness = run.scene.shells[0].section.thickness
    else:
        thickness = run.scene.beams[0].section.width
    own, unit = strip(thickness), unit_load(thickness)
    beam = beam_critical_load(own, lateral_buckling()) / unit
    found = {
        "bifurcations": float(len([p for p in points if p.kind == "bifurcation"])),
        "switched": float(any(p.switched for p in points)),
        "steps": float(run.simulation.step),
        "iterations": float(run.simulation.iterations),
        "unstable_at_end": float(history["unstable"].iloc[-1]),
        "sideways_at_end": float(history["sideways"].iloc[-1]),
        "down_at_end": float(history["down"].iloc[-1]),
    }
    if not points:
        return found
    critical = points[0].load_factor
    found["critical_load"] = critical
    found["reference_load"] = plate_critical_load(own) / unit if shell else beam
    found["critical_load_error"] = critical / found["reference_load"] - 1
    if not points[0].switched:
        return found
    rows = history[history["t"] > points[0].t]
    branch = CubicSpline(rows["t"], rows[["load_factor", *PROBES]])
    first, last = rows["t"].iloc[0], rows["t"].iloc[-1]
    # Wagner's part of the torque is that of a plate; beams here have a constant stiffness
    errors, moment = [], None
    for ratio in (r for r in RATIOS if r * critical < rows["load_factor"].iloc[-1]):
        reached = brentq(lambda t, r=ratio: branch(t)[0] - r * critical, first, last)
        ours = branch(reached)[1:]
        load = ratio * (beam if shell else critical) * unit
        if moment is None:
            # from there to the branch, and not to the unstable path
            moment = np.cross([LENGTH, ours[0], ours[1]], [0.0, 0.0, -load])
        tip, moment = rod_tip(own, load, moment, wagner=shell)
        found[f"sideways_at_{ratio:g}"], found[f"rod_at_{ratio:g}"] = float(ours[0]), float(tip[1])
        errors.append(np.linalg.norm(ours - tip[1:]) / LENGTH)
    found["branch_error_over_L"] = float(max(errors, default=0.0))
    return found


PROBES = ("sideways", "down")


def check(results: dict[str, float]) -> None:
    """Critical loads; the branch, by a rod.

    Plate: within 1 % of the Ritz solution, which is stiffer by the shear near the edges, of the
    order of t/b = 2.5 %; the branch within 2 % of the length of a rod that knows neither the
    clamped edge's stiffness nor more of warping than Wagner's term. Beam: within 0.1 % of both.
    """
    assert results["bifurcations"] == 1
    shell = results["reference_load"] > 1.02
    assert abs(results["critical_load_error"]) < (0.01 if shell else 0.001)
    if results["switched"]:
        assert results["unstable_at_end"] == 0
        assert abs(results["sideways_at_end"]) > 0.3
        assert results["branch_error_over_L"] < (0.02 if shell else 0.001)
    else:
        assert results["unstable_at_end"] >= 1
        assert abs(results["sideways_at_end"]) < 1e-6


def main() -> None:
    """Run both models and draw their branches over those of the rod."""
    from matplotlib.figure import Figure

    from shellmb.running.execute import execute

    made = Figure(figsize=(7.0, 3.4), layout="constrained")
    axes = made.add_subplot()
    own = strip(THICKNESS)
    beam = beam_critical_load(own, lateral_buckling())
    models: tuple[Literal["shell", "beam"], ...] = ("shell", "beam")
    for colour, model in zip(("C0", "C1"), models, strict=True):
        run = execute(scene(model), results=results)
        history, critical = run.history, run.results["critical_load"]
        for column, style in (("sideways", "-"), ("down", "--")):
            axes.plot(
                history[column].abs(),
                history["load_factor"],
                style,
                color=colour,
                linewidth=1.2,
                label=f"{model}: {column}",
            )
        moment = None
        for ratio in np.linspace(1.02, 1.5 / critical - 0.01, 9):
            load = ratio * beam
            guess = np.cross([LENGTH, 0.9 * np.sqrt(ratio - 1), -(ratio - 1)], [0, 0, -load])
            tip, moment = rod_tip(own, load, guess if moment is None else moment, model == "shell")
            over = ratio * critical if model == "shell" else load / unit_load(THICKNESS)
            axes.plot(np.abs(tip[1:]), [over, over], "o", color=colour, markersize=3, mfc="white")
        print(f"{model}: " + ", ".join(f"{k} {v:.5g}" for k, v in run.results.items()))
    axes.plot([], [], "o", color="black", markersize=3, mfc="white", label="rod")
    axes.set(xlabel="tip displacement [m]", ylabel="load over that of a beam [-]", ylim=(0.9, 1.52))
    axes.legend(fontsize=8)
    target = Path(__file__).parent / "figures" / "lateral_plate.png"
    made.savefig(target, dpi=100)
    print(target)


if __name__ == "__main__":
    main()
