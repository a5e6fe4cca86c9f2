"""The shell of `sudden_load` written by hand in plain DOLFINx moves as the package's does.

`demos/weak_form_by_hand.py` has its own strains, sections, rows and Newton's method, all unknowns
in one matrix. It is the oracle of what the package assembles, eliminates and projects.
"""

import ast
import importlib
import inspect
import sys
import warnings
from dataclasses import replace

import numpy as np
import pytest

from shellmb.demos import sudden_load
from shellmb.running.execute import execute
from shellmb.scene import Probe, Scene, Solver

STEPS = 20


@pytest.fixture
def by_hand():
    pytest.importorskip("dolfinx.nls.petsc", reason="this DOLFINx has no NewtonSolver")
    # DOLFINx says so of its solver, and of that of the package only on stderr
    warnings.filterwarnings("ignore", "dolfinx.nls.petsc.NewtonSolver is deprecated")
    return importlib.import_module("shellmb.demos.weak_form_by_hand")


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


def test_it_is_one_page_without_the_package(by_hand) -> None:
    """A reader has at most 200 lines, and only the numbers of the scene come from elsewhere."""
    source = inspect.getsource(by_hand)
    assert source.count("\n") <= 200
    imported = [
        node.module or ""
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.ImportFrom)
    ]
    assert [m for m in imported if m.startswith("shellmb")] == ["shellmb.demos.sudden_load"]
    assert sys.modules["shellmb.demos.sudden_load"] is sudden_load
