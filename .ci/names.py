"""Names that we use of DOLFINx, UFL, FFCx and Basix, and whether a version has them.

    python .ci/names.py            # which of them the installed versions lack, and where a name has
                                   # moved to; exit code 1 if there is one
    python .ci/names.py --list     # all of them

The names are read from the sources. Only the standard library and the four packages are needed: run
it in an environment with the next DOLFINx before anything else of ours works there.
"""

from __future__ import annotations

import ast
import contextlib
import functools
import importlib
import pkgutil
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("dolfinx", "ufl", "ffcx", "basix")
FOLDERS = ("shellmb", "forms", "demos")


def _aliases(tree: ast.AST) -> dict[str, str]:
    """What names of a module mean, of those that come from the packages."""
    found: dict[str, str] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for one in node.names:
                if one.name.split(".")[0] in PACKAGES:
                    found[one.asname or one.name.split(".")[0]] = (
                        one.name if one.asname else one.name.split(".")[0]
                    )
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            if node.module.split(".")[0] in PACKAGES:
                found |= {one.asname or one.name: f"{node.module}.{one.name}" for one in node.names}
    return found


def _chain(node: ast.expr) -> list[str] | None:
    """`a.b.c` as its parts; None of anything else."""
    parts: list[str] = []
    while isinstance(node, ast.Attribute):
        parts.append(node.attr)
        node = node.value
    return [node.id, *reversed(parts)] if isinstance(node, ast.Name) else None


@functools.cache
def used() -> list[str]:
    """Every name that the sources use, in full."""
    found: set[str] = set()
    for folder in FOLDERS:
        for file in sorted((ROOT / folder).rglob("*.py")):
            tree = ast.parse(file.read_text())
            aliases = _aliases(tree)
            found |= set(aliases.values())
            for node in ast.walk(tree):
                parts = _chain(node) if isinstance(node, ast.Attribute) else None
                if parts and parts[0] in aliases:
                    found.add(_longest(".".join([aliases[parts[0]], *parts[1:]])))
    return sorted(found)


def _longest(name: str) -> str:
    """The part of a chain up to the first class or function: what follows is not a module's."""
    parts = name.split(".")
    for k in range(1, len(parts)):
        if parts[k][:1].isupper() or parts[k].startswith("__"):
            return ".".join(parts[: k + 1])
    return name


def there(name: str) -> bool:
    """Whether the installed versions have a name."""
    parts = name.split(".")
    for k in range(len(parts), 0, -1):
        try:
            value = importlib.import_module(".".join(parts[:k]))
        except ImportError:
            continue
        for part in parts[k:]:
            if not hasattr(value, part):
                return False
            value = getattr(value, part)
        return True
    return False


def places(name: str) -> Iterator[str]:
    """Modules of the same package that have the last part of a name."""
    package, last = name.split(".")[0], name.rsplit(".", 1)[1]
    top = importlib.import_module(package)
    for info in pkgutil.walk_packages(top.__path__, f"{package}."):
        try:
            # some say on import what they lack
            with contextlib.redirect_stdout(None):
                module = importlib.import_module(info.name)
        except Exception:  # a module of theirs that cannot be imported has nothing
            continue
        if hasattr(module, last):
            yield info.name


def main() -> int:
    """Check, or list."""
    names = used()
    if "--list" in sys.argv[1:]:
        print("\n".join(names))
        return 0
    # MPI's library comes with it, before DOLFINx needs it
    importlib.import_module("mpi4py.MPI")
    versions = (f"{p} {importlib.import_module(p).__version__}" for p in PACKAGES)
    gone = [name for name in names if not there(name)]
    print(f"{', '.join(versions)}: {len(names) - len(gone)} of {len(names)} names are there")
    for name in gone:
        elsewhere = ", ".join(list(places(name))[:4]) if "." in name else ""
        print(f"{name}: {f'moved to {elsewhere}' if elsewhere else 'removed'}")
    return 1 if gone else 0


if __name__ == "__main__":
    sys.exit(main())
