"""A language of FFCx's: C with fewer loops, and with kernels of several cells at once.

FFCx is told the name of this module in place of "C" (its option `language`). Of a cell's integral
come two functions where kernels are of several cells: one of many, in a place that UFCx has for
single precision, and one of one cell, for DOLFINx.
"""

from math import prod
from types import SimpleNamespace
from typing import Any

from ffcx.codegeneration.backend import FFCXBackend
from ffcx.codegeneration.C import expression, file, form
from ffcx.codegeneration.C import integral_template as template
from ffcx.codegeneration.C.formatter import Formatter
from ffcx.codegeneration.integral_generator import IntegralGenerator
from ffcx.codegeneration.lnodes import ForRange, Section, StatementList
from ffcx.codegeneration.optimizer import fuse_loops, fuse_sections

from shellmb.native.compiling.lanes import HEADER, MANY, ONE, LanesFormatter, UnknownCode

__all__ = ["CELL_NODES", "expression", "file", "form", "integral"]

# An option beside FFCx's: how many nodes a cell of the mesh has; kernels are of several cells then
CELL_NODES = "shellmb_nodes"


class FusedGenerator(IntegralGenerator):
    """An integral with one loop over a cell's nodes for all unknowns, and one for all entries.

    FFCx fuses such loops only of what it calls a coefficient, and DOLFINx's are called functions.
    It saves gcc's time.
    """

    def generate_partition(self, *args: Any) -> tuple[list[Any], list[Any]]:
        """Definitions and intermediate values."""
        definitions, intermediates = super().generate_partition(*args)  # type: ignore[no-untyped-call]
        definitions = fuse_sections(definitions, "Function")
        return [_fused(part, "Function") for part in definitions], intermediates

    def generate_quadrature_loop(self, *args: Any) -> list[Any]:
        """The loop over the points of a quadrature rule."""
        loops = super().generate_quadrature_loop(*args)
        return [_fused(loop, "Tensor Computation") for loop in loops]


def _fused(node: Any, name: str) -> Any:
    """Code with one loop for all in each section of a name."""
    match node:
        case Section():
            return fuse_loops(node) if node.name == name else node
        case ForRange():
            _fused(node.body, name)
        case StatementList():
            node.statements = [_fused(part, name) for part in node.statements]
    return node


def _integral(ir: Any, domain: Any, options: dict[str, Any]) -> tuple[str, str]:
    """Code of an integral, as `ffcx.codegeneration.C.integral.generator` gives it."""
    name = f"{ir.expression.name}_{domain.name}"
    parts = FusedGenerator(ir, FFCXBackend(ir, options)).generate(domain)
    before, body, single = "", "", ""
    if CELL_NODES in options and ir.expression.integral_type == "cell":
        try:
            before, body = _of_lanes(ir, name, parts, options)
            single = f"(ufcx_tabulate_tensor_float32 *)lanes_{name}"
        except UnknownCode:
            # then it is one of one cell
            pass
    enabled = ", ".join(map(str, map(int, ir.enabled_coefficients)))
    array = f"enabled_coefficients_{name}"
    code = template.factory.format(
        factory_name=name,
        enabled_coefficients=array if enabled else "NULL",
        enabled_coefficients_init=f"static bool {array}[] = {{{enabled}}};" if enabled else "",
        tabulate_tensor=body or Formatter(options["scalar_type"])(parts),
        needs_facet_permutations=str(bool(ir.expression.needs_facet_permutations)).lower(),
        scalar_type="double",
        geom_type="double",
        coordinate_element_hash=f"UINT64_C({ir.expression.coordinate_element_hash})",
        tabulate_tensor_float32=f".tabulate_tensor_float32 = {single or 'NULL'},",
        tabulate_tensor_float64=f".tabulate_tensor_float64 = tabulate_tensor_{name},",
        tabulate_tensor_complex64="",
        tabulate_tensor_complex128="",
        domain=int(domain),
    )
    return template.declaration.format(factory_name=name), before + code


def _of_lanes(ir: Any, name: str, parts: Any, options: dict[str, Any]) -> tuple[str, str]:
    """The function of several cells, and the body of that of one cell, which calls it.

    Raises:
        UnknownCode: If lanes do not have all of it.
    """
    offsets = ir.expression.coefficient_offsets
    sizes = (
        prod(ir.expression.tensor_shape),
        max((at + f.ufl_element().dim for f, at in offsets.items()), default=0),
        3 * options[CELL_NODES],
    )
    many = MANY.format(name=name, body=LanesFormatter(options["scalar_type"])(parts))
    return HEADER.read_text() + many, ONE.format(name=name, sizes=", ".join(map(str, sizes)))


integral = SimpleNamespace(generator=_integral)
