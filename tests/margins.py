"""How near tests come to their bounds on round-off, over processors, hash seeds and orders.

    pytest --margins DIR ...         writes a file of what comparisons found into a directory
    python tests/margins.py DIR ...  lists bounds on round-off that were met to more than a tenth

With the option, comparisons `value < bound` and `value == approx(...)` in `assert` and `return` of
test modules are looked at as they are made, and so are calls of `assert_allclose` and `allclose`.
Without it nothing of this is imported. `.ci/margins` runs the tests in several ways and lists.
"""

import ast
import builtins
import functools
import json
import sys
import uuid
from collections.abc import Iterable
from pathlib import Path
from types import FrameType
from typing import Any

# what is at most as large, as a part of what is compared, is a bound on round-off
# (1e-7, as that of `assert_allclose` is, beside what is allowed of zeros)
ROUND_OFF = 2e-7
# what stands in a comment in or above a line whose bound is of physics, and small all the same
PHYSICS = "not round-off"
# the part of a bound that may be used up: other processors differ by as much
USED = 0.1
NUMBERS = "iufc"
OPERATORS = (ast.Lt, ast.LtE, ast.Eq)


class Looked(ast.NodeTransformer):
    """Comparisons of a test module call `_margins_compare`, with what they compare."""

    inside = 0

    def visit_Assert(self, node: ast.stmt) -> Any:
        self.inside += 1
        self.generic_visit(node)
        self.inside -= 1
        return node

    visit_Return = visit_Assert

    def visit_Compare(self, node: ast.Compare) -> Any:
        self.generic_visit(node)
        if not self.inside or not all(isinstance(op, OPERATORS) for op in node.ops):
            return node
        parts: list[ast.expr] = [node.left, *node.comparators]
        less = ast.Tuple([ast.Constant(not isinstance(op, ast.Eq)) for op in node.ops], ast.Load())
        sources = ast.Tuple([ast.Constant(ast.unparse(part)) for part in parts], ast.Load())
        # parts are made once, in their order, and the comparison is Python's own
        arguments = [ast.Name(f"_margins_{k}", ast.Load()) for k in range(len(parts))]
        lambda_ = ast.Lambda(
            ast.arguments([], [ast.arg(a.id) for a in arguments], None, [], [], None, []),
            ast.Compare(arguments[0], node.ops, list(arguments[1:])),
        )
        name = ast.Name("_margins_compare", ast.Load())
        call = ast.Call(name, [lambda_, less, sources, *parts], [])
        return ast.fix_missing_locations(ast.copy_location(call, node))


@functools.cache
def nodes(source: str) -> list[ast.AST]:
    return list(ast.walk(ast.parse(source, mode="eval")))


def relative(source: str, bound: float, frame: FrameType) -> float:
    """A bound, or what it is of a size: the smallest number in its source, where there is one."""
    found: list[float] = []
    if isinstance(nodes(source)[1], ast.BinOp) and isinstance(nodes(source)[1].op, ast.Add):
        # more than something: how much of it is used cannot be told
        return bound
    for node in nodes(source):
        value: Any = node.value if isinstance(node, ast.Constant) else None
        if isinstance(node, ast.Name):
            value = frame.f_locals.get(node.id, frame.f_globals.get(node.id))
        elif isinstance(node, ast.Attribute) and node.attr == "eps":
            value = sys.float_info.epsilon
        if isinstance(value, float) and value > 0.0:
            found.append(value)
    # one of several that a test chooses from is no multiple
    return bound if bound in found else min(found, default=bound)


class Margins:
    """The plugin: keeps the largest part of each bound that was used.

    Args:
        folder: Where its file goes.
    """

    def __init__(self, folder: Path) -> None:
        self.folder, self.test = folder, ""
        # by place: part of the bound, relative bound, test
        self.worst: dict[str, tuple[float, float, str]] = {}

    def keep(self, frame: FrameType, used: float, bound: float) -> None:
        """Remember a comparison that came out true."""
        place = f"{frame.f_code.co_filename.rpartition('/tests/')[2]}:{frame.f_lineno}"
        if 0.0 < bound <= ROUND_OFF and used > self.worst.get(place, (-1.0,))[0]:
            self.worst[place] = (used, bound, self.test)

    def compare(self, decide: Any, less: Any, sources: Any, *parts: Any) -> Any:
        """What a comparison is rewritten into."""
        result = decide(*parts)
        import numpy as np

        frame = sys._getframe(1)
        # objects may define `<` as they like
        if not isinstance(result, bool | np.bool_ | np.ndarray) or not np.all(result):
            return result
        for k, is_less in enumerate(less):
            a, b = parts[k : k + 2]
            if not is_less:
                for approx, value in ((a, b), (b, a)):
                    if type(approx).__name__.startswith("Approx"):
                        self.approximate(frame, approx, value)
                continue
            low, high = np.asarray(a), np.asarray(b)
            if not (low.dtype.kind in NUMBERS and high.dtype.kind in NUMBERS):
                continue
            if high.size and low.size and len(less) > k + 1 and low.min() > 0.0:
                continue  # what is at least so much has no margin to lose
            if high.size and high.min() > 0.0:
                bound = relative(sources[k + 1], float(high.max()), frame)
                self.keep(frame, float(np.max(low / high, initial=0.0)), bound)
            elif low.size and low.max() < 0.0:
                bound = relative(sources[k], float(-low.min()), frame)
                self.keep(frame, float(np.max(high / low, initial=0.0)), bound)
        return result

    def approximate(self, frame: FrameType, approx: Any, value: Any) -> None:
        """A comparison with `pytest.approx`, of a number or of several."""
        import numpy as np

        if np.ndim(approx.expected) == 0 and approx.expected != approx.expected:
            # what is expected to be no number has no bound
            return
        if isinstance(approx.expected, dict):
            pairs = [(approx._approx_scalar(e), value[k]) for k, e in approx.expected.items()]
        elif hasattr(approx, "tolerance"):
            pairs = [(approx, value)]
        else:
            expected = np.ravel(np.asarray(approx.expected, dtype=object))
            values = np.broadcast_to(np.asarray(value, dtype=object), np.shape(approx.expected))
            scalars = map(approx._approx_scalar, expected)
            pairs = list(zip(scalars, values.flat, strict=True))
        found = [
            (abs(v - s.expected), s.tolerance, abs(s.expected))
            for s, v in pairs
            if isinstance(s.expected, (int, float, np.number))
            and s.expected == s.expected
            and s.tolerance > 0
        ]
        if found:
            error, bound, size = (np.array(x, dtype=float) for x in zip(*found, strict=False))
            self.keep_all(frame, error, bound, size)

    def keep_all(self, frame: FrameType, error: Any, bound: Any, size: Any) -> None:
        """Errors with their bounds, which are seen against the largest of what is compared."""
        largest = float(size.max())
        self.keep(
            frame, float((error / bound).max()), float(bound.max()) / (largest if largest else 1.0)
        )

    def wrapped(self, function: Any, rtol: float) -> Any:
        """`assert_allclose` or `allclose`, looked at."""
        import numpy as np

        default = {"rtol": rtol, "atol": 0.0 if rtol == 1e-7 else 1e-8}

        @functools.wraps(function)
        def looked(a: Any, b: Any, *args: Any, **more: Any) -> Any:
            result = function(a, b, *args, **more)
            given = default | dict(zip(("rtol", "atol"), args, strict=False)) | more
            x, y = np.broadcast_arrays(np.asarray(a), np.asarray(b))
            if not (x.dtype.kind in NUMBERS and y.dtype.kind in NUMBERS):
                return result
            tolerance = given["atol"] + given["rtol"] * np.abs(y)
            some = (tolerance > 0) & np.isfinite(x) & np.isfinite(y)
            if some.any() and result is not False:
                error = np.abs(x - y)[some]
                self.keep_all(sys._getframe(1), error, tolerance[some], np.abs(y)[some])
            return result

        return looked

    def start(self) -> None:
        """Look at all test modules that are imported from now on."""
        import _pytest.assertion.rewrite as rewrite
        import numpy as np

        plain, builtins._margins_compare = rewrite.rewrite_asserts, self.compare  # type: ignore
        rewrite.rewrite_asserts = lambda tree, *a: plain(Looked().visit(tree), *a)
        # modules compiled without are kept beside
        rewrite.PYC_TAIL = f".margins{rewrite.PYC_TAIL}"
        np.testing.assert_allclose = self.wrapped(np.testing.assert_allclose, 1e-7)
        np.allclose = self.wrapped(np.allclose, 1e-5)

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        self.test = nodeid

    def pytest_sessionfinish(self) -> None:
        self.folder.mkdir(parents=True, exist_ok=True)
        if self.worst:
            (self.folder / f"{uuid.uuid4()}.json").write_text(json.dumps(self.worst, indent=1))


def merged(folders: Iterable[Path]) -> dict[str, tuple[float, float, str]]:
    """The largest part of each bound that was used in any run."""
    worst: dict[str, tuple[float, float, str]] = {}
    for file in sorted(f for folder in folders for f in folder.rglob("*.json")):
        for place, found in json.loads(file.read_text()).items():
            worst[place] = max(worst.get(place, (-1.0, 0.0, "")), tuple(found))
    return worst


def physics(place: str) -> bool:
    """Whether a bound is said to be of physics."""
    name, _, line = place.rpartition(":")
    file = Path(__file__).parent / name
    lines = file.read_text().split("\n") if file.exists() else []
    return PHYSICS in "".join(lines[max(int(line) - 2, 0) : int(line)])


def main(folders: list[str]) -> int:
    """Print bounds that are too near; the exit code is 1 if there are any."""
    worst = {p: found for p, found in merged(map(Path, folders)).items() if not physics(p)}
    near = sorted((found, place) for place, found in worst.items() if found[0] > USED)
    for (used, bound, test), place in reversed(near):
        print(f"{used:8.2g} of {bound:<8.2g} {place}  {test.rpartition('::')[2]}")
    print(f"{len(worst)} bounds on round-off, {len(near)} of them met to more than {USED:g}")
    return int(bool(near) or not worst)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
