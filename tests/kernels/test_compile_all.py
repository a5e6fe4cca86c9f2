"""Forms compiled side by side are found again, and are right."""

from mpi4py import MPI

import dolfinx.mesh
import numpy as np
import pytest
import ufl
from dolfinx import fem

from shellmb.errors import RunError
from shellmb.native import kernels
from shellmb.native.compiling import compiler

pytestmark = pytest.mark.usefixtures("compiled_forms")


@pytest.fixture
def forms(tmp_path, monkeypatch):
    """A linear and a bilinear form and a number, and a cache of their own."""
    monkeypatch.setitem(kernels.JIT_OPTIONS, "cache_dir", str(tmp_path / "cache"))
    mesh = dolfinx.mesh.create_unit_interval(MPI.COMM_SELF, 3)
    space = fem.functionspace(mesh, ("Lagrange", 1))
    test, trial = ufl.TestFunction(space), ufl.TrialFunction(space)
    size = fem.Constant(mesh, 3.0)
    return [size * ufl.dx(mesh), test * ufl.dx, size * trial * test * ufl.dx, test * ufl.dx]


def test_what_is_compiled_is_found_again(forms):
    told = []
    with kernels.told(lambda *numbers: told.append(numbers)):
        number, vector, matrix, again = kernels.compile_all(forms)
    # of two that are alike one is compiled
    assert told == [(1, 3), (2, 3), (3, 3)]
    assert kernels.kernel_name(vector) == kernels.kernel_name(again)
    assert fem.assemble_scalar(number) == pytest.approx(3.0)
    ones = np.ones(4)
    assert fem.assemble_vector(vector).array @ ones == pytest.approx(1.0)
    assert ones @ fem.assemble_matrix(matrix).to_dense() @ ones == pytest.approx(3.0)
    with kernels.told(lambda *numbers: told.append(numbers)):
        kernels.compile_all(forms)
    assert len(told) == 3, "they are in the cache now"


def test_what_fails_is_said_and_does_not_block_the_cache(forms, monkeypatch):
    monkeypatch.setenv("CC", "gcc --no-such-option")
    with pytest.raises(RunError, match="compiler fails: gcc --no-such-option"):
        kernels.compile_all(forms)
    monkeypatch.setenv("CC", "/nowhere/cc")
    with pytest.raises(RunError, match=r"no C compiler '/nowhere/cc'.*install"):
        kernels.compile_all(forms)
    monkeypatch.delenv("CC")
    number, *_ = kernels.compile_all(forms)
    assert fem.assemble_scalar(number) == pytest.approx(3.0)


def test_the_largest_comes_first(forms, tmp_path, monkeypatch):
    written = []
    monkeypatch.setattr(compiler, "_make_libraries", lambda *_: None)
    monkeypatch.setattr(compiler, "code", lambda form, *_: written.append(form) or "")
    named = {kernels.module_name(form): (form, []) for form in forms}
    compiler.compile_new(named, tmp_path, lambda *_: None)
    assert [len(form.arguments()) for form in written] == [2, 1, 0]


@pytest.mark.parametrize("links", [True, False])
def test_small_kernels_share_a_library_that_has_the_names_of_all(forms, links, monkeypatch):
    if not links:

        def refused(*_):
            raise OSError("no links here")

        monkeypatch.setattr("pathlib.Path.hardlink_to", refused)
    number, vector, *_ = kernels.compile_all(forms)
    names = [kernels.kernel_name(form) for form in (number, vector)]
    files = [compiler.library(kernels.cache_folder(), name) for name in names]
    assert files[0].samefile(files[1]) == links
    assert files[0].read_bytes() == files[1].read_bytes()
    assert fem.assemble_scalar(number) == pytest.approx(3.0)
    assert not [p for p in kernels.cache_folder().iterdir() if p.suffix not in (".c", ".so")]
