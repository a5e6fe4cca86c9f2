"""Tables of reference values in `demos/references/data`.

Each table begins with comment lines that say what is tabulated, for which data, and where it comes
from; `source` returns them.
"""

from importlib.resources import files
from io import StringIO

import pandas as pd


def _text(table: str) -> str:
    return (files("shellmb.demos.references") / "data" / f"{table}.csv").read_text(encoding="utf-8")


def source(table: str) -> str:
    """Comment lines of a table: what it holds and where it comes from.

    Args:
        table: File name without `.csv`.

    Raises:
        FileNotFoundError: If there is no such table.
    """
    comments = (line for line in _text(table).splitlines() if line.startswith("#"))
    return "\n".join(line.removeprefix("#").strip() for line in comments)


def read(table: str) -> pd.DataFrame:
    """A table as it stands, its columns named as in the file.

    Args:
        table: File name without `.csv`.

    Raises:
        FileNotFoundError: If there is no such table.
    """
    return pd.read_csv(StringIO(_text(table)), comment="#")
