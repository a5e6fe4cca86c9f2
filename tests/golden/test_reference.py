"""`assembler="reference"`: DOLFINx, NumPy and PETSc alone give what the native loops give.

Each scheme and each kind of body is run with the native room shut: neither its loops nor its
kernels can be had. Quick tests have two scenes; the others compile for a minute, and `.ci/run` has
them as a job of its own.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import pytest
import ufl
from dolfinx import fem
from dolfinx.mesh import create_unit_interval

from shellmb.native import kernels, library
from shellmb.native.operations import LoopPartSizes, PartSizes
from shellmb.native.reference import ComparedParts, ReferencePartSizes, compiled_form
from shellmb.running.execute import execute
from shellmb.running.natural_modes.vibration import natural_modes
from shellmb.scene import EnclosedVolume, Gas, InitialVelocity, PathFollowing, Pressure, Scene
from shellmb.system.nullspace.directors import orthonormal, rotated
from tests.contact.test_faces import plates
from tests.golden import runs, scenes
from tests.model.test_volumes import ball, octant

# as for histories that are frozen: the worst that was seen is 8e-13
BOUND = 1e-10
QUICK = ("beam static", "beam ed")
SLOW = ("shell ep", "shell ep4", "shell ed3", "shell generalized-alpha", "chain ep4", "chain ed3")
SLOW += ("joint ed", "contact ep4", "modal ep", "hyperelastic ep")
RANDOM = np.random.default_rng(0)


def shut(*_: object, **__: object) -> None:
    raise AssertionError("the reference asks for what is native")


@pytest.fixture
def alone(monkeypatch) -> None:
    """Shut the native room."""
    for name in ("cells", "_module"):
        monkeypatch.setattr(library, name, shut)
    monkeypatch.setattr(kernels, "summed", shut)


def by_reference(scene: Scene) -> Scene:
    return replace(scene, solver=replace(scene.solver, assembler="reference"))


@pytest.mark.parametrize("name", [*QUICK, *(pytest.param(n, marks=pytest.mark.slow) for n in SLOW)])
def test_runs_are_those_of_the_loops(name: str, alone, monkeypatch) -> None:
    make = scenes.SCENES[name]
    monkeypatch.setitem(runs.SCENES, name, lambda: by_reference(make()))
    apart = runs.differences(runs.history(name), runs.frozen()[name])
    worst = max(apart, key=apart.__getitem__)
    assert apart[worst] < BOUND, worst


FLYING = InitialVelocity(linear=(0.1, -0.2, 0.3), spin=(1.0, 2.0, -1.5))
GAS = EnclosedVolume("gas", gas=Gas(5.0, ambient=1.0))
# what no frozen run has
OTHERS = {
    "faces": lambda: plates(t_end=6e-4, dt=2e-4),
    "volume": lambda: ball(volumes=GAS, initial=FLYING, scheme="ep", dt=0.02, t_end=0.04),
    "path": lambda: octant(loads=Pressure(1.0), path=PathFollowing(load_end=2.0), scheme="static"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", OTHERS)
def test_other_features_need_no_loops(name: str, request: pytest.FixtureRequest) -> None:
    native = execute(OTHERS[name](), pictures=False).history
    request.getfixturevalue("alone")
    found = execute(by_reference(OTHERS[name]()), pictures=False).history
    for column in native.columns.drop(["wall_s", "iterations"]):
        size = native[column].abs().max()
        np.testing.assert_allclose(found[column], native[column], atol=BOUND * max(size, 1.0))


@pytest.mark.slow
def test_modes_are_those_of_the_loops(monkeypatch) -> None:
    scene = scenes.SCENES["beam static"]()
    native = natural_modes(scene, count=4).omega2
    with monkeypatch.context() as patch:
        for name in ("cells", "_module"):
            patch.setattr(library, name, shut)
        found = natural_modes(by_reference(scene), count=4).omega2
    # eigenvalues by a Krylov method that ends at 1e-8
    np.testing.assert_allclose(found, native, rtol=1e-7)


@pytest.mark.mpi
@pytest.mark.slow
def test_two_ranks_are_one(mpirun) -> None:
    source = (
        f"import sys; sys.path.insert(0, {str(Path(__file__).parents[2])!r}); "
        "from dataclasses import replace; from tests.golden import runs, scenes; "
        "make = scenes.SCENES['beam ed']; scene = make(); "
        "runs.SCENES['beam ed'] = lambda: replace(scene, "
        "solver=replace(scene.solver, assembler='reference')); runs.main(['beam ed'])"
    )
    (line,) = mpirun(2, "-c", source).splitlines()
    assert float(line.removeprefix("beam ed: ").split()[0]) < BOUND


def test_what_was_killed_is_compiled_again(tmp_path, monkeypatch) -> None:
    """A process that ended while it compiled leaves a source that FFCx would wait for."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    dx = ufl.Measure("dx", create_unit_interval(MPI.COMM_SELF, 1))
    form = fem.Constant(dx.ufl_domain(), 2.0) * dx
    for _ in range(2):
        assert fem.assemble_scalar(compiled_form(form)) == pytest.approx(2.0)
        (source,) = tmp_path.glob("shellmb/reference/*.c")
        source.with_suffix(".c.cached").unlink()
        source.write_text("cut of")


@pytest.mark.parametrize("directors", [1, 3])
def test_directors_turn_alike(directors: int) -> None:
    """Orthonormal ones and changes near and beyond the bound, by C and by NumPy."""
    d = np.linalg.qr(RANDOM.normal(size=(20, 3, 3)))[0][:, :directors].reshape(20, -1).copy()
    change = 0.05 * RANDOM.normal(size=d.shape)
    change[3] *= 10
    lib, zero, places = library.cells().lib, np.zeros(d.shape), np.arange(d.size)
    members = library.longs(places), library.cells().ffi.NULL, library.doubles(zero)
    given = library.CArrays().many("Turning", [(20, directors, *members)])
    x, dx = d.copy(), -change
    far = lib.turn_nodes(given, library.doubles(x), library.doubles(dx), 0.3)
    found, any_far = rotated(d, change, 0.3)
    assert far > 0 and any_far
    np.testing.assert_allclose(x - dx, found, atol=1e-14)
    x = d + 0.01 * change
    expected = orthonormal(x)
    lib.normalise_nodes(given, library.doubles(x))
    np.testing.assert_allclose(x, expected, atol=1e-14)


@pytest.mark.parametrize("moves", [0.0, 2.0])
@pytest.mark.parametrize("spoilt", [0.0, np.nan, np.inf])
def test_sizes_of_parts_are_alike(spoilt: float, moves: float) -> None:
    """Parts with and without a bound, an empty one, and one with what is no number."""
    ends, entries = np.array([0, 4, 4, 9]), np.array([3, 1, 7, 0, 2, 4, 5, 6, 8])
    scales, bounds = np.array([1.0, 0.5, 1e-3]), np.array([0.3, np.inf, np.inf])
    values = RANDOM.normal(size=(3, 9))
    values[1, 4] += spoilt

    def all_of(sizes: PartSizes) -> list[np.ndarray]:
        table = np.zeros((3, 3))
        sizes.largest(values[0], table[0])
        sizes.largest(values[1:], table[1:])
        sizes.table[:] = table[2], table[0]
        sizes.relate()
        apart = [sizes.table.copy(), sizes.found.copy()]
        sizes.fill(*(PETSc.Vec().createWithArray(each) for each in values[:2]))
        sizes.relate()
        return [table, *apart, sizes.table, sizes.found, sizes.relative(table[0], table[1:])]

    weights = np.array([1.0, 0.3, 0.0])
    given = ComparedParts(ends, entries, scales, bounds, weights, moves / scales, 0.5)
    parts = [kind(given) for kind in (LoopPartSizes, ReferencePartSizes)]
    for one, other in zip(*map(all_of, parts), strict=True):
        np.testing.assert_array_equal(one, other)
