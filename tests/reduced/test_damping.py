"""Damping of bodies in modes: that of the section, projected on them."""

from dataclasses import replace
from typing import Any

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import numpy as np
import pytest

from shellmb.errors import SceneError
from shellmb.running.execute import RunResult, execute
from shellmb.running.natural_modes.vibration import natural_modes
from shellmb.scene import (
    Clamped,
    InitialVelocity,
    Isotropic,
    Join,
    Modal,
    PointForce,
    Probe,
    Scene,
    Shell,
    ShellDamping,
    SurfaceForce,
)
from tests import scenes

PLATE = Isotropic(E=70e9, nu=0.3, thickness=5e-3, density=2700.0)
CORNER = (1.0, 0.4, 0.0)
# the kernels are those of `test_reduced`: seven modes
MODAL, FREE = Modal(modes=8), Modal(modes=7)
SLOW = pytest.mark.slow
PARTS = ShellDamping(membrane=1e-3, bending=2e-3, shear=5e-3)
SCHEMES = [
    ("ep", 0.0),
    *(pytest.param(*pair, marks=SLOW) for pair in (("ed", 1.0), ("ep4", 0.0), ("ed3", 0.5))),
]


def plate(model: Any, **damping: Any) -> Shell:
    return scenes.plate(replace(PLATE, **damping), (1.0, 0.4), mesh=(4, 2), model=model)


def struck(model: Any, scheme: str = "ep4", alpha: float = 0.0, **damping: Any) -> RunResult:
    """A plate that spins slowly and is pushed at a corner."""
    probes = [Probe(f"x{k}", CORNER, "position", k) for k in range(3)]
    push = PointForce(CORNER, (0, 0, 20.0), time=lambda t: max(0.0, np.sin(np.pi * t / 0.05)))
    motion = {"initial": InitialVelocity((1.0, 0, 0), (0.3, 0.1, 0.2)), "loads": push}
    times = {"scheme": scheme, "alpha": alpha, "dt": 5e-3, "t_end": 0.1}
    return execute(Scene("struck", plate(model, **damping), **motion, **times, probes=probes))


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_strains_are_damped_and_rigid_motions_are_not(scheme, alpha) -> None:
    found = struck(MODAL, scheme, alpha, stiffness_damping=PARTS)
    assert found.history["work_terms"].iloc[-1] < -1e-3
    assert found.summary["energy_balance_error"] < 1e-12
    assert found.summary["linear_momentum_drift"] < 1e-12
    # EP keeps it; ED, EP4 and ED3 to their order
    bound = {"ep": 1e-12, "ed": 1e-3, "ep4": 1e-6, "ed3": 1e-5}[scheme]
    assert found.summary["angular_momentum_drift"] < bound


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_what_damps_by_the_mass_takes_momentum(scheme, alpha) -> None:
    """`p' = -rate p` of a free body, which the scheme solves as the rational function it is."""
    rate = 2.0
    scene = Scene(
        "slowed",
        plate(FREE, mass_damping=rate),
        initial=InitialVelocity((1.0, 0.2, 0.0), (0.3, 0.1, 0.2)),
        scheme=scheme,
        alpha=alpha,
        dt=5e-3,
        t_end=0.1,
    )
    found = execute(scene)
    assert found.summary["energy_balance_error"] < 1e-12
    assert found.summary["linear_momentum_drift"] < 1e-12
    # that of EP is (rate dt)^3/12 in a step: 2e-6 over twenty, ED's less
    momenta = found.history["momentum_x"]
    assert momenta.iloc[-1] / momenta.iloc[0] == pytest.approx(np.exp(-0.1 * rate), rel=3e-6)
    spins = found.history["angular_momentum_z"]
    assert spins.iloc[-1] == pytest.approx(np.exp(-0.1 * rate) * spins.iloc[0], rel=3e-5)


def test_one_time_damps_modes_in_proportion_to_their_stiffness() -> None:
    """So each decays by `tau w^2/2`; with several times bending, of which they are, by its own."""

    def modal(damping: Any) -> Any:
        scene = Scene("d", plate(FREE, stiffness_damping=damping), scheme="ep", dt=1, t_end=1)
        (data,) = natural_modes(scene, count=1).model.modal
        return data

    tau, one = 1e-3, modal(1e-3)
    # round-off of eigenvectors
    size = tau * np.sqrt(np.outer(one.stiffness, one.stiffness))
    assert np.allclose(one.damping / size, np.eye(one.count), rtol=0, atol=1e-9)
    parts = modal(PARTS)
    # of the first four; the fifth is one of shear, as so coarse a mesh has it
    times = (parts.damping.diagonal() / parts.stiffness)[:4]
    # between that of bending and those of others, of which thin plates have little
    assert np.all(times > PARTS.bending * (1 - 1e-9))
    assert np.all(times < 1.01 * PARTS.bending)


@SLOW
@pytest.mark.parametrize("damping", [{"stiffness_damping": PARTS}, {"mass_damping": 2.0}])
def test_decays_as_the_full_body_does(damping) -> None:
    exact, modal, free = struck("exact", **damping), struck(MODAL, **damping), struck(MODAL)
    names = [f"x{k}" for k in range(3)]
    apart, matters = (
        np.abs(exact.history[names] - other.history[names]).to_numpy().max()
        for other in (modal, free)
    )
    # 6 mm of bending, 1 % of its size: the square of that, and what eight modes leave out
    assert apart < 5e-5
    assert matters > 30 * apart
    one, other = (run.history["work_terms"].iloc[-1] for run in (exact, modal))
    # what eight modes leave out is stiff, and damped most
    assert other == pytest.approx(one, rel=2e-2)


# 0.74 s is 20 over the lowest frequency
@pytest.mark.parametrize(
    ("damping", "warns"),
    [
        (ShellDamping(shear=7.4), True),
        pytest.param(0.74, False, marks=SLOW),
        pytest.param(ShellDamping(shear=0.07), False, marks=SLOW),
    ],
)
def test_shapes_that_modes_cannot_relax_in_are_said(damping, warns) -> None:
    """A cantilever whose shear is damped far beyond oscillation bends without: its modes do not."""
    times = {"scheme": "ep", "dt": 0.01, "t_end": 0.1}

    def pushed(model: Any) -> tuple[Any, list[float]]:
        # so small a load that the exact body is linear
        load = SurfaceForce((0, 0, 2.0), time=lambda t: 1.0 if t < 0.02 else 0.0)
        probe, held = Probe("w", (1.0, 0.2, 0.0), component=2), Clamped("left")
        body = plate(model, stiffness_damping=damping)
        run = execute(Scene("s", body, supports=held, loads=load, probes=probe, **times))
        found = [item.value for item in run.warnings if item.watch == "damped modes"]
        return run.history["w"].to_numpy(), found

    (exact, none), (modal, said) = (pushed(model) for model in ("exact", Modal(modes=4)))
    off = np.abs(modal - exact).max() / np.abs(exact).max()
    assert none == []
    assert (len(said) == 1) == warns == (off > 0.02)
    if warns:
        assert off / 3 < said[0] < 3 * off


def test_one_body_has_one_rate() -> None:
    first, second = plate(MODAL, mass_damping=1.0), replace(plate(MODAL), name="other")
    with pytest.raises(SceneError) as caught:
        Scene(
            "bad",
            (first, second),
            joins=Join("plate", "other", "left", "left"),
            scheme="ep",
            dt=1.0,
            t_end=1.0,
        )
    assert str(caught.value) == (
        "shell 'plate' and shell 'other' are one body in modes, and mass_damping of their sections "
        "is 1.0 and 0.0; it must be the same, or the model 'exact'"
    )
