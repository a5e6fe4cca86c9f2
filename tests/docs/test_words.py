"""Pages, messages and first lines of public docstrings have the words of the field."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
# each with what replaces it: energy balance, comparison run, scheme of others, stated, fixed, ...
WORDS = re.compile(
    r"\b(accounts?|companions?|rivals?|told|said|weighed|doubts?|doubtful|held|ways?|rooms?"
    r"|passing through)\b",
    re.IGNORECASE,
)
FENCED = re.compile(r"^ *(```+).*?^ *\1", re.MULTILINE | re.DOTALL)
# names of an interface, and where links lead
NAMES = re.compile(r"`+[^`]*`+|\]\([^)]*\)")
# parameters and attributes, where a docstring describes them
DESCRIBED = re.compile(r"^ +\w+:", re.MULTILINE)
# what the pages of the reference show whole, or a user derives from
SHOWN = ("forms", "shellmb/api", "shellmb/scene", "shellmb/schemes", "shellmb/errors.py")
# sentences of errors that stay: of what is written to disk
MESSAGES = {
    ("shellmb/native/compiling/source.py", "room"),
    ("shellmb/native/compiling/folder.py", "room"),
}
# made when the documentation is built
BUILT = {"_build", "commands.md"}


def pages() -> Iterator[Path]:
    yield ROOT / "README.md"
    for page in sorted((ROOT / "docs").rglob("*.md")):
        if not BUILT & set(page.parts):
            yield page


def words(text: str) -> set[str]:
    plain = " ".join(NAMES.sub(" ", FENCED.sub("", text)).split())
    return {word.lower() for word in WORDS.findall(plain)}


def docstrings(node: ast.AST, place: str) -> Iterator[tuple[str, str]]:
    """Docstrings of public modules, classes and functions."""
    if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
        if text := ast.get_docstring(node):
            yield place, text
        for child in node.body:
            name = str(getattr(child, "name", "_"))
            if not name.startswith("_") or name.startswith("__"):
                yield from docstrings(child, f"{place}.{name}")


def messages(path: Path) -> Iterator[str]:
    """Sentences of a module: its strings of several words that are no docstrings."""
    tree = ast.parse(path.read_text())
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef)
    docstrings = {
        node.body[0].value
        for node in ast.walk(tree)
        if isinstance(node, documented) and node.body and isinstance(node.body[0], ast.Expr)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            if node not in docstrings and " " in node.value.strip():
                yield node.value


def test_pages_have_the_words_of_the_field() -> None:
    assert not {
        (str(page.relative_to(ROOT)), word) for page in pages() for word in words(page.read_text())
    }


def test_docstrings_have_the_words_of_the_field() -> None:
    """First lines everywhere; all of it where the reference shows it."""
    found = []
    for folder in ("shellmb", "forms"):
        for path in sorted((ROOT / folder).rglob("*.py")):
            name = str(path.relative_to(ROOT))
            for place, text in docstrings(ast.parse(path.read_text()), name):
                shown = text if name.startswith(SHOWN) else text.splitlines()[0]
                if strange := words(DESCRIBED.sub("", shown)):
                    found.append((place, strange))
    assert not found


def test_messages_have_the_words_of_the_field() -> None:
    """What runs, errors, warnings, progress, help and reports write."""
    found = {
        (str(path.relative_to(ROOT)), word)
        for folder in ("shellmb", "forms")
        for path in sorted((ROOT / folder).rglob("*.py"))
        for text in messages(path)
        for word in words(text)
    }
    assert MESSAGES <= found, "an exception that no message needs"
    assert not found - MESSAGES


def test_summaries_have_the_numbers_of_their_tables() -> None:
    """The first screen of a page repeats numbers that a command writes further down."""
    page = (ROOT / "docs" / "evidence" / "stated_errors.md").read_text()
    text = " ".join(page.split())
    ((covered, count, median, cost),) = re.findall(
        r"the true error is at most the stated one in (\d+) % of (\d+) with a stated error; stated "
        r"over true is (\S+) in the median.*?take (\S+) times the processor time",
        text,
    )
    top = " ".join((ROOT / "docs" / "evidence" / "accuracy.md").read_text().split())
    assert f"at most the stated one in {covered} % of {count} quantities" in top
    assert float(median) == 2 and "twice the true one in the median" in top
    assert f"Errors cost {float(cost) - 1:.1f} of a run" in top
    how = (ROOT / "docs" / "howto" / "errors.md").read_text()
    assert f"at most the stated one in {covered} % of the cases" in how
    requests = page.partition("<!-- requests: begin -->")[2].partition("<!-- requests: end")[0]
    times = [float(t) for t in re.findall(r"\| \d+ \| ([\d.]+) \|", requests)]
    assert f"take {min(times):g} to {max(times):g} times" in top


def test_long_pages_begin_with_a_screen() -> None:
    """A list of what a reader must know before the details, which have pages of their own."""
    summaries = {"limits", "evidence/accuracy", "evidence/peers", "howto/errors", "howto/paths"}
    for name in summaries:
        lines = (ROOT / "docs" / f"{name}.md").read_text().splitlines()
        items = [k for k, line in enumerate(lines) if re.match(r"(- |\d+\. )", line)]
        assert items[0] < 8 and items[3] < 30, name
    for name, most in {"evidence/accuracy": 50, "evidence/peers": 75}.items():
        assert len((ROOT / "docs" / f"{name}.md").read_text().splitlines()) <= most
    lines = (ROOT / "docs" / "limits.md").read_text().splitlines()
    assert sum(bool(re.match(r"\d+\. ", line)) for line in lines[:25]) == 15
