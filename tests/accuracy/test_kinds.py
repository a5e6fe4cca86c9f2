"""Kinds of quantities whose companions agree or differ by chance, and their true errors."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from mpi4py import MPI

import numpy as np
import pandas as pd
import pytest

import shellmb as sm
from shellmb.accuracy.errors import add_errors
from shellmb.accuracy.family import with_steps
from shellmb.accuracy.modes import frequencies, mode_errors
from shellmb.accuracy.request.levels import Store, Target
from shellmb.accuracy.request.search import Running, Search
from shellmb.accuracy.studies.quantity import Quantity
from shellmb.running.execute import execute
from shellmb.running.natural_modes.vibration import natural_modes
from shellmb.scene import Scene
from shellmb.show.account import with_error
from tests.bench.errors.points import double_pendulum, pushed

SECTION = sm.RectangularSection(210e9, 0.3, width=0.02, height=0.01, density=7850)


def rod(elements: int, *held: str) -> Scene:
    beam = sm.Beam("rod", sm.Line((0, 0, 0), (1, 0, 0)), SECTION, elements=elements)
    supports = sm.Clamped(held) if held else ()
    return Scene("rod", beams=beam, supports=supports, scheme="ep", dt=1e-3, t_end=1e-2)


def test_modes_that_no_mesh_follows_are_not_believed() -> None:
    """The kind: elements half a wave long, and half of that, agree on a wrong frequency."""
    scene, world = rod(2, "start"), MPI.COMM_WORLD
    modes = natural_modes(scene, world, 6)
    errors = mode_errors(scene, modes, {}, False, None)
    found, said = errors.others, errors.remarks
    right = frequencies(natural_modes(rod(16, "start"), world, 6))
    for name, each in found.items():
        assert 1 <= each.error / abs(each.value - right[name]) <= 5, name
    assert len(said) == 1
    assert said[0].startswith("f6: the run on another mesh agrees much better")


def test_free_motions_are_zero_and_the_rest_is_round_off() -> None:
    scene = rod(2)
    found = mode_errors(scene, natural_modes(scene, MPI.COMM_WORLD, 7), {}, False, None).others
    assert all(0 <= abs(found[f"f{k}"].value) <= found[f"f{k}"].error for k in range(1, 7))
    assert found["f6"].error < 1e-4 * found["f7"].value


def oscillator(**options: object) -> Scene:
    """A mass on a spring that a load sets in motion, with corners at 0.05 s, 0.1 s and 0.2 s."""
    mass = sm.RigidBody("m", 1.0, (1, 1, 1))
    force = sm.Table([0.0, 0.05, 0.1, 0.2], [0.0, 1.0, 0.0, 0.0])
    given = {"scheme": "ep4", "dt": 1e-2, "t_end": 1.0} | options
    return Scene(
        "oscillator",
        rigid_bodies=mass,
        joints=sm.Prismatic("slide", sm.GROUND, "m", at=(0, 0, 0), axis=(1, 0, 0)),
        force_elements=sm.JointSpring("k", "slide", stiffness=100.0, coordinate="translation"),
        loads=sm.PointForce("center", (1.0, 0, 0), body="m", time=force),
        probes=sm.Probe("x", "center", component=0),
        **given,  # type: ignore[arg-type]
    )


def test_corners_that_steps_meet_are_met_by_companions() -> None:
    """The kind: a companion that steps over a corner of a load has another impulse than the run."""
    scene = oscillator()
    assert with_steps(scene, 3.0).step_control.times == (0.05, 0.1, 0.2)
    # finer steps meet them, and what the run steps over its companions may step over
    assert with_steps(scene, 0.5).step_control.times == ()
    assert with_steps(replace(scene, dt=0.03), 3.0).step_control.times == ()
    run = add_errors(execute(scene, pictures=False))
    fine, quantity = execute(replace(scene, dt=1e-3), pictures=False), Quantity("x", "l2")
    stated = run.summary["errors"]["probes"]["x:l2"]
    mine = quantity.take({}, run.history)
    true = quantity.difference(mine, quantity.take({}, fine.history)) * stated["value"]
    # 983 without
    assert 1 <= stated["error"] / true <= 10


@pytest.mark.parametrize(("norm", "sign"), [("max", 1.0), ("min", -1.0)])
def test_the_start_of_a_motion_from_rest_is_its_extreme(norm: str, sign: float) -> None:
    """The kind: a cubic through few values goes beyond the start, and its extreme is no error."""
    t = np.linspace(0.0, 1.0, 7)
    history = pd.DataFrame({"t": t, "x": -sign * t**2 * np.cos(4 * t) ** 2 - sign * t**3})
    assert Quantity("x", norm).take({}, history)["value"] == 0.0


def test_a_moment_under_a_point_force_has_no_limit_and_others_have() -> None:
    """The kind: resultants at singular points; half of what they are was stated as their error.

    Under the force the moment is a logarithm of the element's size: twice the elements add as much
    as the ones before did. Beside it the moment is that of a finer mesh within the error.
    """
    found = add_errors(execute(pushed((8, 8)), pictures=False)).summary["errors"]
    under, away = (found["probes"][f"m11_{where}:end"] for where in ("force", "away"))
    assert under["error"] is None and not under["converges"]
    assert with_error(under) == f"{under['value']:.6g} (does not converge)"
    fine = execute(pushed((32, 32)), pictures=False).column("m11_away")[-1]
    assert away["converges"] and abs(away["value"] - fine) <= away["error"]
    (said,) = found["remarks"]
    assert said.startswith("m11_force (l2, end, max): does not converge with finer meshes")


def test_what_does_not_converge_ends_a_request(tmp_path: Path) -> None:
    levels: list[str] = []
    how = Running(MPI.COMM_WORLD, tell=levels.append)
    asked = Target(accuracy=1e-2, of="m11_force:end")
    ended = Search(pushed((4, 4)), asked, Store(tmp_path, MPI.COMM_WORLD), how).run()
    assert not ended.met and len(ended.levels) == 2
    assert "m11_force:end does not converge" in ended.says


@pytest.mark.parametrize(
    ("scheme", "dt"), [("ep4", 0.02), pytest.param("ep", 0.01, marks=pytest.mark.slow)]
)
def test_chaos_is_covered_or_said(scheme: str, dt: float) -> None:
    """The kind: motions that any step makes another one; another step length is a reference."""
    scene = double_pendulum(scheme, dt, 6.0)
    found = add_errors(execute(scene, pictures=False)).summary["errors"]
    other = execute(double_pendulum("ep4", 2.5e-3, 6.0), pictures=False)
    mine = execute(scene, pictures=False)
    for name in ("bx", "bz"):
        t = mine.column("t")
        away = mine.column(name) - np.interp(t, other.column("t"), other.column(name))
        stated = found["probes"][f"{name}:l2"]["error"]
        assert stated is None or stated >= 0.9 * np.sqrt(np.mean(away**2))
    assert found["remarks"]
