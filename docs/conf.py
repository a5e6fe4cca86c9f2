"""Documentation of shellmb: Sphinx with MyST, tutorials executed when it is built (myst-nb).

    uv run --group docs sphinx-build -W --keep-going -j 2 docs docs/_build/html

The first build executes the tutorials, two at a time: about five minutes of processor time in all.

Sphinx, as FEniCSx itself uses it: equations, cross references that are checked, an API reference
from docstrings, and tutorials that are text files which run.
"""

import importlib
import re
import shutil
import subprocess
import sys
from importlib.metadata import version as version_of
from pathlib import Path
from typing import Any

project = "shellmb"
author = "the developers of shellmb"
copyright = author
version = release = version_of("shellmb")

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx_design",
    # formulas without a network
    "sphinx-mathjax-offline",
]
exclude_patterns = ["_build", "jupyter_execute"]
html_theme = "furo"
html_title = "shellmb"
html_static_path = ["style"]
html_css_files = ["wide.css"]

myst_enable_extensions = ["amsmath", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3
# a tutorial that fails, fails the build; one that has not changed is not run again
nb_execution_mode = "cache"
nb_execution_raise_on_error = True
nb_execution_timeout = 300
# what tutorials write is not left beside them
nb_execution_in_temp = True
nb_execution_cache_path = str(Path(__file__).parent / "_build" / "tutorials")
# what runs say of their progress
nb_output_stderr = "remove"
nb_merge_streams = True

autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True}
# docstrings put code between single backticks
default_role = "code"
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True
# what a dataclass's `Args` describe are its attributes: say them once
python_use_unqualified_type_names = True
suppress_warnings = ["ref.python"]

# users write `import shellmb as sm`; the reference names functions as they do
sys.modules["sm"] = importlib.import_module("shellmb")

linkcheck_timeout = 20
linkcheck_anchors = False


def _markdown(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Bars and stars outside of code are letters."""
    for k, line in enumerate(lines):
        parts = re.split(r"(``[^`]+``|`[^`]+`)", line)
        for j, part in enumerate(parts):
            if not part.startswith("`") and not line.startswith("    "):
                parts[j] = part.replace("|", r"\|").replace("**", r"\*\*")
        lines[k] = "".join(parts)


def _without_checks(text: str) -> str:
    """A type without what checks its values: `Annotated[float, Gt(0)]` is `float`."""
    while found := re.search(r"~?(?:\w+\.)*Annotated\[", text):
        depth, first, end = 1, None, found.end()
        while depth:
            depth += (text[end] in "[(") - (text[end] in "])")
            if depth == 1 and text[end] == "," and first is None:
                first = end
            end += 1
        text = text[: found.start()] + text[found.end() : first] + text[end:]
    return text


def _types(app: Any, *_: Any) -> None:
    """Types as a reader needs them, before they are written beside their parameters."""
    for types in app.env.current_document.autodoc_annotations.values():
        types.update({name: _without_checks(text) for name, text in types.items()})


def _commands(app: Any) -> None:
    """The command line's own help, as a page."""
    command = ["-m", "typer", "shellmb.cli.main", "utils", "docs", "--name", "shellmb"]
    said = subprocess.run([sys.executable, *command], capture_output=True, text=True, check=True)
    text = said.stdout.replace("# `shellmb`\n", "# Commands\n", 1)
    # the list of commands cuts their summaries short
    for name, summary in re.findall(r"^## `shellmb (\w+)`\n\n(.+?)\n\n", text, re.M | re.S):
        line = f"* `{name}`: {' '.join(summary.split())}".replace("\\", r"\\")
        text = re.sub(rf"^\* `{name}`: .*$", line, text, flags=re.M)
    page = Path(app.srcdir) / "reference" / "commands.md"
    if not page.exists() or page.read_text() != text:
        page.write_text(text)


def _begin(app: Any) -> None:
    """Start anew after a build that was stopped: Sphinx would write only what has changed since."""
    mark = Path(app.outdir) / ".unfinished"
    if mark.exists():
        print("the last build was interrupted: all pages are built again", flush=True)
        shutil.rmtree(app.doctreedir, ignore_errors=True)
    mark.parent.mkdir(parents=True, exist_ok=True)
    mark.touch()


def _end(app: Any, exception: Exception | None) -> None:
    """A build that comes to its end is whole."""
    if exception is None:
        (Path(app.outdir) / ".unfinished").unlink(missing_ok=True)


def _inside(app: Any, what: str, name: str, obj: Any, skip: bool, options: Any) -> bool | None:
    """Leave out what modules of the scene have for one another: it is not in `shellmb.scene`."""
    scene = importlib.import_module("shellmb.scene")
    of_scene = str(getattr(obj, "__module__", "")).startswith("shellmb.scene.")
    return True if what == "module" and of_scene and name not in scene.__all__ else None


def setup(app: Any) -> None:
    """Hooks of Sphinx."""
    _begin(app)
    # it only adds files, and does not say that pages may be read two at a time (`-j 2`)
    app.extensions["sphinx-mathjax-offline"].parallel_read_safe = True
    app.connect("build-finished", _end)
    app.connect("builder-inited", _commands)
    app.connect("autodoc-skip-member", _inside)
    app.connect("autodoc-process-docstring", _markdown, priority=100)
    app.connect("object-description-transform", _types, priority=400)
