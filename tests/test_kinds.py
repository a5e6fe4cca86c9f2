"""Bodies, and what acts on them, answer for themselves: nobody asks for their classes."""

import ast
from collections.abc import Iterable

from tests.test_architecture import MODULES, layer, parsed

ASKING = ("isinstance", "issubclass")
# bodies, and what acts on them or joins them: each answers itself what it has, is and can
KINDS = ("SceneBody", "Body", "Modal", "Joint", "Support", "Load", "Element", "Obstacle")
# of so many places in each room the class of one of them is asked for: none may ask more often
ASKED = {"scene": 9, "model": 1, "preprocessing": 3, "diagnostics": 2, "running": 4, "api": 2}


def derived(roots: Iterable[str]) -> set[str]:
    """Names of classes of the package that are derived from some, and of these."""
    bases = {
        node.name: {ast.unparse(base).split("[")[0].split(".")[-1] for base in node.bases}
        for module in MODULES
        if layer(module) not in (None, "demos")
        for node in parsed(module)
        if isinstance(node, ast.ClassDef)
    }
    found, more = set[str](), set(roots)
    while more:
        found |= more
        more = {name for name, of in bases.items() if of & found} - found
    return found


def test_kinds_answer_for_themselves() -> None:
    """Nobody asks of what class a body, joint, support, load or element of force is."""
    kinds, found = derived(KINDS), dict[str, list[str]]()
    for module in (m for m in MODULES if layer(m) not in (None, "demos")):
        for node in parsed(module):
            asked: ast.AST | None = node.cls if isinstance(node, ast.MatchClass) else None
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") in ASKING:
                asked = node.args[1]
            elif isinstance(node, ast.Compare) and ast.unparse(node.left).startswith("type("):
                asked = node.comparators[0]
            names = ast.walk(asked) if asked is not None else ()
            if {getattr(n, "attr", getattr(n, "id", "")) for n in names} & kinds:
                place = f"{module}, line {getattr(node, 'lineno', 0)}"
                found.setdefault(str(layer(module)), []).append(place)
    more = {room: places for room, places in found.items() if len(places) > ASKED.get(room, 0)}
    assert not more, "\n".join(place for places in more.values() for place in places)
