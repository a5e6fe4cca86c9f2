"""Bodies with linear strains against exact ones: frequencies, laws, and the square of rotations."""

from functools import cache
from typing import Any

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import numpy as np
import pytest

from shellmb.errors import SceneError
from shellmb.running.execute import RunResult, execute
from shellmb.running.natural_modes.vibration import natural_modes
from shellmb.running.resume import resume
from shellmb.scene import (
    Beam,
    Clamped,
    Gravity,
    InitialVelocity,
    Isotropic,
    Line,
    Modal,
    PathFollowing,
    PointForce,
    Probe,
    Rectangle,
    RectangularSection,
    Scene,
    Shell,
)
from shellmb.simulate.simulation import BaseObserver, Simulation
from tests.reduced.conftest import Kept, kept

PLATE = Isotropic(E=70e9, nu=0.3, thickness=5e-3, density=2700.0)
BAR = RectangularSection(E=70e9, nu=0.3, width=0.01, height=0.02, density=2700.0)
CORNER, TIP = (1.0, 0.4, 0.0), (1.0, 0.0, 0.0)
SLOW = pytest.mark.slow
LATER = [pytest.param(*pair, marks=SLOW) for pair in (("ed", 1.0), ("ep4", 0.0), ("ed3", 0.5))]
SCHEMES = [("ep", 0.0), *LATER]


def body(kind: str, model: Any) -> dict[str, Any]:
    """A plate, or a bar that is one metre long, too."""
    if kind == "plate":
        return {"shells": Shell(kind, Rectangle(1.0, 0.4), PLATE, mesh=(4, 2), model=model)}
    line = Line((0, 0, 0), TIP)
    return {"beams": Beam(kind, line, BAR, elements=4, up=(0, 0, 1), model=model)}


def thrown(t: float) -> float:
    """A push at a tip, over after 0.05 s."""
    return float(np.sin(np.pi * t / 0.05) ** 2) if t < 0.05 else 0.0


@cache
def tumbling(
    kind: str, model: Any, scheme: str = "ep", alpha: float = 0.0, push: float = 1.0
) -> Kept:
    """A body in flight that is pushed as it spins; less push, less spin."""
    at = CORNER if kind == "plate" else TIP
    probes = [Probe(f"{q}_{k}", at, q, k) for q in ("position", "velocity") for k in range(3)]
    spin = InitialVelocity((1.0, 0.0, 0.0), (3.0 * push, push, 2.0 * push), (0.5, 0.2, 0.0))
    force = PointForce(at, (0.0, 2.0 * push, 20.0 * push), time=thrown)
    motion = {"initial": spin, "loads": (force, Gravity()), "probes": probes}
    times = {"scheme": scheme, "alpha": alpha, "dt": 5e-3, "t_end": 0.1}
    return kept(Scene("tumbling", **body(kind, model), **motion, **times))


@pytest.mark.parametrize("kind", ["plate", "bar"])
@pytest.mark.parametrize("held", [False, pytest.param(True, marks=SLOW)])
def test_frequencies_are_those_of_the_exact_body(kind, held) -> None:
    """At rest both have the same tangent, whatever the frame: round-off of eigenvalues."""
    where = "left" if kind == "plate" else "start"
    more = {"scheme": "ep", "dt": 1.0, "t_end": 1.0, "supports": Clamped(where) if held else ()}
    scenes = [Scene("modes", **body(kind, model), **more) for model in ("exact", "floating-frame")]
    found = [natural_modes(scene, count=6 if held else 12) for scene in scenes]
    assert found[0].rigid == found[1].rigid == (0 if held else 6)
    elastic = slice(found[0].rigid, None)
    assert np.allclose(found[1].omega[elastic], found[0].omega[elastic], rtol=1e-8, atol=0)


@pytest.mark.parametrize("kind", ["plate", "bar"])
@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_every_scheme_keeps_its_laws(kind, scheme, alpha) -> None:
    summary = tumbling(kind, "floating-frame", scheme, alpha).summary
    # Newton's tolerance is 1e-9
    assert summary["energy_balance_error"] < 1e-10
    assert summary["constraint_max"] < 1e-12
    assert summary["linear_momentum_drift"] < 1e-12
    # EP keeps it; ED, EP4 and ED3 to their order, with 0.02 rad in a step
    bound = {"ep": 1e-10, "ed": 1e-2, "ep4": 1e-6, "ed3": 1e-5}[scheme]
    assert summary["angular_momentum_drift"] < bound


def apart(kind: str, push: float, scheme: str = "ep") -> tuple[float, float]:
    """Largest differences of positions of the linear and of the rigid body from the exact one."""
    names = [f"position_{k}" for k in range(3)]
    exact, linear, rigid = (
        tumbling(kind, model, scheme, 0.0, push).history[names].to_numpy()
        for model in ("exact", "floating-frame", "rigid")
    )
    return float(np.abs(linear - exact).max()), float(np.abs(rigid - exact).max())


@pytest.mark.parametrize("kind", ["plate", pytest.param("bar", marks=SLOW)])
def test_is_off_by_the_square_of_what_it_bends(kind) -> None:
    half, bends = apart(kind, 0.5)
    full, _ = apart(kind, 1.0)
    assert full < 0.02 * bends
    # the square of the rotations, and what the spin stiffens: the third power
    assert 3.0 < full / half < 9.0


def bent(model: Any, scheme: str = "static") -> RunResult:
    """A cantilever under a force at its tip that bends it far, or by a few degrees."""
    force = PointForce(TIP, (0, 0, 300.0))
    held = {"supports": Clamped("start"), "loads": force, "probes": Probe("tip", TIP, component=2)}
    return execute(Scene("bent", **body("bar", model), **held, scheme=scheme, dt=1.0))


def test_far_from_its_frame_it_is_wrong_and_says_so() -> None:
    exact, linear, small = (
        bent(model, scheme).history["tip"].iloc[-1]
        for model, scheme in (
            ("exact", "static"),
            ("floating-frame", "static"),
            ("exact", "linear-statics"),
        )
    )
    # the force keeps its direction, and the frame turns by half of what the tip does
    assert exact < linear < small
    assert linear > 1.02 * exact
    turned, stiffer = bent("floating-frame").warnings
    assert "beam 'bar' has linear strains and turns by" in turned.says
    assert turned.says.endswith("use model='exact'")
    # beside displacements from the rest
    assert stiffer.value == pytest.approx(small / exact - 1, rel=0.1)
    assert not bent("exact").warnings


@pytest.mark.parametrize("kind", ["plate", pytest.param("bar", marks=SLOW)])
def test_its_path_by_arc_length_is_that_by_load_steps(kind) -> None:
    """To the tolerance of the load at its end, 1e-9."""
    force = PointForce(CORNER if kind == "plate" else TIP, (0, 0, 10.0))
    probe = Probe("tip", force.at, component=2)
    held = {"supports": Clamped("left" if kind == "plate" else "start"), "probes": probe}
    more = {**body(kind, "floating-frame"), **held, "loads": force, "scheme": "static", "dt": 0.25}
    steps = execute(Scene("steps", **more)).history
    path = PathFollowing(load_end=1.0)
    along = execute(Scene("path", **more, path=path, t_end=50.0)).history
    assert along["load_factor"].iloc[-1] == pytest.approx(1.0, abs=2e-9)
    assert along["tip"].iloc[-1] == pytest.approx(steps["tip"].iloc[-1], rel=1e-8)
    assert (along["unstable"] == 0).all()


class Stop(BaseObserver):
    """Stops a run after some steps."""

    def accepted(self, simulation: Simulation) -> None:
        """A step is taken."""
        if simulation.step == 4:
            raise KeyboardInterrupt


@pytest.mark.parametrize("model", ["floating-frame", pytest.param(Modal(modes=8), marks=SLOW)])
def test_a_run_that_was_stopped_ends_as_one_that_was_not(model, tmp_path) -> None:
    """But for the factors that are kept between steps; what is watched is kept, too."""
    force = PointForce(CORNER, (0.0, 2.0, 20.0), time=thrown)
    motion = {"initial": InitialVelocity(spin=(30.0, 1.0, 2.0)), "loads": force}
    scene = Scene("tumbling", **body("plate", model), **motion, scheme="ep", dt=5e-3, t_end=0.05)
    whole = execute(scene)
    with pytest.raises(KeyboardInterrupt):
        execute(scene, tmp_path / "run", pictures=False, observers=[Stop()])
    found = resume(tmp_path / "run", pictures=False, scene=scene)
    for name, array in whole.simulation.arrays().items():
        other = found.simulation.arrays()[name]
        # the iteration leaves 1e-15 of each part; velocities are differences over 5e-3 s
        np.testing.assert_allclose(other, array, rtol=1e-9, atol=1e-10 * np.abs(array).max())
    says = [item.says for item in whole.warnings]
    assert says and [item.says for item in found.warnings] == says


def test_spin_that_would_stiffen_it_is_said() -> None:
    """Its lowest frequency is 22.37 sqrt(E h^2/(12 rho)) / L^2 = 329 rad/s."""

    def said(rate: float) -> list[str]:
        given = {"initial": InitialVelocity(spin=(0.0, 0.0, rate)), "scheme": "ep", "dt": 5e-3}
        run = execute(Scene("spin", **body("bar", "floating-frame"), **given, t_end=0.02))
        return [item.says for item in run.warnings if "spins at" in item.says]

    (text,) = said(60.0)
    assert "spins at 60 rad/s" in text and "0.18 of its lowest frequency" in text
    assert not said(6.0)


def test_velocities_of_many_nodes_fit_into_the_workspace() -> None:
    """The frame's multiplier sees all of them, with forces 1e16 of their masses."""
    shell = Shell("plate", Rectangle(1.0, 0.4), PLATE, mesh=(32, 8), model="floating-frame")
    spin = InitialVelocity(spin=(3.0, 1.0, 2.0))
    run = execute(Scene("many", shell, initial=spin, scheme="ep", dt=5e-3, t_end=5e-3))
    assert run.summary["energy_balance_error"] < 1e-10


def test_small_displacements_are_the_same_of_both() -> None:
    """Forms that are linearised in space are so about the reference, whatever the frame."""
    exact, linear = (
        bent(m, "linear-statics").history["tip"].iloc[-1] for m in ("exact", "floating-frame")
    )
    assert linear == pytest.approx(exact, rel=1e-9)


def test_strains_of_its_own_are_refused() -> None:
    with pytest.raises(SceneError) as caught:
        Shell("plate", Rectangle(1.0, 0.4), PLATE, model="floating-frame", strains=print)
    assert str(caught.value) == (
        "shell 'plate': model is 'floating-frame', and it has strains of its own; they must be "
        "left out, or the model must be 'exact'"
    )


def test_other_words_are_refused() -> None:
    with pytest.raises(SceneError, match=r"'floating-frame', Modal\(modes=10\) or 'rigid'"):
        Shell("plate", Rectangle(1.0, 0.4), PLATE, model="linearised")
