"""Bodies in modes that touch obstacles and lie in potentials, against the exact ones."""

from functools import cache
from typing import Any

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import numpy as np
import pytest

from shellmb.running.execute import execute
from shellmb.scene import (
    Ball,
    Beam,
    Contact,
    InitialVelocity,
    Isotropic,
    Line,
    Modal,
    Plane,
    PointForce,
    Potential,
    Probe,
    Rectangle,
    RectangularSection,
    Rod,
    Scene,
    Shell,
)
from tests.reduced.conftest import Kept, kept

PLATE = Isotropic(E=70e9, nu=0.3, thickness=5e-3, density=2700.0)
CORNER = (1.0, 0.4, 0.0)
SLOW = pytest.mark.slow
# the kernels are those of `test_reduced`: seven modes
FREE = Modal(modes=7)
HERE = {"stiffness": 1e5, "radius": 2.5e-3}
RUBS = HERE | {"friction": 0.3, "slip_speed": 0.01, "relative_damping": 0.1}
FLOOR = Plane((0, 0, -0.01), (0.05, 0.1, 1))
ACTING: dict[str, dict[str, Any]] = {
    "plane": {"contacts": Contact("it", FLOOR, 1e5)},
    "edge": {"contacts": Contact("it", FLOOR, 1e4, at="right")},
    "friction": {"contacts": Contact("it", FLOOR, **RUBS)},
    "ball": {"contacts": Contact("it", Ball((0.8, 0.1, -0.31), 0.3), 1e6)},
    "rod": {"contacts": Contact("it", Rod((0.8, 0.1, -0.31), (0, 1, 0), 0.3), **RUBS)},
    "bed": {
        "potentials": Potential(
            "it", lambda at, p: p["k"] * at.u[2] ** 2 / 2, parameters={"k": 2e3}
        )
    },
    "directors": {
        "potentials": Potential(
            "it", lambda at, p: p["k"] * at.directors[0][0] ** 2, parameters={"k": 20.0}
        )
    },
}


@cache
def falling(model: Any, name: str, scheme: str = "ep", alpha: float = 0.0) -> Kept:
    """A plate that falls and turns."""
    start = InitialVelocity((0.2, 0.1, -0.5), (0.1, 0.2, 0.3), (0.5, 0.2, 0.0))
    shell = Shell("plate", Rectangle(1.0, 0.4), PLATE, mesh=(4, 2), model=model)
    probes = [Probe(f"x{k}", CORNER, "position", k) for k in range(3)]
    times = {"scheme": scheme, "alpha": alpha, "dt": 1e-3, "t_end": 0.15}
    return kept(Scene("falling", shell, initial=start, probes=probes, **times, **ACTING[name]))


QUICK = [("plane", "ep", 0.0), ("bed", "ep", 0.0)]
LONG = [
    *(("plane", *s) for s in (("ed", 1.0), ("ep4", 0.0), ("ed3", 0.5))),
    *((name, "ep", 0.0) for name in ACTING if name not in ("plane", "bed")),
    ("ball", "ep4", 0.0),
]


@pytest.mark.parametrize(
    ("name", "scheme", "alpha"), [*QUICK, *(pytest.param(*case, marks=SLOW) for case in LONG)]
)
def test_what_it_takes_it_gives_back(name, scheme, alpha) -> None:
    found = falling(FREE, name, scheme, alpha)
    history, summary = found.history, found.summary
    # Newton's tolerance, times the stiffness of the contact
    assert summary["energy_balance_error"] < 1e-11
    assert summary["linear_momentum_drift"] < 1e-11
    bound = {"ep": 1e-10, "ed": 1e-3, "ep4": 1e-8, "ed3": 1e-6}[scheme]
    assert summary["angular_momentum_drift"] < bound
    kept = history.total_energy.iloc[-1] / history.total_energy.iloc[0] - 1
    if name in ("friction", "rod"):
        assert kept < -0.1
        assert history["it.loss"].iloc[-1] > 0
    elif alpha == 0:
        assert abs(kept) < 1e-10
    else:
        assert -1e-2 < kept <= 0
    # it acts, and what it gives is the change of momentum
    gained = history.momentum_z.iloc[-1] - history.momentum_z.iloc[0]
    assert history["it.Fz"].iloc[1:].sum() * 1e-3 == pytest.approx(gained, rel=1e-9, abs=1e-9)
    assert name == "directors" or abs(gained) > 0.1


@SLOW
@pytest.mark.parametrize("name", ACTING)
def test_moves_as_the_full_body_does(name) -> None:
    exact, modal = (falling(model, name).history for model in ("exact", FREE))
    names = [f"x{k}" for k in range(3)]
    x = exact[names]
    apart = np.abs(x - modal[names]).to_numpy().max()
    assert apart < 1e-4
    # it would have gone on without
    gone = x.iloc[0] + exact.t.to_numpy()[-1] * x.diff().iloc[1] / 1e-3
    assert np.abs(x.iloc[-1] - gone).max() > 100 * apart


@SLOW
def test_a_ball_leaves_the_moment_about_its_centre_free() -> None:
    """To the order of EP, with 3e-4 rad in a step: 7e-6 of it."""
    history = falling(FREE, "ball").history
    p, L = (
        history[[f"{m}_{k}" for k in "xyz"]].to_numpy() for m in ("momentum", "angular_momentum")
    )
    about = L - np.cross([0.8, 0.1, -0.31], p)
    assert np.abs(about - about[0]).max() < 2e-5 * np.abs(about[0]).max()


@SLOW
def test_a_bed_holds_a_body_in_statics() -> None:
    """Nothing else does; a place with a load is held with it."""

    def tip(model: Any) -> float:
        scene = Scene(
            "bed",
            Shell("plate", Rectangle(1.0, 0.4), PLATE, mesh=(4, 2), model=model),
            potentials=Potential(
                "it", lambda at, p: p["k"] * sum(u**2 for u in at.u) / 2, parameters={"k": 2e3}
            ),
            loads=PointForce(CORNER, (0, 0, -1.0)),
            probes=Probe("tip", CORNER),
            scheme="static",
            dt=1.0,
        )
        return float(execute(scene).history["tip"].iloc[-1])

    assert tip(Modal(modes=12)) == pytest.approx(tip("exact"), rel=1e-4)


@SLOW
def test_beams_touch_and_rub_with_three_directors() -> None:
    bar = RectangularSection(E=70e9, nu=0.3, width=0.01, height=0.02, density=2700.0)

    def fallen(model: Any) -> Any:
        scene = Scene(
            "bar",
            beams=Beam("bar", Line((0, 0, 0), (1, 0, 0)), bar, elements=6, model=model),
            contacts=Contact("it", Plane((0, 0, -0.02)), **RUBS),
            initial=InitialVelocity((0.3, 0.2, -0.5), (0.1, 0.4, 0.3), (0.5, 0, 0)),
            probes=[Probe(f"x{k}", (1.0, 0, 0), "position", k) for k in range(3)],
            scheme="ep",
            dt=1e-3,
            t_end=0.1,
        )
        return execute(scene)

    exact, modal = fallen("exact").history, fallen(Modal(modes=10)).history
    names = [f"x{k}" for k in range(3)]
    assert np.abs(exact[names] - modal[names]).to_numpy().max() < 2e-5
    assert modal["it.loss"].iloc[-1] == pytest.approx(exact["it.loss"].iloc[-1], rel=1e-3)
