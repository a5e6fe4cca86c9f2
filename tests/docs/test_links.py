"""Links within the repository lead somewhere: pages, headings, pictures, and paths in code.

Sphinx checks those between the pages of `docs`; this one also what leads out of them, README and
the like, and files that are named. Links to the world are for `.ci/links.py`.
"""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
BUILT = "_build"
PAGES = sorted(
    page
    for pattern in ("*.md", "demos/**/*.md", "docs/**/*.md")
    for page in ROOT.glob(pattern)
    # written when the documentation is built
    if BUILT not in page.parts and page.name != "commands.md"
)
MADE = {ROOT / "docs" / "reference" / "commands.md"}
FENCED = re.compile(r"^(```|~~~).*?^\1`*\s*$", re.DOTALL | re.MULTILINE)
LINK = re.compile(r"\]\(([^)\s]+)\)")
PICTURE = re.compile(r"^```\{(?:image|figure)\} (\S+)", re.MULTILINE)
NAMED = re.compile(r"`((?:docs|demos|forms|shellmb|tests|\.ci)/[\w./-]*)`")


def anchors(page: Path) -> set[str]:
    """Headings as their pages call them."""
    text = FENCED.sub("", page.read_text())
    titles = re.findall(r"^#+ +(.+?)\s*$", text, re.MULTILINE)
    plain = [re.sub(r"[^\w\- ]", "", t.lower()).replace(" ", "-") for t in titles]
    return {*plain, *re.findall(r"^\(([\w-]+)\)=$", text, re.MULTILINE)}


def dead_links(page: Path) -> list[str]:
    """Links of a page that lead nowhere, with its name."""
    text = page.read_text()
    prose = FENCED.sub("", text)
    dead = []
    for link in [*LINK.findall(prose), *PICTURE.findall(text)]:
        if re.match(r"[a-z]+:", link):
            continue
        name, _, anchor = link.partition("#")
        target = (page.parent / name).resolve() if name else page
        if not (target.exists() or target in MADE):
            dead.append(link)
        elif anchor and target.suffix == ".md" and anchor not in anchors(target):
            dead.append(link)
    dead += [name for name in NAMED.findall(prose) if not (ROOT / name).exists()]
    return [f"{page.relative_to(ROOT)}: {link}" for link in dead]


def test_links_lead_somewhere() -> None:
    assert len(PAGES) > 50
    dead = [link for page in PAGES for link in dead_links(page)]
    assert not dead, "\n".join(dead)
