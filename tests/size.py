"""Lines of code of the package, without blank ones, comments and docstrings.

python -m tests.size            how many lines of Python and of C there are, by rooms
"""

from __future__ import annotations

import ast
import re
import tokenize
from collections import Counter
from io import StringIO
from pathlib import Path

ROOT = Path(__file__).parents[1]
# what a wheel has beside the demos
PACKAGES = ("shellmb", "forms")
NO_CODE = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENDMARKER,
}


def python_lines(source: str) -> int:
    """Lines of Python on which there is a token other than a comment or a docstring.

    Args:
        source: Text of a module.
    """
    lines: set[int] = set()
    for token in tokenize.generate_tokens(StringIO(source).readline):
        if token.type not in NO_CODE:
            lines.update(range(token.start[0], token.end[0] + 1))
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            first = node.body[0] if node.body else None
            if isinstance(first, ast.Expr) and ast.get_docstring(node, clean=False) is not None:
                assert first.end_lineno is not None
                lines -= set(range(first.lineno, first.end_lineno + 1))
    return len(lines)


def c_lines(source: str) -> int:
    """Lines of C that are neither blank nor comments.

    Args:
        source: Text of a file.
    """
    bare = re.sub(r"/\*.*?\*/", lambda found: "\n" * found[0].count("\n"), source, flags=re.DOTALL)
    return sum(bool(re.sub(r"//.*", "", line).strip()) for line in bare.splitlines())


def counted(root: Path = ROOT) -> dict[str, Counter[str]]:
    """Lines of "Python" and "C" in each room.

    Args:
        root: A checkout.
    """
    found: dict[str, Counter[str]] = {"Python": Counter(), "C": Counter()}
    for package in PACKAGES:
        for path in (root / package).rglob("*.*"):
            kind = {".py": "Python", ".c": "C", ".h": "C"}.get(path.suffix)
            if kind is not None:
                count = python_lines if kind == "Python" else c_lines
                room = "/".join(path.relative_to(root).parts[:-1][:2])
                found[kind][room] += count(path.read_text())
    return found


if __name__ == "__main__":
    for language, rooms in counted().items():
        for name, lines in rooms.most_common():
            print(f"{lines:7d}  {name}")
        print(f"{rooms.total():7d}  {language}\n")
