"""Python of the first pages as files, for type checkers: `python .ci/pages.py FOLDER`.

Blocks of README.md and docs/start.md are files of their own; the cells of a tutorial are one file.
"""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
BLOCK = re.compile(r"^```python\n(.*?)^```$", re.DOTALL | re.MULTILINE)
CELL = re.compile(r"^```\{code-cell\}\n(?::[^\n]*\n)*(.*?)^```$", re.DOTALL | re.MULTILINE)
# a cell that a notebook writes as a file
FILE = re.compile(r"^%%writefile (\S+)\n")
# what is foreign here and has no types
SETTINGS = """[mypy]
strict = True
untyped_calls_exclude = ufl, scipy
[mypy-scipy.*,meshio.*,gmsh.*]
ignore_missing_imports = True
# forms in UFL, which are hardly typed
[mypy-own_body,own_forms,own_joint]
disallow_untyped_defs = False
disallow_untyped_calls = False
"""


def main(folder: Path) -> None:
    """Write the files, and the settings of mypy."""
    folder.mkdir(parents=True, exist_ok=True)
    for page in (ROOT / "README.md", ROOT / "docs/start.md"):
        for k, code in enumerate(BLOCK.findall(page.read_text())):
            (folder / f"{page.stem.lower()}_{k}.py").write_text(code)
    for page in sorted((ROOT / "docs/tutorials").glob("*.md")):
        cells = CELL.findall(page.read_text())
        for cell in cells:
            if found := FILE.match(cell):
                (folder / found[1]).write_text(cell[found.end() :])
        left = (cell for cell in cells if not FILE.match(cell))
        (folder / f"{page.stem}.py").write_text("\n".join(left))
    (folder / "mypy.ini").write_text(SETTINGS)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
