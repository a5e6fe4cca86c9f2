"""The studies that come with shellmb; their results are in `demos/studies`."""

from __future__ import annotations

from shellmb.accuracy.studies.choice import Base
from shellmb.accuracy.studies.sweep import Sweep
from shellmb.demos import loaded_plate
from shellmb.demos.references.plates import Plate, rectangle_uniform_deflection
from shellmb.demos.studies.bundle import ALL, Bundled, Part, quantities
from shellmb.demos.studies.problems2016 import FOUR
from shellmb.demos.studies.solutions import crank_torque, top_center
from shellmb.errors import SceneError

_NAVIER = rectangle_uniform_deflection(
    Plate(loaded_plate.E, loaded_plate.NU, loaded_plate.THICKNESS),
    loaded_plate.SIDE,
    loaded_plate.SIDE,
    loaded_plate.PRESSURE,
)

BUNDLED: tuple[Bundled, ...] = (
    Bundled(
        "static_plate",
        "Thin square plate, simply supported, linear, against Navier's series: mesh, degree, cell.",
        (
            Part(
                "square plate",
                Sweep(
                    Base("loaded_plate"),
                    quantities("deflection"),
                    cell=("quad", "tri"),
                    degree=(2, 3),
                    mesh=((2, 2), (4, 4), (8, 8), (16, 16)),
                    exact=_NAVIER,
                ),
            ),
        ),
    ),
    Bundled(
        "static_shell",
        "Hemisphere with a hole, large displacements at the full load: mesh, degree, cell.",
        (
            Part(
                "hemisphere",
                Sweep(
                    Base("hemisphere"),
                    quantities("outward"),
                    cell=("quad", "tri"),
                    degree=(2, 3),
                    mesh=((4, 4), (6, 6), (8, 8), (12, 12)),
                ),
            ),
        ),
    ),
    Bundled(
        "sudden_load",
        "Cantilever plate under a sudden load, 0.5 s, 6x2 elements: scheme, alpha, dt.",
        (
            Part(
                "sudden load",
                Sweep(
                    Base("sudden_load"),
                    quantities("tip_z:l2", "tip_z:max"),
                    **ALL,
                    dt=(4e-2, 2e-2, 1e-2, 5e-3, 2.5e-3, 1.25e-3),
                    repeat=2,
                ),
            ),
        ),
    ),
    Bundled(
        "smooth_load",
        "The same plate under a load that rises in 0.2 s, smoothly: scheme, alpha, dt.",
        (
            Part(
                "smooth load",
                Sweep(
                    Base("sudden_load", (("rise", "0.2"),)),
                    quantities("tip_z:l2"),
                    **ALL,
                    dt=(4e-2, 2e-2, 1e-2, 5e-3, 2.5e-3),
                    repeat=2,
                ),
            ),
        ),
    ),
    Bundled(
        "tumbling_plate",
        "Free plate thrown by a pulse, first 0.04 s (of 0.2 s), 6x2 elements: scheme, alpha, dt.",
        (
            Part(
                "tumbling plate",
                Sweep(
                    Base("tumbling_plate", t_end=0.04),
                    quantities("strain_energy:l2", "corner_z:l2"),
                    **ALL,
                    dt=(8e-4, 4e-4, 2e-4, 1e-4),
                    repeat=2,
                ),
            ),
        ),
    ),
    Bundled(
        "lateral_buckling",
        "Section 6.1 with a bow of 0.1 mm, through the snap, 0.08 s (of 6.28 s): scheme, dt, mesh.",
        (
            Part(
                "lateral buckling (6.1)",
                Sweep(
                    Base("lateral_buckling", (("imperfection", "1e-4"),), 0.08, "plate"),
                    quantities("lateral:l2", "drive.torque:mean"),
                    **ALL,
                    mesh=((6, 2), (12, 4)),
                    dt=(4e-3, 2e-3, 1e-3),
                    repeat=2,
                ),
            ),
        ),
    ),
    Bundled(
        "snap_through",
        "Section 6.2, the descent before the snap, 0.2 s (of 2 s): scheme, dt, mesh.",
        (
            Part(
                "snap-through (6.2)",
                Sweep(
                    Base("snap_through", (), 0.2, "shell"),
                    quantities("M:l2"),
                    **ALL,
                    mesh=((8, 4), (12, 6)),
                    dt=(2e-2, 1e-2),
                    repeat=2,
                ),
            ),
        ),
    ),
    Bundled(
        "slider_crank",
        "Driven slider-crank, its driving torque over the run-up of 0.1 s: scheme, alpha, dt.",
        (
            Part(
                "slider-crank, rigid coupler",
                Sweep(
                    Base("slider_crank", (("flexible", "False"),), 0.1),
                    quantities("drive.torque:l2"),
                    **ALL,
                    # whole steps: a shorter last one shows in the curve
                    dt=(1e-2, 5e-3, 2.5e-3, 1.25e-3),
                    solution=crank_torque(0.1),
                    repeat=2,
                ),
            ),
        ),
    ),
    Bundled(
        "flexible_slider_crank",
        "The same with a flexible coupler, a beam: scheme, alpha, dt.",
        (
            Part(
                "slider-crank, flexible coupler",
                Sweep(
                    Base("slider_crank", (("flexible", "True"),), 0.2),
                    quantities("drive.torque:l2"),
                    **ALL,
                    dt=(8e-3, 4e-3, 2e-3, 1e-3),
                    repeat=2,
                ),
            ),
        ),
    ),
    Bundled(
        "heavy_top",
        "Fast heavy top, 0.2 s (of 0.4 s), against its equations of motion: scheme, alpha, dt.",
        (
            Part(
                "heavy top",
                Sweep(
                    Base("heavy_top", t_end=0.2),
                    quantities("z:l2"),
                    **ALL,
                    dt=(4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4),
                    solution=top_center(0.2),
                    repeat=2,
                ),
            ),
        ),
    ),
    Bundled(
        "spin_up_beam",
        "Stiff beam that is turned up to speed, its tip over 8 s (of 20 s): scheme, alpha, dt.",
        (
            Part(
                "spin-up of a beam",
                Sweep(
                    Base("spin_up_beam", t_end=8.0),
                    quantities("tip_uy:l2", "motor.torque:l2"),
                    **ALL,
                    dt=(8e-2, 4e-2, 2e-2, 1e-2),
                    repeat=2,
                ),
            ),
        ),
    ),
)


CONTROL = Bundled(
    "step_control",
    "Fixed steps and steps that follow their error, fast and slow phases: dt or step_error.",
    (
        Part(
            "sudden load",
            Sweep(
                Base("sudden_load"),
                quantities("tip_z:l2"),
                scheme=("ep", "ed", "ep4", "ed3"),
                alpha=(1.0,),
                dt=(2e-2, 1e-2, 5e-3),
                step_error=(1e-2, 1e-3, 1e-4),
                reference="ep4",
                repeat=2,
            ),
        ),
        Part(
            "snap-through (6.2), of beams, through the snap",
            Sweep(
                Base("snap_through", (("model", "beam"),), 1.2),
                quantities("M:l2"),
                scheme=("ed",),
                dt=(2e-2, 1e-2, 5e-3),
                step_error=(1e-2, 1e-3, 1e-4),
                repeat=1,
            ),
        ),
        Part(
            "antenna (6.3), of beams, until the first hinges hit",
            Sweep(
                Base("antenna", (("model", "beam"),), 60.0),
                quantities("A4_x:l2"),
                scheme=("ed",),
                dt=(1.6, 0.8, 0.4),
                step_error=(1e-2, 1e-3),
                repeat=1,
            ),
        ),
    ),
)
# models of bodies, at a step whose own error is small beside theirs
MODELS = Bundled(
    "reduced_bodies",
    "Panels of the satellite exact, linear and in modes about frames, and rigid: model, mesh.",
    (
        Part(
            "satellite, panels exact, linear, in modes and rigid",
            Sweep(
                Base("satellite", t_end=3.0),
                quantities("right_tip:l2", "recoil:l2"),
                model=("exact", "floating-frame", "modal:1", "modal:4", "modal:10", "rigid"),
                scheme=("ep4",),
                mesh=((8, 2), (16, 4)),
                dt=(0.05,),
                repeat=1,
            ),
        ),
    ),
)
ANTENNA = Bundled(
    "reduced_antenna",
    "Panels of the antenna exact and in modes about frames: model, mesh.",
    (
        Part(
            "antenna (6.3), panels exact and in modes, connectors rigid",
            Sweep(
                Base("antenna_panels"),
                quantities("C4_x:l2", "C3.rotation:l2"),
                model=("exact", "modal:1", "modal:4", "modal:10"),
                mesh=((5, 2), (10, 4)),
                reference="ed",
                repeat=1,
            ),
        ),
    ),
)
BUNDLED += (CONTROL, MODELS, ANTENNA, *FOUR)


def find_bundled(name: str) -> tuple[Bundled, ...]:
    """The study of that name, or all of them.

    Args:
        name: Name; "all".

    Raises:
        SceneError: If there is none of that name.
    """
    found = tuple(b for b in BUNDLED if name in (b.name, "all"))
    if not found:
        listed = ", ".join(f"'{b.name}'" for b in BUNDLED)
        raise SceneError(f"study: bundled is '{name}'; it must be 'all' or one of {listed}")
    return found
