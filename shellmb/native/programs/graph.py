"""Scalars of an integrand as a graph: each value once, with derivatives by the chain rule.

A node is one operation on other nodes; equal operations are one node. What is linear in arguments
(test and trial functions) is a `Multilinear`: the coefficient of each argument's value, or of each
product of two.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import reduce
from typing import Any, NamedTuple, Protocol


class Input(NamedTuple):
    """The value of a component of a function at a point, or of a derivative of it.

    Args:
        source: Number of a coefficient; -1 for the coordinates; -2 - k for argument k.
        component: Number of the component.
        orders: How often it is derived along each reference coordinate.
    """

    source: int
    component: int
    orders: tuple[int, ...]

    def derived(self, along: int) -> Input:
        """Derivative of it along a reference coordinate."""
        orders = (*self.orders[:along], self.orders[along] + 1, *self.orders[along + 1 :])
        return self._replace(orders=orders)


# products of arguments' values, of none, one or two
Key = tuple[Input, ...]


class Multilinear:
    """A value that is linear in arguments: coefficients of their values.

    Args:
        parts: Nodes by the arguments that they belong to.
    """

    __slots__ = ("parts",)

    def __init__(self, parts: dict[Key, int]) -> None:
        self.parts = parts


Scalar = int | Multilinear


class Unsupported(Exception):
    """Something that programs do not have."""


class Direction(Protocol):
    """A direction of derivatives."""

    memo: dict[int, Scalar]

    def of_input(self, item: Input) -> Scalar:
        """Derivative of a function's value."""
        ...

    def of_variable(self, label: int, component: int) -> Scalar | None:
        """Derivative of a variable's component; None if it is that of what the variable is."""
        return None

    def through(self, node: int, change: Scalar) -> Scalar:
        """Derivative of a variable's component, by that of what the variable is."""
        return change


# operations of two numbers, of one, and those that choose
BINARY = ("add", "sub", "mul", "div", "pow", "atan2", "min", "max")
UNARY = (
    "sqrt", "abs", "sign", "exp", "log", "sin", "cos", "tan", "asin", "acos", "atan", "sinh",
    "cosh", "tanh", "erf",
)  # fmt: skip
LEAVES = frozenset({"number", "constant", "entity", "input", "weight"})
COMPARED = frozenset({"lt", "le", "gt", "ge", "eq", "ne", "and", "or", "not"})


class Graph:
    """Nodes of an integrand.

    Args:
        static: Sources of values that seldom change.

    Attributes:
        nodes: Operations, each with what it is of; those come before it.
        operands: Nodes that each is of, those that variables are in place of these.
        values: Numbers, of nodes that are such.
        varies: Whether each node's value depends on the point or the cell.
        steady: Whether each node's value seldom changes.
        actual: Nodes that variables are; others are themselves.
    """

    def __init__(self, static: Collection[int] = ()) -> None:
        self.nodes: list[tuple[Any, ...]] = []
        self.operands: list[list[int]] = []
        self.values: dict[int, float] = {}
        self.varies: list[bool] = []
        self.steady: list[bool] = []
        self.actual: list[int] = []
        self._static = static
        self._known: dict[tuple[Any, ...], int] = {}
        self.zero, self.one = self.number(0.0), self.number(1.0)

    def operation(self, *node: Any) -> int:
        """Any operation as it is; one where a comparison holds, zero elsewhere."""
        if (found := self._known.get(node)) is not None:
            return found
        own = [*map(self.actual.__getitem__, node[1:])]
        varies, steady = map(self.varies.__getitem__, own), map(self.steady.__getitem__, own)
        return self._new(node, own, True in varies, False not in steady)

    def _leaf(self, *node: Any, varies: bool, steady: bool = True) -> int:
        found = self._known.get(node)
        return self._new(node, [], varies, steady) if found is None else found

    def _new(self, node: tuple[Any, ...], own: list[int], varies: bool, steady: bool) -> int:
        found = self._known[node] = len(self.nodes)
        self.nodes.append(node)
        self.operands.append(own)
        self.varies.append(varies)
        self.steady.append(steady)
        self.actual.append(found)
        return found

    def ordered(
        self, roots: Iterable[Iterable[int]], given: Sequence[bool]
    ) -> tuple[list[int], list[int], dict[int, int]]:
        """Nodes behind the operands of those not given, where groups end, and uses of each."""
        order, ends, operands = list[int](), list[int](), self.operands
        # of all that were reached
        uses: dict[int, int] = {}
        for group in roots:
            for root in map(self.actual.__getitem__, group):
                stack = [root]
                while stack:
                    node = stack.pop()
                    # below zero: a node whose operands are done
                    if node < 0:
                        order.append(~node)
                        for a in operands[~node]:
                            uses[a] += 1
                    elif node not in uses:
                        uses[node] = 0
                        if operands[node] and not given[node]:
                            stack += [~node, *operands[node][::-1]]
                        else:
                            order.append(node)
                uses[root] += 1
            ends.append(len(order))
        return order, ends, uses

    def number(self, value: float) -> int:
        """A number."""
        # zero has one sign
        value = float(value) + 0.0
        found = self._leaf("number", value, varies=False)
        self.values[found] = value
        return found

    def constant(self, place: int) -> int:
        """A constant of the form, by its place among all of them."""
        return self._leaf("constant", place, varies=False)

    def of_entity(self, place: int) -> int:
        """A number of the facet, by its place among those."""
        return self._leaf("entity", place, varies=False)

    def input(self, item: Input) -> int:
        """The value of a function at a point."""
        return self._leaf("input", item, varies=True, steady=item.source in self._static)

    def weight(self) -> int:
        """The weight of the point."""
        return self._leaf("weight", varies=True)

    def alias(self, label: int, component: int, of: int) -> int:
        """A component of a variable."""
        varies, steady = self.varies[of], self.steady[of]
        found = self._leaf("alias", label, component, of, varies=varies, steady=steady)
        self.actual[found] = self.actual[of]
        return found

    def add(self, a: Scalar, b: Scalar) -> Scalar:
        """Sum."""
        if isinstance(a, int) and isinstance(b, int):
            return self.added(a, b)
        if a == self.zero:
            return b
        if b == self.zero:
            return a
        if isinstance(a, int) or isinstance(b, int):
            raise Unsupported("a sum with and without an argument")
        found = dict(a.parts)
        for key, node in b.parts.items():
            found[key] = own = self.added(found.get(key, self.zero), node)
            if own == self.zero:
                del found[key]
        return Multilinear(found) if found else self.zero

    def added(self, a: int, b: int) -> int:
        """Sum of two nodes."""
        if a == self.zero:
            return b
        if b == self.zero:
            return a
        if a in self.values and b in self.values:
            return self.number(self.values[a] + self.values[b])
        return self.operation("add", a, b) if a <= b else self.operation("add", b, a)

    def negative(self, a: Scalar) -> Scalar:
        """The opposite."""
        return self.mul(self.number(-1.0), a)

    def sub(self, a: Scalar, b: Scalar) -> Scalar:
        """Difference."""
        if isinstance(a, Multilinear) or isinstance(b, Multilinear):
            return self.add(a, self.negative(b))
        if b == self.zero:
            return a
        if a == b:
            return self.zero
        if a == self.zero:
            return self.negative(b)
        x, y = self.values.get(a), self.values.get(b)
        if x is not None and y is not None:
            return self.number(x - y)
        return self.operation("sub", a, b)

    def mul(self, a: Scalar, b: Scalar) -> Scalar:
        """Product."""
        times = self.times
        if isinstance(a, int):
            if isinstance(b, int):
                return times(a, b)
            a, b = b, a
        if isinstance(b, int):
            if b == self.zero:
                return b
            if b == self.one:
                return a
            return Multilinear({key: times(b, node) for key, node in a.parts.items()})
        found: dict[Key, int] = {}
        for one, x in a.parts.items():
            for two, y in b.parts.items():
                # in the order of the arguments
                key = one + two if one[-1].source >= two[0].source else two + one
                made = times(x, y)
                found[key] = self.added(found[key], made) if key in found else made
        return linear(found, self.zero)

    def times(self, a: int, b: int) -> int:
        """Product of two nodes."""
        if a == self.zero or b == self.zero:
            return self.zero
        if a == self.one:
            return b
        if b == self.one:
            return a
        values, varies = self.values, self.varies
        if b in values:
            a, b = b, a
        if a in values:
            if b in values:
                return self.number(values[a] * values[b])
            op, *args = self.nodes[b]
            if op == "mul" and args[0] in values:
                return self.times(self.number(values[a] * values[args[0]]), args[1])
            # numbers first
            return self.operation("mul", a, b)
        # what does not vary comes first
        if varies[a] > varies[b] or (a > b and varies[a] == varies[b]):
            a, b = b, a
        return self.operation("mul", a, b)

    def div(self, a: Scalar, b: Scalar) -> Scalar:
        """Quotient."""
        if isinstance(b, Multilinear):
            raise Unsupported("a quotient by an argument")
        if isinstance(a, Multilinear):
            return self.mul(self.div(self.one, b), a)
        if a == self.zero or b == self.one:
            return a
        x, y = self.values.get(a), self.values.get(b)
        if y is not None and y != 0:
            return self.number(x / y) if x is not None else self.times(self.number(1 / y), a)
        if not self.varies[b] and self.varies[a]:
            return self.times(self.operation("div", self.one, b), a)
        return self.operation("div", a, b)

    def pow(self, a: Scalar, b: Scalar) -> Scalar:
        """Power."""
        if isinstance(a, Multilinear) or isinstance(b, Multilinear):
            if b == self.one:
                return a
            raise Unsupported("a power of an argument")
        y = self.values.get(b)
        if y is not None:
            if y == 0:
                return self.one
            if y == 0.5:
                return self.unary("sqrt", a)
            if y == int(y) and 0 < y <= 8:
                half = self.pow(a, self.number(y // 2)) if y > 1 else self.one
                found = self.mul(half, half)
                return self.mul(found, a) if y % 2 else found
            if y == -1:
                return self.div(self.one, a)
            if y == -2:
                return self.div(self.one, self.mul(a, a))
        x = self.values.get(a)
        if x is not None and y is not None:
            return self.number(x**y)
        return self.operation("pow", a, b)

    def unary(self, op: str, a: Scalar) -> Scalar:
        """A function of one number."""
        if isinstance(a, Multilinear):
            raise Unsupported(f"{op} of an argument")
        x = self.values.get(a)
        if x is not None:
            if op == "sign":
                return self.number(math.copysign(1.0, x) if x else 0.0)
            try:
                return self.number(abs(x) if op == "abs" else getattr(math, op)(x))
            except (ValueError, OverflowError):
                pass
        return self.operation(op, a)

    def binary(self, op: str, a: Scalar, b: Scalar) -> Scalar:
        """A function of two numbers that has no rules of its own."""
        if isinstance(a, Multilinear) or isinstance(b, Multilinear):
            raise Unsupported(f"{op} of an argument")
        return self.operation(op, a, b)

    def choose(self, where: int, a: Scalar, b: Scalar) -> Scalar:
        """One of two values."""
        if isinstance(a, Multilinear) or isinstance(b, Multilinear):
            parts = [x.parts if isinstance(x, Multilinear) else {} for x in (a, b)]
            if any(isinstance(x, int) and x != self.zero for x in (a, b)):
                raise Unsupported("a choice with and without an argument")
            return linear(
                {
                    key: self._choose(where, *(p.get(key, self.zero) for p in parts))
                    for key in {**parts[0], **parts[1]}
                },
                self.zero,
            )
        return self._choose(where, a, b)

    def _choose(self, where: int, a: int, b: int) -> int:
        return a if a == b else self.operation("choose", where, a, b)

    def argument(self, item: Input) -> Scalar:
        """The value of an argument."""
        return Multilinear({(item,): self.one})

    def total(self, parts: Sequence[Scalar]) -> Scalar:
        """Sum of several."""
        return reduce(self.add, parts) if parts else self.zero

    def derivative(
        self, value: Scalar, direction: Direction, of_key: Callable[[Input], Scalar] | None = None
    ) -> Scalar:
        """Derivative of a value.

        Args:
            value: The value.
            direction: The direction.
            of_key: Derivative of an argument's value; None: arguments do not change.
        """
        if isinstance(value, int):
            return self._derived(value, direction)
        parts: list[Scalar] = []
        for key, node in value.parts.items():
            parts.append(self.mul(self._derived(node, direction), Multilinear({key: self.one})))
            for k, item in enumerate(key if of_key else ()):
                assert of_key is not None
                moved = of_key(item)
                others = (*key[:k], *key[k + 1 :])
                whole: Scalar = Multilinear({others: self.one}) if others else self.one
                parts.append(self.mul(self.mul(node, moved), whole))
        return self.total(parts)

    def _derived(self, node: int, direction: Direction) -> Scalar:
        memo = direction.memo
        if node in memo:
            return memo[node]
        # without recursion: graphs are deep
        stack = [node]
        while stack:
            now = stack[-1]
            if now in memo:
                stack.pop()
                continue
            op, *args = self.nodes[now]
            if op == "alias":
                own = direction.of_variable(args[0], args[1])
                if own is not None:
                    memo[now] = own
                    continue
                args = args[2:]
            of = () if op in LEAVES else args
            missing = [a for a in of if a not in memo]
            if missing:
                stack.extend(missing)
                continue
            memo[now] = self._rule(now, op, args, [memo[a] for a in of], direction)
        return memo[node]

    def _rule(
        self, node: int, op: str, args: Sequence[Any], d: Sequence[Scalar], direction: Direction
    ) -> Scalar:
        """Derivative of a node by those of what it is of."""
        zero = self.zero
        if op == "input":
            return direction.of_input(args[0])
        if d.count(zero) == len(d) or op in COMPARED or op == "sign":
            return zero
        match op:
            case "alias":
                return direction.through(node, d[0])
            case "add":
                return self.add(d[0], d[1])
            case "sub":
                return self.sub(d[0], d[1])
            case "mul":
                a, b = args
                return self.add(self.mul(d[0], b), self.mul(a, d[1]))
            case "div":
                a, b = args
                return self.div(self.sub(d[0], self.mul(node, d[1])), b)
            case "pow":
                a, b = args
                less = self.pow(a, self.sub(b, self.one))
                found = self.mul(self.mul(b, less), d[0])
                if d[1] != zero:
                    found = self.add(found, self.mul(self.mul(node, self.unary("log", a)), d[1]))
                return found
            case "choose":
                return self.choose(args[0], d[1], d[2])
            case "min" | "max":
                where = self.operation("lt" if op == "min" else "gt", *args)
                return self.choose(where, d[0], d[1])
            case "atan2":
                a, b = args
                size = self.add(self.mul(a, a), self.mul(b, b))
                return self.div(self.sub(self.mul(b, d[0]), self.mul(a, d[1])), size)
        return self.mul(self._slope(node, op, args[0]), d[0])

    def _slope(self, node: int, op: str, a: int) -> Scalar:
        """Derivative of a function of one number."""
        one, u = self.one, self.unary
        square = self.mul(a, a)
        match op:
            case "sqrt":
                return self.div(self.number(0.5), node)
            case "abs":
                return u("sign", a)
            case "exp":
                return node
            case "log":
                return self.div(one, a)
            case "sin":
                return u("cos", a)
            case "cos":
                return self.negative(u("sin", a))
            case "tan":
                return self.add(one, self.mul(node, node))
            case "asin":
                return self.div(one, u("sqrt", self.sub(one, square)))
            case "acos":
                return self.negative(self.div(one, u("sqrt", self.sub(one, square))))
            case "atan":
                return self.div(one, self.add(one, square))
            case "sinh":
                return u("cosh", a)
            case "cosh":
                return u("sinh", a)
            case "tanh":
                return self.sub(one, self.mul(node, node))
            case "erf":
                return self.mul(
                    self.number(2 / math.sqrt(math.pi)), u("exp", self.negative(square))
                )
        raise Unsupported(op)


def linear(parts: Mapping[Key, int], zero: int) -> Scalar:
    """Linear part without what is zero; zero without any."""
    found = {key: node for key, node in parts.items() if node != zero}
    return Multilinear(found) if found else zero
