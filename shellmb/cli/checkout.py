"""Commands whose cases only a checkout has: what compares shellmb with others is not installed."""

import importlib
from types import ModuleType

from shellmb.errors import SceneError


def of_checkout(name: str, command: str) -> ModuleType:
    """A module that only a checkout has.

    Args:
        name: Its name in `demos/`, such as "studies.bundled".
        command: The command that needs it.

    Raises:
        SceneError: If shellmb is installed without a checkout.
    """
    try:
        return importlib.import_module(f"shellmb.demos.{name}")
    except ModuleNotFoundError as error:
        if not (error.name or "").startswith("shellmb.demos."):
            raise
        raise SceneError(
            f"`{command}` belongs to a checkout of shellmb, run it there: `python3 -m uv run "
            f"{command}`"
        ) from None
