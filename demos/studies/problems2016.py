"""Studies of four flexible multibody problems on which eight codes agree.

O. A. Bauchau, P. Betsch, A. Cardona, J. Gerstmayr, B. Jonker, P. Masarati, V. Sonneville,
Validation of flexible multibody dynamics beam formulations using benchmark problems, Multibody
Syst. Dyn. 37 (2016) 29-48.
"""

from typing import Any

from shellmb.accuracy.studies.choice import Base
from shellmb.accuracy.studies.sweep import Sweep
from shellmb.demos.studies.bundle import Bundled, Part, quantities

# one dissipation of each scheme, and a rival; rho = 0.6 for generalized-alpha
SCHEMES: dict[str, Any] = {
    "scheme": ("ep", "ed", "ep4", "ed3", "generalized-alpha"),
    "alpha": (0.25, 0.5, 1.0),
    "dissipations": {"ed": (1.0,), "ed3": (0.5,), "generalized-alpha": (0.25,)},
}

FOUR = (
    Bundled(
        "princeton_beam",
        "Princeton beam, third load at 45 degrees, as a beam and as a shell: mesh, degree.",
        (
            Part(
                "Princeton beam, as a beam",
                Sweep(
                    Base("princeton_beam", (("model", "beam"),)),
                    quantities("flapwise", "edgewise"),
                    degree=(2, 3),
                    mesh=((2, 1), (4, 1), (8, 1), (16, 1)),
                    repeat=2,
                ),
            ),
            Part(
                "Princeton beam, as a strip of shell",
                Sweep(
                    Base("princeton_beam", (("model", "shell"),)),
                    quantities("flapwise", "edgewise"),
                    degree=(2, 3),
                    mesh=((12, 1), (24, 1), (48, 2)),
                    repeat=2,
                ),
            ),
        ),
    ),
    Bundled(
        "four_bar",
        "Four-bar mechanism with a misaligned hinge, first 4 s (of 12 s): scheme, alpha, dt.",
        (
            Part(
                "four-bar mechanism",
                Sweep(
                    Base("four_bar", t_end=4.0),
                    # bars vibrate from the change point on, which steps do not resolve and nothing
                    # damps: the curve is known to some tenths of a percent, its mean far better
                    quantities("C_z:l2", "C_z:mean"),
                    **SCHEMES,
                    dt=(8e-2, 4e-2, 2e-2),
                ),
            ),
        ),
    ),
    Bundled(
        "crank_buckling",
        "Lateral buckling by a crank and a link, through the first swing: scheme, alpha, dt.",
        (
            Part(
                "lateral buckling by crank and link, a beam",
                Sweep(
                    Base("crank_buckling", t_end=0.19),
                    quantities("y:l2"),
                    **SCHEMES,
                    dt=(4e-3, 2e-3, 1e-3),
                ),
            ),
            Part(
                "lateral buckling by crank and link, a shell",
                Sweep(
                    Base("crank_buckling", (("model", "shell"),), t_end=0.19),
                    quantities("y:l2"),
                    **SCHEMES,
                    dt=(4e-3, 2e-3),
                ),
            ),
        ),
    ),
    Bundled(
        "critical_speed",
        "Shaft through its critical speed, first 1.3 s (of 2.5 s): scheme, alpha, dt.",
        (
            Part(
                "shaft through its critical speed",
                Sweep(
                    Base("critical_speed", t_end=1.3),
                    quantities("y:l2"),
                    **SCHEMES,
                    dt=(8e-3, 4e-3, 2e-3),
                ),
            ),
        ),
    ),
)
