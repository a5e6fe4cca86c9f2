"""C code of forms and expressions by FFCx, in less time, and with fewer loops."""

import gc
import inspect
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from mpi4py import MPI as _MPI  # noqa: F401  (before dolfinx)

from dolfinx import default_scalar_type
from ufl import Form

from shellmb.native.compiling.flags import Item, has_lanes

# Lines of FFCx's that the replacement below stands for, by what has them
SEARCH = 'idx = [i for i, v in self.G.nodes.items() if v["expression"] == expr][0]'
INDEX = "G.e2i = _count_nodes_with_unique_post_traversal(expressions, skip_terminal_modifiers)"


def code(item: Item, name: str, flags: Sequence[str]) -> str:
    """The C code of the kernels of a form or an expression, as FFCx makes it.

    Args:
        item: The form; or the expression and its points.
        name: What it is called there.
        flags: The C compiler's, which tell whether kernels are of several cells.
    """
    # needed for new kernels only
    import ffcx.compiler

    from shellmb.native.compiling import language

    chosen: dict[str, Any] = {"scalar_type": default_scalar_type, "language": language.__name__}
    if has_lanes(flags):
        assert isinstance(item, Form)
        (cell,) = {domain.ufl_coordinate_element() for domain in item.ufl_domains()}
        chosen[language.CELL_NODES] = cell.dim // cell.block_size
    options = ffcx.options.get_options(chosen)
    with _collector_at_rest(), _indexed():
        made, _ = ffcx.compiler.compile_ufl_objects([item], namespace=name, options=options)
    return str(made[1])


@contextmanager
def _collector_at_rest() -> Iterator[None]:
    """Python's garbage collector looks at nothing meanwhile.

    FFCx makes objects by the million, few of them in circles; to look at them takes a quarter of
    its time (docs/theory/built.md).
    """
    works = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if works:
            gc.enable()


@contextmanager
def _indexed() -> Iterator[None]:
    """FFCx finds the symbols of a node by its graph's own index meanwhile, and not by a search.

    FFCx 0.11 compares a node with all others: 50 s of the 58 s for the residual of a hyperelastic
    shell in `ed3`. An FFCx that has other lines there is left as it is; the code that comes out is
    the same either way.
    """
    from ffcx.ir.analysis.valuenumbering import ValueNumberer

    if not searches():
        yield
        return
    searching = ValueNumberer.get_node_symbols
    ValueNumberer.get_node_symbols = _node_symbols  # type: ignore[method-assign]
    try:
        yield
    finally:
        ValueNumberer.get_node_symbols = searching  # type: ignore[method-assign]


def searches() -> bool:
    """Decide whether FFCx has the lines that `_indexed` replaces."""
    from ffcx.ir.analysis import graph, valuenumbering

    try:
        search = inspect.getsource(valuenumbering.ValueNumberer.get_node_symbols)
        return SEARCH in search and INDEX in inspect.getsource(graph)
    except (AttributeError, OSError, TypeError):
        # no such method, or none with a source
        return False


def _node_symbols(numberer: Any, expression: Any) -> Any:
    """Symbols of a node of FFCx's graph."""
    return numberer.V_symbols[numberer.G.e2i[expression]]
