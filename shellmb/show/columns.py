"""A table that says which columns it has where one is asked for that is not there."""

from typing import Any

import pandas as pd

from shellmb.errors import SceneError

__all__ = ["Columns"]


class _NoColumn(SceneError, KeyError):
    """A column that is not there; pandas itself looks for some, and expects a KeyError."""

    __str__ = Exception.__str__


class Columns(pd.DataFrame):
    """A table; what is made of it is a table of pandas' own."""

    def __getitem__(self, key: Any) -> Any:
        """Columns by their names, as of pandas.

        Raises:
            SceneError: If there is none of that name.
        """
        try:
            return super().__getitem__(key)
        except KeyError:
            raise _NoColumn(
                f"history: there is no column {key!r}; it has {', '.join(map(str, self.columns))}"
            ) from None
