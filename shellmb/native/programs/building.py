"""Programs of integrals as C takes them: instructions, tables, and rows of a cell's tensor."""

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from shellmb.arrays import Ints
from shellmb.native.compiling.flags import LANES
from shellmb.native.library import CArrays
from shellmb.native.programs.collecting import Collector
from shellmb.native.programs.geometry import COORDINATES
from shellmb.native.programs.graph import Graph, Input, Key, Multilinear, Scalar
from shellmb.native.programs.reading import Reader
from shellmb.native.programs.tables import Points, Tables
from shellmb.native.programs.translation import CODE, CODES, KEPT, UNIFORM, Translation

# points of a rule that are taken at once, at most, and bytes that their registers take
POINTS, ROOM = 4, 42_000
# functions of a table that are not zero at a point, up to which products are taken one by one
FEW = 2
# which members of each instruction are registers: its target, and operands that points have
REGISTERS = np.array(
    [[False, True, *(n != "sum" and k not in UNIFORM.get(n, ()) for k in range(4))] for n in CODES]
)


class Rule:
    """The program of one integral: what one rule adds to a cell's tensor.

    Args:
        reader: What has read it.
        value: What is integrated, times the scale.
        rank: Number of arguments.
        points: Points of the rule.
        tables: Functions there.
        keeps: Nodes for each point up to which sums are collected, where what seldom changes is
            kept of each cell; zero: it is not kept.

    Attributes:
        parts: Nodes of what is integrated by the arguments that they belong to.
        chunk: Points that are taken at once.
        registers: How many it takes, of each point.
        kept: How many numbers are kept of a cell.
        products: Room for values times those of trial functions, once C has them.
        factors: Room for values of test functions, likewise.
    """

    def __init__(
        self,
        reader: Reader,
        value: Scalar,
        rank: int,
        points: Points,
        tables: Tables,
        keeps: float = 0,
    ) -> None:
        self._tables, self._points, self._rank = tables, points, rank
        graph, entity_size = reader.graph, points.numbers.shape[1]
        self.parts = _parts(graph, value, rank)
        loose: Collection[int] = ()
        if len(graph.nodes) < keeps * len(points.weights):
            found = Collector(graph, self.parts.values())
            parts = {key: found.of(node) for key, node in self.parts.items()}
            self.parts = {key: node for key, node in parts.items() if node != graph.zero}
            loose = found.loose
        both = enumerate(zip(graph.varies, graph.steady, strict=True))
        given = [v and s and keeps > 0 and k not in loose for k, (v, s) in both]
        self._groups = self._grouped()
        groups = list(self._groups.values())
        self._made = made = Translation(graph, self.parts, groups, entity_size, given)
        kept: dict[Key, int] = {_numbered(k): node for k, node in enumerate(made.kept)}
        self._steady = Translation(graph, kept, [list(kept)], entity_size, [False] * len(given))
        self.registers = max(made.registers, self._steady.registers)
        self.products, self.factors = 0, 0
        count, fit = len(points.weights), ROOM // (8 * LANES * max(made.registers, 1))
        most = max(1, min(POINTS, fit))
        self.chunk = -(-count // -(-count // most))
        self.kept = len(made.kept) * self.chunk * -(-count // self.chunk)

    @property
    def constants(self) -> list[int]:
        """Constants that what is kept follows from."""
        return self._steady.constants

    def _grouped(self) -> dict[Any, list[Key]]:
        """Arguments of what comes out at once: all, or those of a matrix by their rows.

        Of a matrix first what few functions have, whose products are taken one by one.
        """
        if self._rank < 2:
            return {None: list(self.parts)}
        few = [_few(values) for values in self._tables.tables]
        found: dict[Any, list[Key]] = {None: []}
        for key in self.parts:
            table, place = self._tables.find(key[0])
            group = place, self._tables.tables[table].shape[-1]
            found.setdefault(None if few[table] else group, []).append(key)
        return found

    def read(self) -> list[Ints]:
        """Places of coefficients among those of a cell, of each value that is read."""
        every = [*self._made.inputs, *self._steady.inputs]
        own = [self._tables.find(item) for item, _ in every if item.source != COORDINATES]
        nodes = [values.shape[-1] for values in self._tables.tables]
        places = dict.fromkeys((place, nodes[table]) for table, place in own)
        return [place.first + place.stride * np.arange(count) for place, count in places]

    def struct(self, pointer: CArrays, first: int, place: int, read: Ints) -> dict[str, Any]:
        """Members of C's structure.

        Args:
            pointer: Makes pointers, and keeps what they point to.
            first: Place of the first constant, behind those of programs.
            place: Of what is kept of a cell.
            read: Place of each coefficient among those that are read.
        """
        self._read = read
        entities = self._points.numbers
        found = self._products(pointer) if self._rank == 2 else self._rows(pointer)
        stages = [self._stage(pointer, first, made) for made in (self._steady, self._made)]
        tables = [_table(pointer, values) for values in self._tables.tables]
        keep = [self._steady.output[_numbered(k)] for k in range(len(self._made.kept))]
        return {
            "points": len(self._points.weights),
            "chunk": self.chunk,
            "entity_size": entities.shape[1],
            "entity": pointer(np.ascontiguousarray(np.append(entities.ravel(), 0.0))),
            "weights": pointer(np.ascontiguousarray(self._points.weights, float)),
            "tables": pointer.many("Table", tables),
            "steady": stages[0],
            "always": stages[1],
            "kept": len(keep),
            "place": place,
            "keep": _ints(pointer, [k * self.chunk for k in keep] or [0]),
            **found,
        }

    def _stage(self, pointer: CArrays, first: int, made: Translation) -> dict[str, Any]:
        uniform = np.zeros(made.uniforms + 1)
        uniform[: len(made.numbers)] = made.numbers
        loads = self._loads(pointer, made)
        code, terms = self._placed(made)
        return {
            "numbers": len(made.numbers),
            "constants": len(made.constants),
            "uniform": pointer(uniform),
            "constant": _ints(pointer, [first + k for k in made.constants] or [0]),
            "uniform_ops": len(made.uniform_code),
            "ops": len(made.code),
            "uniform_code": _instructions(pointer, made.uniform_code or [(0,) * 6]),
            "code": _instructions(pointer, code),
            "terms": _ints(pointer, terms),
            "weight": made.weight * self.chunk,
            "loads": len(loads),
            "load": pointer.many("Loads", loads),
        }

    def _place(self, register: Any) -> Any:
        """Place of a value, which is of all points, among registers or what is kept."""
        return register & KEPT | (register & ~KEPT) * self.chunk

    def _placed(self, made: Translation) -> tuple[Ints, Ints]:
        """Instructions with places in the room of registers, and factors of terms likewise."""
        code, terms = np.array(made.code or [(0,) * 6]), np.array(made.terms or [0])
        moved = self._place(terms)
        for _, _, first, varying, uniform, _ in code[code[:, 0] == CODE["sum"]].tolist():
            begin = first + 2 * ((varying & 0xFFFF) + (varying >> 16))
            end = begin + 2 * ((uniform & 0xFFFF) + (uniform >> 16))
            # numbers that all points have stay where they are
            moved[begin:end:2] = terms[begin:end:2]
        return np.where(REGISTERS[code[:, 0]], self._place(code), code), moved

    def _loads(self, pointer: CArrays, made: Translation) -> list[dict[str, Any]]:
        groups: dict[tuple[int, bool, int], list[tuple[int, int]]] = {}
        for item, register in made.inputs:
            table, place = self._tables.find(item)
            first, stride = place.first, place.stride
            if item.source != COORDINATES:
                nodes = self._tables.tables[table].shape[-1]
                next_one = int(self._read[first + stride * (nodes > 1)])
                first = int(self._read[first])
                stride = next_one - first
            groups.setdefault((table, item.source == COORDINATES, stride), []).append(
                (first, register)
            )
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
            return {"of": self._place(of), "table": -1, "first": 0, "stride": 0}
        table, place = self._tables.find(item)
        found = {"of": self._place(of), "table": table}
        return found | {"first": place.first, "stride": place.stride}

    def _rows(self, pointer: CArrays) -> dict[str, Any]:
        few = [_few(values) for values in self._tables.tables]
        components: dict[Any, list[tuple[int, int]]] = {}
        rows = []
        for key, of in self._made.output.items():
            if key and not few[self._tables.find(key[0])[0]]:
                table, place = self._tables.find(key[0])
                nodes = self._tables.tables[table].shape[-1]
                components.setdefault((place, nodes), []).append((table, self._place(of)))
            else:
                rows.append(self._row(of, key[0] if key else None))
        # components with the same derivatives side by side
        groups: dict[Any, list[tuple[int, list[int]]]] = {}
        for (place, nodes), some in components.items():
            found, of_each = zip(*sorted(some), strict=True)
            group = found, nodes, place.stride
            groups.setdefault(group, []).append((place.first, list(of_each)))
        denses = [
            {
                "stride": stride,
                "nodes": nodes,
                "rows": len(found),
                "columns": len(some),
                "table": _ints(pointer, found),
                "of": _ints(pointer, np.array([of for _, of in some]).T),
                "place": _ints(pointer, [first for first, _ in some]),
            }
            for (found, nodes, stride), some in groups.items()
        ]
        return {
            "rows": len(rows),
            "row": pointer.many("Row", rows),
            "denses": len(denses),
            "dense": pointer.many("Dense", denses),
            "first_ops": len(self._made.code),
        }

    def _products(self, pointer: CArrays) -> dict[str, Any]:
        """Products of two arguments: of few values one by one, others as those of matrices."""
        tests = list(dict.fromkeys(key[0] for key in self.parts))
        trials = list(dict.fromkeys(key[1] for key in self.parts))
        sparse = [
            {
                "of": self._place(self._made.output[a, b]),
                "row": tests.index(a),
                "column": trials.index(b),
            }
            for a, b in self._groups[None]
        ]
        made, self.products, self.factors = [], 0, 0
        for (group, keys), end in zip(self._groups.items(), self._made.segments, strict=True):
            if group is None:
                continue
            place, nodes = group
            rows = list(dict.fromkeys(a for a, _ in keys))
            dense = {(a, b): self._made.output[a, b] for a, b in keys}
            members, width = self._dense(pointer, place, nodes, rows, dense)
            members["right"] = self.products
            count = len(self._points.weights) * len(rows)
            made.append(members | {"end": end})
            self.products += count * width
            self.factors = max(self.factors, count * nodes)
        return {
            "rows": len(tests),
            "row": pointer.many("Row", [self._row(0, a) for a in tests]),
            "column": pointer.many("Row", [self._row(0, b) for b in trials]),
            "pairs": len(sparse),
            "pair": pointer.many("Pair", sparse),
            "denses": len(made),
            "dense": pointer.many("Dense", made),
            "first_ops": self._made.segments[0],
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
        of = [[self._place(dense[a, b]) if (a, b) in dense else -1 for b in order] for a in rows]
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
    if isinstance(value, Multilinear):
        assert all(len(key) == rank for key in value.parts)
        return value.parts
    return {(): value} if rank == 0 and value != graph.zero else {}


def _numbered(k: int) -> Key:
    """A key of values that belong to no argument."""
    return (Input(0, k, ()),)


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


def _instructions(pointer: CArrays, code: Any) -> Any:
    return pointer.ffi.cast("Instruction *", _ints(pointer, code))
