"""Programs of integrals: operations in order, registers, and arrays as C takes them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from shellmb.native.compiling.flags import LANES
from shellmb.native.library import CArrays
from shellmb.native.programs.graph import BINARY, COMPARED, UNARY, Graph, Input, Key, Linear, Scalar
from shellmb.native.programs.reading import COORDINATES, Reader
from shellmb.native.programs.tables import Points, Tables

# operations of C, in the order of its list
CODES = (
    "add", "add_u", "sub", "sub_u", "u_sub", "mul", "u_mul", "div", "u_div", "sum", "fill", "pow", "atan2", "min",
    "max", "sqrt", "abs", "sign", "exp", "log", "sin", "cos", "tan", "asin", "acos", "atan", "sinh",
    "cosh", "tanh", "erf", "lt", "le", "gt", "ge", "eq", "ne", "and", "or", "not", "choose",
)  # fmt: skip
CODE = {name: k for k, name in enumerate(CODES)}
# points of a rule that are taken at once, at most, and bytes that their registers take
POINTS, ROOM = 4, 28_000
# functions of a table that are not zero at a point, up to which products are taken one by one
FEW = 2
# which operands are numbers that all points have
UNIFORM = {"add_u": (1,), "sub_u": (1,), "u_sub": (0,), "u_mul": (0,), "u_div": (0,), "fill": (0,)}
# a term of a sum: its sign, and what it is a product of, or a value and None
Term = tuple[float, int, int | None]
# what may be part of a sum
PARTS = ("add", "sub", "mul")
LEAVES = ("number", "constant", "entity", "input", "weight")

Instruction = tuple[int, int, int, int, int, int]


class Rule:
    """The program of one integral: what one rule adds to a cell's tensor.

    Args:
        reader: What has read it.
        value: What is integrated, times the scale.
        rank: Number of arguments.
        points: Points of the rule.
        tables: Functions there.
    """

    def __init__(
        self, reader: Reader, value: Scalar, rank: int, points: Points, tables: Tables
    ) -> None:
        self._graph, self._tables, self._points = reader.graph, tables, points
        self._rank, self._parts = rank, _parts(reader.graph, value, rank)
        self._groups = self._grouped()
        self._code: list[Instruction] = []
        self._uniform_code: list[Instruction] = []
        self._terms: list[int] = []
        # of nodes that vary: their registers; of others: their place among uniform numbers
        self._register: dict[int, int] = {}
        self._fills: dict[int, int] = {}
        self._uniform: dict[int, int] = {}
        self._numbers: list[float] = []
        self._constants: list[int] = []
        roots = [[self._parts[key] for key in keys] for keys in self._groups.values()]
        self._order, self._ends, self._uses = _ordered(reader.graph, roots)
        self.registers = 0
        self._free: list[int] = []
        self._inputs: list[tuple[Input, int]] = []
        self._weight = -1
        self._translate()
        count, fit = len(points.weights), ROOM // (8 * LANES * max(self.registers, 1))
        most = max(1, min(POINTS, fit))
        self.chunk = -(-count // -(-count // most))

    def _grouped(self) -> dict[Any, list[Key]]:
        """Arguments of what comes out at once: all, or those of a matrix by their rows.

        Of a matrix first what few functions have, whose products are taken one by one.
        """
        if self._rank < 2:
            return {None: list(self._parts)}
        few = [_few(values) for values in self._tables.tables]
        found: dict[Any, list[Key]] = {None: []}
        for key in self._parts:
            table, place = self._tables.find(key[0])
            group = place, self._tables.tables[table].shape[-1]
            found.setdefault(None if few[table] else group, []).append(key)
        return found

    def _resolved(self, node: int) -> int:
        while self._graph.nodes[node][0] == "alias":
            node = self._graph.nodes[node][3]
        return node

    def _translate(self) -> None:
        graph = self._graph
        for node in self._order:
            op, *args = graph.nodes[node]
            if not graph.varies[node] and op == "number":
                self._uniform[node] = len(self._numbers)
                self._numbers.append(float(args[0]))
        self._zero, self._one = len(self._numbers), len(self._numbers) + 1
        self._numbers += [0.0, 1.0]
        first = len(self._numbers)
        for node in self._order:
            op, *args = graph.nodes[node]
            if op == "constant":
                self._uniform[node] = first + len(self._constants)
                self._constants.append(args[0])
        first += len(self._constants)
        for node in self._order:
            op, *args = graph.nodes[node]
            if op == "entity":
                self._uniform[node] = first + args[0]
        self._next_uniform = first + self._points.numbers.shape[1]
        for node in self._order:
            op = graph.nodes[node][0]
            if op == "input":
                self._register[node] = self._new()
                self._inputs.append((graph.nodes[node][1], self._register[node]))
            elif op == "weight":
                self._weight = self._register[node] = self._new()
        sums = self._sums()
        self.segments: list[int] = []
        begin = 0
        self._output: dict[Key, int] = {}
        for keys, end in zip(self._groups.values(), self._ends, strict=True):
            for node in self._order[begin:end]:
                op, *args = graph.nodes[node]
                if op in LEAVES or op == "alias" or sums.get(node) == []:
                    continue
                args = [self._resolved(a) for a in args]
                if not graph.varies[node]:
                    places = [self._uniform[a] for a in args] + [0, 0]
                    self._uniform[node] = self._next_uniform
                    code = CODE[op], self._next_uniform, *places[:3], 0
                    self._uniform_code.append(code)
                    self._next_uniform += 1
                    continue
                if len(sums.get(node, ())) > 2 or any(
                    b is not None for _, _, b in sums.get(node, ())
                ):
                    self._add_up(node, sums[node])
                else:
                    self._operate(node, op, args)
            begin, used = end, []
            for key in keys:
                node = self._resolved(self._parts[key])
                if graph.varies[node]:
                    self._output[key] = self._register[node]
                else:
                    # what does not vary is at all points the same
                    self._output[key] = self._filled(node)
                    used.append(self._output[key])
            self.segments.append(len(self._code))
            self._free += used
            for key in keys:
                self._done_with(self._resolved(self._parts[key]))

    def _done_with(self, node: int) -> None:
        """Count a use of a node, whose register is free behind the last one."""
        if self._graph.varies[node]:
            self._uses[node] -= 1
            if self._uses[node] == 0:
                self._free.append(self._register[node])

    def _sums(self) -> dict[int, list[Term]]:
        """Terms of sums; sums and products that are used but once, in another sum, are part of that.

        Returns:
            Terms of each sum; none of what is part of another.
        """
        graph, found = self._graph, dict[int, list[Term]]()

        def collect(node: int, sign: float, to: list[Term]) -> None:
            op, *args = graph.nodes[node]
            if op in ("add", "sub"):
                for k, a in enumerate(map(self._resolved, args)):
                    own = -sign if op == "sub" and k else sign
                    kind = graph.nodes[a][0]
                    if not graph.varies[a] or self._uses[a] > 1 or kind not in PARTS:
                        to.append((own, a, None))
                        continue
                    found[a] = []
                    collect(a, own, to)
            else:
                a, b = map(self._resolved, args)
                to.append((sign, a, b))

        for node in reversed(self._order):
            if graph.nodes[node][0] in ("add", "sub") and graph.varies[node] and node not in found:
                collect(node, 1.0, terms := [])
                found[node] = terms
        return found

    def _new(self) -> int:
        if self._free:
            return self._free.pop()
        self.registers += 1
        return self.registers - 1

    def _filled(self, node: int) -> int:
        register = self._new()
        self._code.append((CODE["fill"], register, self._uniform[node], 0, 0, 0))
        return register

    def _add_up(self, node: int, terms: Sequence[Term]) -> None:
        """A sum of products: of varying ones, then of such with a number that all points have."""
        varies = self._graph.varies
        parts: tuple[list[int], ...] = ([], [], [], [])
        start, used = self._zero, list[int]()
        for sign, a, b in terms:
            if b is None and not varies[a]:
                if start == self._zero and sign > 0:
                    start = self._uniform[a]
                    continue
                used.append(self._filled(a))
                parts[2 if sign > 0 else 3].extend((self._one, used[-1]))
            elif b is None:
                parts[2 if sign > 0 else 3].extend((self._one, self._register[a]))
            elif varies[a]:
                parts[0 if sign > 0 else 1].extend((self._register[a], self._register[b]))
            else:
                parts[2 if sign > 0 else 3].extend((self._uniform[a], self._register[b]))
        target, first = self._new(), len(self._terms)
        for part in parts:
            self._terms += part
        plus, minus, u_plus, u_minus = (len(part) // 2 for part in parts)
        numbers = plus + (minus << 16), u_plus + (u_minus << 16)
        self._code.append((CODE["sum"], target, first, *numbers, start))
        self._register[node] = target
        self._free += used
        for _, a, b in terms:
            self._done_with(a)
            if b is not None:
                self._done_with(b)

    def _operate(self, node: int, op: str, args: Sequence[int]) -> None:
        varies = self._graph.varies
        name, of = op, list(args)
        if op in ("add", "sub", "mul", "div"):
            if op in ("add", "mul") and not varies[of[0]] and varies[of[1]] and op == "add":
                of.reverse()
            if not varies[of[0]]:
                name = f"u_{op}"
            elif not varies[of[1]]:
                if op in ("mul", "div"):
                    # of numbers that stand behind
                    of = [of[1], of[0]] if op == "mul" else of
                    name = "u_mul" if op == "mul" else op
                else:
                    name = f"{op}_u"
        uniform = UNIFORM.get(name, ())
        places, filled = [], []
        for k, a in enumerate(of):
            if k in uniform:
                places.append(self._uniform[a])
            elif varies[a]:
                places.append(self._register[a])
            else:
                filled.append(self._filled(a))
                places.append(filled[-1])
        # operands that are done with give their registers to what comes behind this
        target = self._new()
        places += [0, 0, 0]
        self._code.append((CODE[name], target, *places[:3], 0))
        self._register[node] = target
        self._free += filled
        for a in of:
            self._done_with(a)

    # for C

    def struct(self, pointer: CArrays, first: int) -> dict[str, Any]:
        """Members of C's structure.

        Args:
            pointer: Makes pointers, and keeps what they point to.
            first: Place of the first constant, behind those of programs.
        """
        uniform = np.zeros(self._next_uniform + 1)
        uniform[: len(self._numbers)] = self._numbers
        entities = self._points.numbers
        found = self._products(pointer) if self._rank == 2 else self._rows(pointer)
        loads = self._loads(pointer)
        tables = [_table(pointer, values) for values in self._tables.tables]
        return {
            "points": len(self._points.weights),
            "chunk": self.chunk,
            "numbers": len(self._numbers),
            "constants": len(self._constants),
            "entity_size": entities.shape[1],
            "uniform": pointer(uniform),
            "constant": pointer(np.array([first + k for k in self._constants] or [0], np.int32)),
            "entity": pointer(np.ascontiguousarray(entities.ravel()) if entities.size else uniform),
            "uniform_ops": len(self._uniform_code),
            "ops": len(self._code),
            "uniform_code": _instructions(pointer, self._uniform_code),
            "code": _instructions(pointer, self._placed()),
            "terms": pointer(np.array(self._placed_terms or [0], dtype=np.int32)),
            "weight": self._weight * self.chunk,
            "weights": pointer(np.ascontiguousarray(self._points.weights, float)),
            "tables": pointer.many("Table", tables or 1),
            "loads": len(loads),
            "load": pointer.many("Loads", loads or 1),
            **found,
        }

    def _placed(self) -> list[Instruction]:
        """Instructions with places in the room of registers, of which each has some for all points."""
        chunk, found = self.chunk, []
        self._placed_terms = list(self._terms)
        for op, to, *of in self._code:
            name = CODES[op]
            if name == "sum":
                first, varying, uniform, start = of
                products = (varying & 0xFFFF) + (varying >> 16)
                others = (uniform & 0xFFFF) + (uniform >> 16)
                for k in range(first, first + 2 * (products + others)):
                    if k < first + 2 * products or (k - first) % 2:
                        self._placed_terms[k] *= chunk
                found.append((op, to * chunk, *of))
            else:
                own = UNIFORM.get(name, ())
                a, b, c, d = (x if k in own else x * chunk for k, x in enumerate(of))
                found.append((op, to * chunk, a, b, c, d))
        return found

    def _loads(self, pointer: CArrays) -> list[dict[str, Any]]:
        groups: dict[tuple[int, bool, int], list[tuple[int, int]]] = {}
        for item, register in self._inputs:
            table, place = self._tables.find(item)
            key = table, item.source == COORDINATES, place.stride
            groups.setdefault(key, []).append((place.first, register))
        found = []
        for (table, coordinates, stride), some in groups.items():
            first, to = np.array(sorted(some), dtype=np.int32).T
            found.append(
                {
                    "table": table,
                    "coordinates": coordinates,
                    "stride": stride,
                    "count": len(some),
                    "first": pointer(np.ascontiguousarray(first)),
                    "to": pointer(np.ascontiguousarray(to * np.int32(self.chunk))),
                }
            )
        return found

    def _row(self, of: int, item: Input | None) -> dict[str, int]:
        if item is None:
            return {"of": of * self.chunk, "table": -1, "first": 0, "stride": 0}
        table, place = self._tables.find(item)
        found = {"of": of * self.chunk, "table": table}
        return found | {"first": place.first, "stride": place.stride}

    def _rows(self, pointer: CArrays) -> dict[str, Any]:
        few = [_few(values) for values in self._tables.tables]
        groups: dict[Any, list[tuple[Input, int]]] = {}
        rows = []
        for key, of in self._output.items():
            if key and not few[self._tables.find(key[0])[0]]:
                table, place = self._tables.find(key[0])
                group = place, self._tables.tables[table].shape[-1]
                groups.setdefault(group, []).append((key[0], of))
            else:
                rows.append(self._row(of, key[0] if key else None))
        denses = [
            {
                "first": place.first,
                "stride": place.stride,
                "nodes": nodes,
                "rows": len(some),
                "table": _ints(pointer, [self._tables.find(a)[0] for a, _ in some]),
                "of": _ints(pointer, [of * self.chunk for _, of in some]),
            }
            for (place, nodes), some in groups.items()
        ]
        self.products = self.factors = 0
        return {
            "rows": len(rows),
            "row": pointer.many("Row", rows or 1),
            "denses": len(denses),
            "dense": pointer.many("Dense", denses or 1),
            "first_ops": len(self._code),
        }

    def _products(self, pointer: CArrays) -> dict[str, Any]:
        """Products of two arguments: of few values one by one, others as those of matrices."""
        tests = list(dict.fromkeys(key[0] for key in self._parts))
        trials = list(dict.fromkeys(key[1] for key in self._parts))
        sparse = [
            {
                "of": self._output[a, b] * self.chunk,
                "row": tests.index(a),
                "column": trials.index(b),
            }
            for a, b in self._groups[None]
        ]
        made, self.products, self.factors = [], 0, 0
        for (group, keys), end in zip(self._groups.items(), self.segments, strict=True):
            if group is None:
                continue
            place, nodes = group
            rows = list(dict.fromkeys(a for a, _ in keys))
            dense = {key: self._output[key] for key in keys}
            members, width = self._dense(pointer, place, nodes, rows, dense)
            members["right"] = self.products
            count = len(self._points.weights) * len(rows)
            made.append(members | {"end": end})
            self.products += count * width
            self.factors = max(self.factors, count * nodes)
        return {
            "rows": len(tests),
            "row": pointer.many("Row", [self._row(0, a) for a in tests] or 1),
            "column": pointer.many("Row", [self._row(0, b) for b in trials] or 1),
            "pairs": len(sparse),
            "pair": pointer.many("Pair", sparse or 1),
            "denses": len(made),
            "dense": pointer.many("Dense", made or 1),
            "first_ops": self.segments[0],
        }

    def _dense(
        self,
        pointer: CArrays,
        place: Any,
        nodes: int,
        rows: Sequence[Input],
        dense: Mapping[tuple[Input, Input], int],
    ) -> tuple[dict[str, Any], int]:
        find, tables = self._tables.find, self._tables.tables
        columns: dict[Any, list[Input]] = {}
        for b in dict.fromkeys(b for a, b in dense if a in rows):
            table, at = find(b)
            columns.setdefault((at, tables[table].shape[-1]), []).append(b)
        order, last, where, blocks = [], [], [], []
        for (at, count), some in columns.items():
            order += some
            last += [len(order)] * len(some)
            where += [at.first + at.stride * m for m in range(count)]
            blocks.append(count)
        of = [[dense[a, b] * self.chunk if (a, b) in dense else -1 for b in order] for a in rows]
        members = {
            "first": place.first,
            "stride": place.stride,
            "nodes": nodes,
            "rows": len(rows),
            "columns": len(order),
            "width": len(where),
            "table": _ints(pointer, [find(a)[0] for a in rows]),
            "column": _ints(pointer, [find(b)[0] for b in order]),
            "last": _ints(pointer, last),
            "blocks": len(blocks),
            "block": _ints(pointer, blocks),
            "of": _ints(pointer, of),
            "place": _ints(pointer, where),
        }
        return members, len(where)


def _parts(graph: Graph, value: Scalar, rank: int) -> dict[Key, int]:
    """Nodes of what is integrated by the arguments that they belong to."""
    if isinstance(value, Linear):
        assert all(len(key) == rank for key in value.parts)
        return value.parts
    return {(): value} if rank == 0 and value != graph.zero else {}


def _ordered(
    graph: Graph, roots: Sequence[Sequence[int]]
) -> tuple[list[int], list[int], dict[int, int]]:
    """Nodes behind their operands, one group of values after the other.

    Returns:
        The nodes, where each group ends, and how often each node is used.
    """
    order: list[int] = []
    ends: list[int] = []
    uses: dict[int, int] = {}
    done: set[int] = set()

    def actual(node: int) -> int:
        while graph.nodes[node][0] == "alias":
            node = graph.nodes[node][3]
        return node

    def operands(node: int) -> list[int]:
        op, *args = graph.nodes[node]
        return [] if op in LEAVES else [actual(a) for a in args]

    for group in roots:
        for root in map(actual, group):
            uses[root] = uses.get(root, 0) + 1
            stack = [(root, False)]
            while stack:
                node, ready = stack.pop()
                if node in done:
                    continue
                if ready:
                    done.add(node)
                    order.append(node)
                    for a in operands(node):
                        uses[a] = uses.get(a, 0) + 1
                    continue
                stack.append((node, True))
                stack.extend((a, False) for a in reversed(operands(node)) if a not in done)
        ends.append(len(order))
    return order, ends, uses


def _few(values: Any) -> bool:
    """Decide whether few functions of a table are not zero at a point."""
    return bool(np.count_nonzero(values) <= FEW * values.shape[0] * values.shape[1])


def _table(pointer: CArrays, values: Any) -> dict[str, Any]:
    flat = values.reshape(-1, values.shape[-1])
    rows, nodes = np.nonzero(flat)
    begin = np.searchsorted(rows, np.arange(len(flat) + 1)).astype(np.int32)
    return {
        "nodes": values.shape[-1],
        "begin": pointer(begin),
        "node": pointer(nodes.astype(np.int32)),
        "value": pointer(np.ascontiguousarray(flat[rows, nodes])),
        "dense": pointer(np.ascontiguousarray(flat.ravel())),
    }


def _ints(pointer: CArrays, values: Any) -> Any:
    return pointer(np.ascontiguousarray(np.array(values, dtype=np.int32).ravel()))


def _instructions(pointer: CArrays, code: Sequence[Instruction]) -> Any:
    array = np.array(code or [(0,) * 6], dtype=np.int32)
    return pointer.ffi.cast("Instruction *", pointer(np.ascontiguousarray(array.ravel())))


assert set(BINARY) | set(UNARY) | set(COMPARED) | {"choose"} <= set(CODES)
