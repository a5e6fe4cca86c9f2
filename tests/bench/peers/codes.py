"""Names of the codes, whether a peer is there, and what to do if it is not."""

from __future__ import annotations

import importlib.util

from shellmb.errors import SceneError

OURS, EXUDYN, OPENSEES, KRATOS, NGSOLVE = "shellmb", "Exudyn", "OpenSees", "Kratos", "NGSolve"


def require_package(package: str) -> None:
    """Refuse what is not installed.

    Args:
        package: Name of the package, as it is imported.

    Raises:
        SceneError: If it is not installed.
    """
    if importlib.util.find_spec(package) is None:
        name = package.partition(".")[0]
        raise SceneError(
            f"bench: the peer {name} is not installed; install the extra 'peers': "
            "`uv sync --extra peers`, or `pip install 'shellmb[peers]'`"
        )
