"""Resultants of bodies in modes, against those of the exact ones."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import numpy as np
import pytest

import shellmb as sm
from shellmb.running.execute import RunResult, execute
from shellmb.scene import (
    Beam,
    Clamped,
    EdgeForce,
    Event,
    FollowerForce,
    Gravity,
    Hinged,
    Hyperelastic,
    Isotropic,
    Line,
    Modal,
    Off,
    On,
    Output,
    PointForce,
    Pressure,
    Probe,
    Rectangle,
    RectangularSection,
    Scene,
    Sensor,
    Shell,
)
from shellmb.show.fields import Fields

PLATE = Isotropic(E=70e9, nu=0.3, thickness=5e-3, density=2700.0)
BAR = RectangularSection(E=70e9, nu=0.3, width=0.01, height=0.02, density=2700.0)
SLOW = pytest.mark.slow


def quadratic(strains: Any, p: Any) -> Any:
    """Energy per area of an isotropic plate without Poisson's ratio."""
    C, h = p["E"] * p["h"], p["h"]
    eps, kap, gam = strains.eps, strains.kap, strains.gam
    membrane = eps[0] ** 2 + eps[1] ** 2 + eps[2] ** 2 / 2
    bending = kap[0] ** 2 + kap[1] ** 2 + kap[2] ** 2 / 2
    return C / 2 * (membrane + h**2 / 12 * bending + 5 / 12 * (gam[0] ** 2 + gam[1] ** 2))


RUBBER = Hyperelastic(
    quadratic, {"E": 70e9, "h": 5e-3}, thickness=5e-3, density=2700.0, stiffness=70e9 * 5e-3
)
SHELL = {"bending": 3, "membrane": 3, "shear": 2}


def rise(t: float) -> float:
    """Slowly: what is sudden sends waves through the plate that are of more modes than few."""
    return float(np.sin(5 * np.pi * min(t, 0.1)) ** 2)


def cantilever(model: Any, section: Any = PLATE, **more: Any) -> Scene:
    probes = [
        Probe(f"{quantity}_{k}", at, quantity, k)
        for quantity, count in SHELL.items()
        for k in range(count)
        for at in [(0.5, 0.2, 0.0)]
    ]
    return Scene(
        "cantilever",
        Shell("plate", Rectangle(1.0, 0.4), section, mesh=(4, 2), model=model),
        supports=Clamped("left"),
        loads=[EdgeForce("right", (1.0, 0.2, -0.05), time=rise), Pressure(0.02, time=rise)],
        probes=probes,
        **{"scheme": "ep", "dt": 5e-3, "t_end": 0.1} | more,
    )


def apart(exact: RunResult, modal: RunResult, names: list[str]) -> np.ndarray:
    """Largest differences of columns, relative to what is largest of each quantity."""
    one, other = (run.history[names].iloc[1:] for run in (exact, modal))
    size = one.abs().max()
    kinds = [name.split("_")[0] for name in names]
    largest = size.groupby(kinds).transform("max") if len(set(kinds)) > 1 else size.max()
    return np.asarray((one - other).abs().max() / largest)


NAMES = [f"{quantity}_{k}" for quantity, count in SHELL.items() for k in range(count)]
STATIC = {"scheme": "static", "dt": 1.0, "t_end": 1.0}


@pytest.mark.parametrize("section", [PLATE, pytest.param(RUBBER, marks=SLOW)])
def test_statics_is_that_of_the_full_body(section, tmp_path) -> None:
    """Each load has modes of its own: one is enough of those with the edge held."""
    fields = Output(frames=1, fields=("all",))
    exact, modal = (
        execute(cantilever(m, section, output=fields, **STATIC), tmp_path / name, pictures=False)
        for name, m in (("exact", "exact"), ("modal", Modal(modes=1)))
    )
    # 0.03 mm of deflection, and 1 N/m along what bends; in so coarse a mesh membrane forces of the
    # exact shell feel the square of slopes
    assert apart(exact, modal, NAMES).max() < 1e-3
    # what the clamped edge carries is in balance with the loads, about the origin; to the slopes
    edge, pushed = np.array([0.4, 0.08, -0.02]), np.array([0.0, 0.0, 0.008])
    moment = np.cross([1.0, 0.2, 0.0], edge) + np.cross([0.5, 0.2, 0.0], pushed)
    held = [f"plate.left.{c}{k}" for c in "FM" for k in (1, 2, 3)]
    carried = modal.history[held].iloc[-1].to_numpy()
    assert np.allclose(carried, [*-(edge + pushed), *-moment], rtol=0, atol=1e-4)
    both = [last(tmp_path / name, "plate") for name in ("exact", "modal")]
    assert set(both[0].data_vars) == set(both[1].data_vars)
    for name in ("N", "M", "Q", "strains", "energy_density", "principal_N"):
        first, second = (np.asarray(plate[name].values) for plate in both)
        # an exact energy that is nonlinear is continued to the nodes, of modes what it is made of
        bound = 2e-2 if name == "energy_density" else 2e-3
        assert np.abs(first - second).max() < bound * np.abs(first).max(), name


@SLOW
@pytest.mark.parametrize(
    ("scheme", "alpha"), [("ep", 0.0), ("ed", 1.0), ("ep4", 0.0), ("ed3", 0.5)]
)
def test_means_over_a_step_are_those_of_the_full_body(scheme, alpha) -> None:
    exact, modal = (
        execute(cantilever(m, scheme=scheme, alpha=alpha)) for m in ("exact", Modal(modes=8))
    )
    # most of it in shear, which modes have late
    assert apart(exact, modal, NAMES).max() < 2e-2


@SLOW
def test_a_beam_has_its_forces_and_moments() -> None:
    def scene(model: Any) -> Scene:
        both = ("force", "moment")
        probes = [Probe(f"{q}_{k}", (0.5, 0, 0), q, k) for q in both for k in range(3)]
        return Scene(
            "bar",
            beams=Beam("bar", Line((0, 0, 0), (1, 0, 0)), BAR, elements=6, model=model),
            supports=Clamped("start"),
            loads=[PointForce((1, 0, 0), (0.2, 0.3, -0.5)), FollowerForce((1, 0, 0), (0, 0, 0.1))],
            probes=probes,
            **STATIC,
        )

    exact, modal = (execute(scene(m)) for m in ("exact", Modal(modes=1)))
    names = [f"{q}_{k}" for q in ("force", "moment") for k in range(3)]
    assert apart(exact, modal, names).max() < 1e-3


@SLOW
def test_a_beam_hangs_from_its_hinged_end() -> None:
    def swung(model: Any) -> Any:
        scene = Scene(
            "pendulum",
            beams=Beam("bar", Line((0, 0, 0), (1, 0, 0)), BAR, elements=6, model=model),
            supports=Hinged("start"),
            loads=Gravity((0, 1.0, -9.81)),
            probes=[Probe(f"x{k}", (1, 0, 0), "position", k) for k in range(3)],
            scheme="ep",
            dt=5e-3,
            t_end=0.5,
        )
        return execute(scene).history[[f"x{k}" for k in range(3)]]

    # it bends by 0.3 mm: the square of that, and what six modes leave out
    assert np.abs(swung("exact") - swung(Modal(modes=6))).to_numpy().max() < 1e-5


def last(folder: Path, body: str) -> Any:
    described = sm.load(folder).described
    return Fields(folder / "fields", described.bodies, described.labels)[body].isel(t=-1)


@SLOW
def test_a_free_body_bends_between_its_loads_and_its_inertia() -> None:
    """A pressure on a part of it that rises slowly; one mode beside that of the load."""

    def bent(model: Any) -> RunResult:
        return execute(
            Scene(
                "free",
                Shell("plate", Rectangle(1.0, 0.4), PLATE, mesh=(4, 2), model=model),
                loads=Pressure(lambda x: 4 * x[0] ** 2, time=rise),
                probes=[Probe(f"bending_{k}", (0.5, 0.2, 0.0), "bending", k) for k in range(2)],
                scheme="ep",
                dt=5e-3,
                t_end=0.1,
            )
        )

    assert apart(bent("exact"), bent(Modal(modes=1)), ["bending_0", "bending_1"]).max() < 2e-2


@SLOW
def test_a_load_that_a_recovered_moment_switches_off() -> None:
    """What sensors read and events switch is there where the body itself is gone."""

    def run(model: Any) -> RunResult:
        big = Event("big", Sensor("bending_0") <= -0.05)
        slow = Pressure(0.5, time=Off("big"))
        more = {"loads": [slow, EdgeForce("right", (0, 0, 0.05), time=On("big"))], "events": big}
        return execute(replace(cantilever(model), **more))

    exact, modal = run("exact"), run(Modal(modes=8))
    assert modal.summary["energy_balance_error"] < 1e-12
    assert exact.history["bending_0"].min() < -0.05
    assert apart(exact, modal, ["bending_0"]).max() < 2e-2
    one, other = (run.history["work_loads"].iloc[-1] for run in (exact, modal))
    assert other == pytest.approx(one, rel=2e-2)
