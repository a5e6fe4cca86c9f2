"""C code of forms and expressions by FFCx, in less time, and with fewer loops."""

import importlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial, singledispatchmethod
from typing import Any

from mpi4py import MPI as _MPI  # noqa: F401  (before dolfinx)

from dolfinx import default_scalar_type
from ufl import Form
from ufl.classes import ComplexValue, Conj, CoordinateDerivative, Imag, Real
from ufl.corealg.traversal import unique_pre_traversal

from shellmb.collecting import seldom
from shellmb.compiling.flags import Item, has_lanes

# Steps of UFL that rebuild a form without some nodes, and these nodes
REBUILDING: dict[str, tuple[type, ...]] = {
    "remove_complex_nodes": (Conj, Real, Imag, ComplexValue),
    "apply_coordinate_derivatives": (CoordinateDerivative,),
}


def code(item: Item, name: str, flags: Sequence[str]) -> str:
    """The C code of the kernels of a form or an expression, as FFCx makes it.

    Args:
        item: The form; or the expression and its points.
        name: What it is called there.
        flags: The C compiler's, which tell whether kernels are of several cells.
    """
    # needed for new kernels only
    import ffcx.codegeneration.integral_generator as generator
    import ffcx.compiler
    from ffcx.ir.analysis.valuenumbering import ValueNumberer

    from shellmb.compiling import lanes

    ValueNumberer.get_node_symbols = _node_symbols  # type: ignore[method-assign]
    generator.optimize = _fused  # type: ignore[assignment,attr-defined]
    chosen: dict[str, Any] = {"scalar_type": default_scalar_type}
    if has_lanes(flags):
        chosen["language"] = lanes.__name__
        assert isinstance(item, Form)
        (cell,) = {domain.ufl_coordinate_element() for domain in item.ufl_domains()}
        chosen[lanes.NODES] = cell.dim // cell.block_size
    options = ffcx.options.get_options(chosen)
    made, _ = ffcx.compiler.compile_ufl_objects([item], namespace=name, options=options)
    return str(made[1])


def _fused(sections: Any, rule: Any) -> Any:
    """Code with one loop over the nodes of a cell for all values of unknowns, and for all entries.

    FFCx fuses such loops only of what it calls a coefficient, and DOLFINx's are called functions.
    It saves gcc's time.
    """
    from ffcx.codegeneration import optimizer
    from ffcx.codegeneration.lnodes import Section

    fused = optimizer.optimize(optimizer.fuse_sections(sections, "Function"), rule)
    return [
        optimizer.fuse_loops(part)
        if isinstance(part, Section) and part.name == "Tensor Computation"
        else part
        for part in fused
    ]


def _node_symbols(numberer: Any, expression: Any) -> Any:
    """Symbols of a node of FFCx's graph, by the graph's own index in place of a search.

    FFCx 0.11 compares with all nodes: that took 50 s of the 58 s for the residual of a hyperelastic
    shell in `ed3`. The code that comes out is the same.
    """
    return numberer.V_symbols[numberer.G.e2i[expression]]


@contextmanager
def quickly() -> Iterator[None]:
    """FFCx takes two thirds of its time meanwhile (docs/theory/built.md).

    It makes objects by the million, few of them in circles: the collector looks at them in vain.
    UFL and FFCx choose methods by type half a million times for 40 kernels; Python 3.12 makes a
    function with a name and a docstring of its own each time. And every form is rebuilt three times
    without nodes that hardly any has.
    """
    # by its name: the package has a function of the same one
    steps = importlib.import_module("ufl.algorithms.compute_form_data")
    named = singledispatchmethod.__get__
    rebuilding = {name: getattr(steps, name) for name in REBUILDING}
    singledispatchmethod.__get__ = _chosen  # type: ignore[method-assign,assignment]
    for name, kinds in REBUILDING.items():
        setattr(steps, name, partial(_rebuilt, rebuilding[name], kinds))
    try:
        with seldom():
            yield
    finally:
        for name, function in rebuilding.items():
            setattr(steps, name, function)
        singledispatchmethod.__get__ = named  # type: ignore[method-assign]


def _rebuilt(rebuild: Callable[[Form], Form], kinds: tuple[type, ...], form: Form) -> Form:
    """A form without nodes of some kinds."""
    nodes: Any = unique_pre_traversal
    parts = (part.integrand() for part in form.integrals())
    return rebuild(form) if any(isinstance(n, kinds) for p in parts for n in nodes(p)) else form


def _chosen(method: Any, obj: Any, cls: Any = None) -> Callable[..., Any]:
    """A method chosen by the type of its first argument, without a name."""
    dispatch = method.dispatcher.dispatch

    def call(*args: Any, **kwargs: Any) -> Any:
        return dispatch(args[0].__class__).__get__(obj, cls)(*args, **kwargs)

    return call
