"""Modules that documentation and docstrings name are there, and so are the names in them.

Kind: a module moves, and the sentences that point at it stay.
"""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = {"shellmb": ROOT / "shellmb", "forms": ROOT / "forms", "demos": ROOT / "demos"}
CITED = re.compile(r"`((?:shellmb|forms|demos)\.[a-z][\w.]*)`")
PATHS = re.compile(r"`((?:shellmb|forms|demos|tests|docs)/[\w./-]*[\w/])`")


def files():
    places = [ROOT / name for name in ("README.md", "CONTRIBUTING.md")]
    for folder, ending in (("docs", "md"), ("demos", "md"), *((p, "py") for p in PACKAGES)):
        places += (ROOT / folder).rglob(f"*.{ending}")
    return [p for p in places if "_build" not in p.parts]


def missing(name: str) -> bool:
    """Whether no module of that name is there, or the module does not have the name behind it."""
    first, *rest = name.split(".")
    place = PACKAGES[first]
    if first == "shellmb" and rest and rest[0] in PACKAGES:
        place, rest = PACKAGES[rest[0]], rest[1:]
    while rest and (place / rest[0]).is_dir():
        place, rest = place / rest[0], rest[1:]
    if rest and (place / f"{rest[0]}.py").is_file():
        module, rest = place / f"{rest[0]}.py", rest[1:]
    else:
        # names of the package itself are in its stub
        module = place / ("__init__.pyi" if place == ROOT / "shellmb" else "__init__.py")
    return bool(rest) and not re.search(rf"\b{rest[0]}\b", module.read_text())


def test_what_is_cited_is_there():
    lost = []
    for file in files():
        text = file.read_text()
        found = [name for name in CITED.findall(text) if missing(name)]
        found += [path for path in PATHS.findall(text) if not (ROOT / path).exists()]
        lost += [f"{file.relative_to(ROOT)}: {name}" for name in found]
    assert not lost
