"""Scenes written by hand in plain DOLFINx move as those of the package do.

`demos/weak_form_by_hand.py` (a plate; EP and EP4) and `demos/mechanism_by_hand.py` (a curved shell
on an arm; ED and joints) have their own strains, sections, rows and Newton's method, all unknowns
in one matrix. They are the oracle of what the package assembles, eliminates and projects.
"""

import ast
import importlib
import inspect
import math
import sys
import warnings
from dataclasses import replace

import numpy as np
import pytest

from shellmb.demos import sudden_load
from shellmb.running.execute import execute
from shellmb.scene import (
    Cylinder,
    Gravity,
    Isotropic,
    Probe,
    Revolute,
    RigidBody,
    Scene,
    Shell,
    ShellRevolute,
    Solver,
)

STEPS = 20


def program(name: str):
    """A program of the demos."""
    pytest.importorskip("dolfinx.nls.petsc", reason="this DOLFINx has no NewtonSolver")
    # DOLFINx says so of its solver, and of that of the package only on stderr
    warnings.filterwarnings("ignore", "dolfinx.nls.petsc.NewtonSolver is deprecated")
    return importlib.import_module(f"shellmb.demos.{name}")


@pytest.fixture
def by_hand():
    return program("weak_form_by_hand")


@pytest.fixture
def mechanism():
    return program("mechanism_by_hand")


def package(scheme: str) -> Scene:
    """The scene with Newton's method to round-off, and all of the tip's displacement."""
    scene = sudden_load.scene()
    at = (sudden_load.LENGTH, sudden_load.WIDTH / 2, 0.0)
    return replace(
        scene,
        scheme=scheme,
        t_end=STEPS * scene.dt,
        probes=[Probe(f"u{k}", at, component=k) for k in range(3)],
        solver=Solver(tolerance=1e-12),
    )


@pytest.mark.parametrize("scheme", ["ep", "ep4"])
def test_twenty_steps_are_those_of_the_package(scheme: str, by_hand) -> None:
    ours = execute(package(scheme))
    found = np.column_stack([ours.column(f"u{k}")[1:] for k in range(3)])
    expected = by_hand.tip_history(getattr(by_hand, scheme), STEPS)
    # of each component by itself: the tip moves by 3 mm across and by 3 um along the strip; round-
    # off of matrices whose entries are up to 1e8 apart makes 1e-12 of it
    for k in (0, 2):
        apart = np.abs(found[:, k] - expected[:, k]).max() / np.abs(expected[:, k]).max()
        assert apart < 1e-10, k
    assert np.abs(found[:, 1]).max() < 1e-10 * np.abs(expected[:, 2]).max()


def package_mechanism(m) -> Scene:
    """The shell on its arm with the numbers of the program."""
    surface = Cylinder(
        m.RADIUS, m.LENGTH, (0, math.degrees(m.ANGLE)), axis=(1, 0, 0), start=(0, 0, 1)
    )
    rubber = Isotropic(E=m.E, nu=m.NU, thickness=m.THICK, density=m.RHO)
    along, across, up = m.EULER
    inertia = (across + up, along + up, along + across)
    arm = RigidBody("arm", m.MASS, inertia, position=tuple((m.CORNER + m.HINGE) / 2))
    seen = {"u": (tuple(m.points[-1]), "shell"), "x": ("center", "arm")}
    return Scene(
        "mechanism",
        Shell("shell", surface, rubber, mesh=(2, 1)),
        rigid_bodies=arm,
        joints=(
            Revolute("hinge", "ground", "arm", at=tuple(m.HINGE), axis=m.AXIS),
            ShellRevolute("joint", "arm", "shell", at=tuple(m.CORNER)),
        ),
        loads=Gravity(m.GRAVITY),
        probes=[
            Probe(f"{name}{k}", at, component=k, body=body)
            for name, (at, body) in seen.items()
            for k in range(3)
        ],
        scheme="ed",
        alpha=m.ALPHA,
        dt=m.DT,
        t_end=STEPS * m.DT,
        solver=Solver(tolerance=1e-12),
    )


def test_twenty_steps_of_a_mechanism_are_those_of_the_package(mechanism) -> None:
    """ED with both equations (31), eq. (35), a revolute joint, a director that turns at rest."""
    ours = execute(package_mechanism(mechanism))
    seen = [ours.column(f"{name}{k}")[1:] for name in "ux" for k in range(3)]
    # the potential of the weights is counted as their work
    energy = (ours.column("total_energy") - ours.column("work_loads"))[1:]
    found = np.column_stack([*seen, energy, np.diff(ours.column("dissipation"))])
    expected = mechanism.history(STEPS)
    apart = np.abs(found - expected).max(axis=0) / np.abs(expected).max(axis=0)
    # seen: 2e-14 of motion, 5e-13 of what is dissipated
    assert apart.max() < 1e-10, apart
    # eqs. (33), (34): all that is lost is what the jumps dissipate, to round-off of the energies
    lost = np.diff(expected[:, 6]) + expected[1:, 7]
    assert np.abs(lost).max() < 1e-13 * ours.column("kinetic_energy").max()
    # far enough that nothing of it is small: the far corner falls by nearly a third of the radius
    assert np.abs(expected[-1, 2]) > 0.3 * mechanism.RADIUS
    assert expected[-1, 6] < -0.9 * expected[:, 7].sum() < 0


def lines_and_imports(module) -> tuple[int, list[str]]:
    """Number of lines of a program, and what it imports of shellmb."""
    source = inspect.getsource(module)
    nodes = [n for n in ast.walk(ast.parse(source)) if isinstance(n, ast.ImportFrom | ast.Import)]
    names = [getattr(n, "module", None) or n.names[0].name for n in nodes]
    return source.count("\n"), [name for name in names if name.startswith("shellmb")]


def test_each_is_one_page_without_the_package(by_hand, mechanism) -> None:
    """A reader has few lines; numbers of the scene and the space of forces come from elsewhere."""
    lines, imported = lines_and_imports(by_hand)
    forces = "shellmb.meshes.tying"
    assert lines <= 200 and imported == ["shellmb.demos.sudden_load", forces]
    assert sys.modules["shellmb.demos.sudden_load"] is sudden_load
    lines, imported = lines_and_imports(mechanism)
    assert lines <= 250 and imported == [forces]
