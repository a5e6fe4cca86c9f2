"""FFCx as it is and as we use it: the same code, with and without the search that is replaced."""

import inspect
import re

from mpi4py import MPI

import basix.ufl
import dolfinx.mesh
import pytest
import ufl
from dolfinx import fem
from ffcx.ir.analysis.valuenumbering import ValueNumberer

from shellmb.native.compiling import generated
from shellmb.native.compiling.flags import KERNEL_FLAGS, LANES_FLAGS


@pytest.fixture(scope="module")
def form() -> ufl.Form:
    mesh = dolfinx.mesh.create_unit_square(MPI.COMM_SELF, 1, 1)
    element = basix.ufl.element("Lagrange", "triangle", 2, shape=(3,))
    u = fem.Function(fem.functionspace(mesh, element))
    test = ufl.TestFunction(u.function_space)
    stretch = ufl.dot(u.dx(0), u.dx(0)) - 1
    return ufl.derivative(stretch**2 * ufl.exp(stretch) * ufl.dx, u, test)


def body(code: str) -> list[str]:
    """Lines of code but comments; names of tables follow the order in which Python hashes."""
    return sorted(line for line in code.splitlines() if not line.startswith("//"))


@pytest.mark.parametrize("flags", [KERNEL_FLAGS, LANES_FLAGS], ids=["one cell", "several"])
def test_without_the_index_the_code_is_the_same(form, flags, monkeypatch) -> None:
    assert generated.searches(), "the FFCx of uv.lock has the lines that are replaced"
    used = []
    own = generated._node_symbols
    monkeypatch.setattr(generated, "_node_symbols", lambda *a: used.append(1) or own(*a))
    quick = generated.code(form, "form_x", flags)
    assert used and ValueNumberer.get_node_symbols.__name__ == "get_node_symbols"
    used.clear()
    monkeypatch.setattr(generated, "searches", lambda: False)
    assert body(generated.code(form, "form_x", flags)) == body(quick)
    assert not used


def without_index(numberer, expression):
    """Another FFCx may find symbols in another way."""
    return numberer.V_symbols[
        [v["expression"] for v in numberer.G.nodes.values()].index(expression)
    ]


def test_another_ffcx_is_left_as_it_is(form, monkeypatch) -> None:
    quick = generated.code(form, "form_x", KERNEL_FLAGS)
    monkeypatch.setattr(ValueNumberer, "get_node_symbols", without_index)
    assert not generated.searches()
    assert body(generated.code(form, "form_x", KERNEL_FLAGS)) == body(quick)
    assert ValueNumberer.get_node_symbols is without_index


def test_one_without_the_method_or_without_its_source_too(monkeypatch) -> None:
    def no_source(_):
        raise OSError("could not get source code")

    with monkeypatch.context() as patch:
        patch.setattr(inspect, "getsource", no_source)
        assert not generated.searches()
    monkeypatch.delattr(ValueNumberer, "get_node_symbols")
    assert not generated.searches()


def test_loops_over_the_nodes_of_a_cell_are_fused(form) -> None:
    """Values of all unknowns in one loop for each point: FFCx has one loop for each of them."""
    code = generated.code(form, "form_x", KERNEL_FLAGS)
    (loop,) = re.findall(r"for \(int iq = 0.*?// Section: Intermediates", code, re.DOTALL)
    assert loop.count("for (int ic") == 1
