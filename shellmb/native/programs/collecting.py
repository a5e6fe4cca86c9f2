"""Sums of what changes, each with one coefficient that does not: fewer operations at each call.

Derivatives along a direction are gradients in space times the direction, and these are derivatives
in the reference cell times what depends on the geometry. Collected they are the latter times one
coefficient each, which is found once. What test functions are multiplied by is the same, turned
round.
"""

from collections.abc import Iterable

from shellmb.native.programs.graph import LEAVES, Graph, Scalar

# a sum: coefficients, which seldom change, of nodes that do; of None what has none
Sum = dict[int | None, int]
# terms of a sum at most that is written out whole
MOST = 8
# uses of a sum of two terms that products are written out with
SHARED = 4


class Collector:
    """Writes what some nodes of a graph are anew.

    Args:
        graph: The graph.
        roots: The nodes.

    Attributes:
        loose: Of what seldom changes, nodes that are not to be kept from call to call: numbers that
            all points have times such, no dearer in a sum than the latter.
    """

    def __init__(self, graph: Graph, roots: Iterable[int]) -> None:
        self._graph, self._minus = graph, graph.number(-1.0)
        # of each node: with what only it has written out, with what is a short sum itself, and with
        # all that can be
        self._short: dict[int, Sum] = {}
        self._middle: dict[int, Sum] = {}
        self._whole: dict[int, Sum] = {}
        self._made: dict[int, int] = {}
        # what others take a node for: as it is near, with short sums, and with all that can be
        self._seen: dict[int, tuple[Sum, Sum, Sum]] = {}
        self._chosen: dict[int, Sum] = {}
        # operations that a node takes with what only it needs
        self._own: dict[int, int] = {}
        self.loose: set[int] = set()
        order, _, self._uses = graph.ordered([roots], graph.steady)
        for node in order:
            self._collect(node)

    def of(self, node: int) -> int:
        """Node that stands for one of the roots."""
        return self._make(self._graph.actual[node])

    def _collect(self, node: int) -> None:
        """Find the sums that a node is, whose operands have theirs."""
        graph, one = self._graph, self._graph.one
        op, of = graph.nodes[node][0], graph.operands[node]
        # where they seldom change, they stand before the terms of the other one
        factors = of if op == "mul" else of[1:] if op == "div" else []
        if graph.steady[node]:
            self._made[node], self._short[node] = node, {None: node}
        elif op in LEAVES:
            self._made[node], self._short[node] = node, {node: one}
        elif op in ("add", "sub") or True in [graph.steady[a] for a in factors]:
            sums = [self._seen.get(a) or self._see(a) for a in of]
            if op == "div":
                by: Sum = {None: _int(graph.div(one, of[1]))}
                op, sums = "mul", [(by, by, by), sums[0]]
            near, through, whole = zip(*sums, strict=True)
            self._short[node] = short = self._combined(op, *near)
            # most are the same
            self._middle[node] = short if through == near else self._combined(op, *through)
            found = short if whole == near else self._combined(op, *whole)
            self._whole[node] = found if len(found) <= MOST else short
            return
        else:
            made = self._apply(op, [self._make(a) for a in of])
            self._made[node], self._short[node] = made, {made: one}
            self._own[made] = 1 + sum(map(self._cost_of, of))
            if op == "mul":
                self._whole[node] = self._middle[node] = self._distributed(*of) or {made: one}
                return
        self._whole[node] = self._middle[node] = self._short[node]

    def _see(self, node: int) -> tuple[Sum, Sum, Sum]:
        """The sum that a node is, if it is part of one other alone, else itself or a short sum."""
        near, through, whole = self._short[node], self._middle[node], self._whole[node]
        if not self._graph.steady[node] and self._uses[node] > 1:
            near = {self._make(node): self._graph.one}
            through = self._outside(node) or near
        self._seen[node] = near, through, whole
        return near, through, whole

    def _distributed(self, a: int, b: int) -> Sum | None:
        """A product with coefficients that seldom change before it."""
        outside = [self._outside(node) for node in (a, b)]
        if not any(outside):
            return None
        one, found = self._graph.one, dict[int | None, int]()
        sums = [own or {self._make(node): one} for node, own in zip((a, b), outside, strict=True)]
        for p, c in sums[0].items():
            for q, d in sums[1].items():
                assert p is not None and q is not None
                atom = self._graph.times(p, q)
                self._own.setdefault(atom, 1)
                factor = self._graph.times(c, d)
                found[atom] = self._graph.added(found.get(atom, self._graph.zero), factor)
        return found

    def _outside(self, node: int) -> Sum:
        """A sum of few terms, whose coefficients may stand before a product with it; else none.

        Derivatives along a direction are none, which others need as they are.
        """
        own, graph = self._chosen.get(node, {}), self._graph
        few = len(own) in (1, 2) and None not in own
        if len(own) == 2:
            leaf = any(k is not None and graph.nodes[k][0] == "input" for k in own)
            few = few and not leaf and self._uses[node] <= SHARED
        return own if few and all(graph.varies[c] for c in own.values()) else {}

    def _combined(self, op: str, a: Sum, b: Sum) -> Sum:
        graph = self._graph
        if op == "mul":
            factor, terms = (a[None], b) if list(a) == [None] else (b[None], a)
            if factor == graph.one:
                return terms
            return {k: graph.times(factor, c) for k, c in terms.items()}
        found = dict(a)
        for k, c in b.items():
            own = c if op == "add" else graph.times(self._minus, c)
            before = found.get(k)
            found[k] = own if before is None else graph.added(before, own)
            if found[k] == graph.zero:
                del found[k]
        return found

    def _make(self, node: int) -> int:
        """Write a node by the shortest one of its sums."""
        if node not in self._made:
            every = self._middle[node], self._short[node], self._whole[node]
            sums = list({id(found): found for found in every}.values())
            costs = list(map(self._cost, sums))
            self._chosen[node] = found = sums[costs.index(min(costs))]
            self._made[node] = made = self._written(found)
            self._own.setdefault(made, min(costs))
        return self._made[node]

    def _grouped(self, terms: Sum) -> tuple[list[tuple[int, list[int]]], Sum]:
        """Terms that are added up before they have their coefficient, and others.

        The former are products, and what several sums are likely to have: pairs with one
        coefficient beside other such pairs.
        """
        if len(terms) == 1:
            return [], terms
        graph = self._graph
        groups: dict[int, list[int]] = {}
        for k, c in terms.items():
            if k is not None and abs(graph.values.get(c) or 0) != 1:
                groups.setdefault(c, []).append(k)
        several = [(c, sorted(some)) for c, some in groups.items() if len(some) > 1]
        found = [
            (c, some)
            for c, some in several
            if len(several) > 1 or all(graph.nodes[k][0] == "mul" for k in some)
        ]
        inside = {k for _, some in found for k in some}
        return found, {k: c for k, c in terms.items() if k not in inside}

    def _cost(self, terms: Sum) -> int:
        """Operations that a sum takes."""
        groups, others = self._grouped(terms)
        found = sum(1 + sum(self._own.get(k, 0) for k in some) for _, some in groups)
        for k, c in others.items():
            plain = abs(self._graph.values.get(c) or 0) == 1
            product = k is not None and self._graph.nodes[k][0] == "mul"
            inside = self._own.get(k, 0) if k is not None and product else 0
            found += inside if plain and product else 1 + inside
        return found

    def _cost_of(self, node: int) -> int:
        """Operations of what only one other node needs."""
        if self._graph.steady[node] or (self._uses[node] > 1 and not self._outside(node)):
            return 0
        return self._own.get(self._made[node], 0)

    def _written(self, terms: Sum) -> int:
        """A sum as a node: products with one coefficient are added up before it is."""
        graph = self._graph
        groups, others = self._grouped(terms)
        alone = others.get(None)
        if alone is not None and graph.nodes[alone][0] == "mul" and len(terms) > 1:
            if not graph.varies[graph.nodes[alone][1]]:
                self.loose.add(alone)
        parts = [graph.times(c, _int(graph.total(some))) for c, some in groups]
        parts += [c if k is None else graph.times(c, k) for k, c in others.items()]
        return _int(graph.total(parts))

    def _apply(self, op: str, args: list[int]) -> int:
        if op in ("mul", "div", "pow"):
            return _int(getattr(self._graph, op)(*args))
        return self._graph.operation(op, *args)


def _int(value: Scalar) -> int:
    assert isinstance(value, int)
    return value
