"""Operations of a graph in order, with registers: a program for a simple machine."""

from collections.abc import Mapping, Sequence

from shellmb.native.programs.graph import BINARY, COMPARED, LEAVES, UNARY, Graph, Input, Key

# operations, of which C has a list
CODES = (
    "add", "add_u", "sub", "sub_u", "u_sub", "mul", "u_mul", "div", "u_div", "sum", "fill",
    "pow", "atan2", "min", "max", "sqrt", "abs", "sign", "exp", "log", "sin", "cos", "tan",
    "asin", "acos", "atan", "sinh", "cosh", "tanh", "erf", "lt", "le", "gt", "ge", "eq", "ne",
    "and", "or", "not", "choose",
)  # fmt: skip
CODE = {name: k for k, name in enumerate(CODES)}
# which operands are numbers that all points have
UNIFORM = {"add_u": (1,), "sub_u": (1,), "u_sub": (0,), "u_mul": (0,), "u_div": (0,), "fill": (0,)}
# a term of a sum: its sign, and what it is a product of, or a value and None
Term = tuple[float, int, int | None]
# what may be part of a sum
PARTS = ("add", "sub", "mul")
# marks a place among values that are kept from call to call
KEPT = 1 << 30

Instruction = tuple[int, int, int, int, int, int]


class Translation:
    """Instructions that compute some values of a graph.

    Args:
        graph: The graph.
        parts: Nodes of the values, by the arguments that they belong to.
        groups: Keys of these in groups; instructions of one come before those of the next.
        entity_size: How many numbers an entity has.
        given: Whether each node's values are kept from call to call.

    Attributes:
        code: Instructions for what varies from point to point.
        uniform_code: Those for what does not.
        terms: Factors of the terms of sums.
        registers: How many it takes.
        numbers: Numbers that stand in the graph.
        constants: Places of the constants.
        uniforms: How many places there are for what does not vary.
        inputs: Values of functions, with their registers.
        weight: Register of the weights; -1: none.
        output: Registers of the values.
        segments: Number of instructions at the end of each group.
        kept: Nodes whose values are given, in their order.
    """

    def __init__(
        self,
        graph: Graph,
        parts: Mapping[Key, int],
        groups: Sequence[Sequence[Key]],
        entity_size: int,
        given: Sequence[bool],
    ) -> None:
        self._graph, self._parts, self._groups = graph, parts, groups
        self._given = given
        self.code: list[Instruction] = []
        self.uniform_code: list[Instruction] = []
        self.terms: list[int] = []
        roots = [[parts[key] for key in keys] for keys in groups]
        self._order, self._ends, self._uses = graph.ordered(roots, given)
        self.registers, self._free = 0, list[int]()
        self.inputs: list[tuple[Input, int]] = []
        self.weight = -1
        self.segments: list[int] = []
        self.output: dict[Key, int] = {}
        self._leaves(entity_size)
        self._translate()

    def _leaves(self, entity_size: int) -> None:
        """Give numbers, constants and values of functions their places."""
        graph, order = self._graph, self._order
        leaves: dict[str, list[int]] = {name: [] for name in LEAVES}
        for node in order:
            op = graph.nodes[node][0]
            if op in leaves:
                leaves[op].append(node)
        self.kept = [node for node in order if self._given[node]]
        self._register = {node: KEPT | k for k, node in enumerate(self.kept)}
        numbers, constants = leaves["number"], leaves["constant"]
        self.numbers = [*map(graph.values.__getitem__, numbers), 0.0, 1.0]
        self.constants = [graph.nodes[node][1] for node in constants]
        self._zero, self._one = len(numbers), len(numbers) + 1
        first = len(self.numbers)
        # of nodes that vary: their registers; of others: their place among uniform numbers
        self._uniform = {node: k for k, node in enumerate(numbers)}
        self._uniform |= {node: first + k for k, node in enumerate(constants)}
        first += len(constants)
        self._uniform |= {node: first + graph.nodes[node][1] for node in leaves["entity"]}
        self.uniforms = first + entity_size
        for node in leaves["input"]:
            if node not in self._register:
                self._register[node] = register = self._new()
                self.inputs.append((graph.nodes[node][1], register))
        for node in leaves["weight"]:
            if node not in self._register:
                self._register[node] = self.weight = self._new()

    def _translate(self) -> None:
        graph = self._graph
        sums = self._sums()
        begin = 0
        for keys, end in zip(self._groups, self._ends, strict=True):
            for node in self._order[begin:end]:
                op = graph.nodes[node][0]
                terms = sums.get(node)
                if op in LEAVES or node in self._register or terms == []:
                    continue
                args = graph.operands[node]
                if not graph.varies[node]:
                    x, y, z, *_ = [*(self._uniform[a] for a in args), 0, 0]
                    self._uniform[node] = self.uniforms
                    self.uniform_code.append((CODE[op], self.uniforms, x, y, z, 0))
                    self.uniforms += 1
                    continue
                if terms and (len(terms) > 2 or any(b is not None for _, _, b in terms)):
                    self._add_up(node, terms)
                else:
                    self._operate(node, op, args)
            begin, used = end, []
            for key in keys:
                node = self._graph.actual[self._parts[key]]
                if graph.varies[node]:
                    self.output[key] = self._register[node]
                else:
                    # what does not vary is at all points the same
                    self.output[key] = self._filled(node)
                    used.append(self.output[key])
            self.segments.append(len(self.code))
            self._free += used
            for key in keys:
                self._done_with(self._graph.actual[self._parts[key]])

    def _done_with(self, node: int) -> None:
        """Count a use of a node, whose register is free behind the last one."""
        if self._graph.varies[node]:
            self._uses[node] -= 1
            if self._uses[node] == 0 and not self._given[node]:
                self._free.append(self._register[node])

    def _sums(self) -> dict[int, list[Term]]:
        """Terms of sums: what is used but once, in another sum, is part of that.

        Returns:
            Terms of each sum; none of what is part of another.
        """
        graph, found = self._graph, dict[int, list[Term]]()
        for node in reversed(self._order):
            some = graph.nodes[node][0] in ("add", "sub") and graph.varies[node]
            if some and node not in found and not self._given[node]:
                found[node] = terms = list[Term]()
                self._fill(node, 1.0, terms, found)
        return found

    def _fill(self, node: int, sign: float, to: list[Term], found: dict[int, list[Term]]) -> None:
        """Add the terms of a node, as part of a sum, to those of the sum."""
        graph = self._graph
        op, args = graph.nodes[node][0], graph.operands[node]
        if op not in ("add", "sub"):
            to.append((sign, args[0], args[1]))
            return
        for k, a in enumerate(args):
            own = -sign if op == "sub" and k else sign
            alone = self._uses[a] == 1 and not self._given[a]
            if graph.varies[a] and alone and graph.nodes[a][0] in PARTS:
                found[a] = []
                self._fill(a, own, to, found)
            else:
                to.append((own, a, None))

    def _new(self) -> int:
        if self._free:
            return self._free.pop()
        self.registers += 1
        return self.registers - 1

    def _filled(self, node: int) -> int:
        register = self._new()
        self.code.append((CODE["fill"], register, self._uniform[node], 0, 0, 0))
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
        target, first = self._new(), len(self.terms)
        for part in parts:
            self.terms += part
        plus, minus, u_plus, u_minus = (len(part) // 2 for part in parts)
        numbers = plus + (minus << 16), u_plus + (u_minus << 16)
        self.code.append((CODE["sum"], target, first, *numbers, start))
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
        x, y, z, *_ = [*places, 0, 0]
        self.code.append((CODE[name], target, x, y, z, 0))
        self._register[node] = target
        self._free += filled
        for a in of:
            self._done_with(a)


assert set(BINARY) | set(UNARY) | set(COMPARED) | {"choose"} <= set(CODES)
