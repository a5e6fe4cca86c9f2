"""Structure of forms, which those share that are read alike: half the time of UFL's signature."""

from __future__ import annotations

from hashlib import blake2b
from typing import Any

from ufl import Form
from ufl.classes import Argument, FixedIndex, GeometricQuantity, Label, MultiIndex
from ufl.domain import extract_unique_domain
from ufl.utils.sorting import canonicalize_metadata


def structure(form: Form) -> bytes:
    """Name that forms share which differ only in values, meshes and names of indices.

    Args:
        form: A form; its functions and Constants count by their place.
    """
    seen = _Seen()
    described: list[Any] = []
    for function in (*form.arguments(), *form.coefficients()):
        space = function.ufl_function_space()
        described.append((seen.mesh(space.ufl_domain()), repr(space.ufl_element())))
    for constant in form.constants():
        described.append((seen.mesh(extract_unique_domain(constant)), constant.ufl_shape))
    seen.places = {c: n for n, c in enumerate((*form.coefficients(), *form.constants()))}
    for integral in form.integrals():
        over = integral.extra_domain_integral_type_map().items()
        described.append(
            (
                seen.node(integral.integrand()),
                seen.mesh(integral.ufl_domain()),
                integral.integral_type(),
                integral.subdomain_id(),
                canonicalize_metadata(integral.metadata()),
                [(seen.mesh(mesh), kind) for mesh, kind in over],
            )
        )
    meshes = [repr(mesh.ufl_coordinate_element()) for mesh in seen.meshes]
    return blake2b(repr((described, meshes, list(seen.rows))).encode()).digest()


class _Seen:
    """Numbers of all that a form is made of, each thing once, the first one first.

    Attributes:
        places: Of coefficients and Constants.
        meshes: The meshes.
        rows: Nodes, by their kind and the numbers of their operands.
    """

    def __init__(self) -> None:
        self.places: dict[Any, int] = {}
        self.meshes: dict[Any, int] = {}
        self.rows: dict[Any, int] = {}
        self._free: dict[Any, int] = {}
        self._numbers: dict[int, int] = {}

    def mesh(self, mesh: Any) -> int:
        return self.meshes.setdefault(mesh, len(self.meshes))

    def node(self, root: Any) -> int:
        """The number of a node; those below it have theirs then."""
        numbers, rows, stack = self._numbers, self.rows, [root]
        while stack:
            node = stack[-1]
            if id(node) in numbers:
                stack.pop()
                continue
            operands = node.ufl_operands
            if missing := [o for o in operands if id(o) not in numbers]:
                stack += missing
                continue
            stack.pop()
            below = [numbers[id(o)] for o in operands] if operands else [self._leaf(node)]
            row = (node._ufl_typecode_, *below)
            numbers[id(node)] = rows.setdefault(row, len(rows))
        return numbers[id(root)]

    def _leaf(self, leaf: Any) -> Any:
        if isinstance(leaf, MultiIndex):
            return tuple(
                (int(i),)
                if isinstance(i, FixedIndex)
                else self._free.setdefault(i, len(self._free))
                for i in leaf
            )
        if (place := self.places.get(leaf)) is not None:
            return place
        if isinstance(leaf, Argument):
            return leaf.number(), leaf.part()
        if isinstance(leaf, Label):
            return self._free.setdefault(leaf, len(self._free))
        if isinstance(leaf, GeometricQuantity):
            return self.mesh(extract_unique_domain(leaf))
        return repr(leaf)
