"""Names of edges, points and times that a scene speaks of, tried against what there is."""

from __future__ import annotations

from typing import Any

import numpy as np

from shellmb.errors import SceneError
from shellmb.scene.beams.beam import Beam
from shellmb.scene.lookup import Body, listed, said
from shellmb.scene.shells.shell import Shell
from shellmb.scene.values.validate import edge_names, in_words, show

__all__ = ["check_edges", "check_point", "edges_of", "finite_in_time", "points_of"]


def edges_of(body: Body) -> tuple[str, ...] | None:
    """Names of the edges of a body, of a beam its ends; None where only the mesh knows them."""
    if isinstance(body, Shell):
        return body.surface.edges
    return body.curve.point_names if isinstance(body, Beam) else ()


def points_of(body: Body) -> tuple[str, ...] | None:
    """Names of the points of a body; None where only the mesh knows them."""
    if isinstance(body, Shell):
        return body.surface.points
    return body.curve.point_names if isinstance(body, Beam) else body.point_names


def check_edges(body: Body, edge: str | tuple[str, ...], who: str) -> None:
    """Refuse edges that the body does not have.

    Raises:
        SceneError: If there is one.
    """
    known = edges_of(body)
    for name in edge_names(edge):
        if known is not None and name not in known:
            raise SceneError(
                f"{who}: {said(body)} has no edge '{name}'; its edges are {listed(known)}"
            )


def check_point(body: Body, point: Any, who: str) -> None:
    """Refuse a point that the body does not have.

    Raises:
        SceneError: If there is none of that name, or several are named.
    """
    known = points_of(body)
    if isinstance(point, tuple) and isinstance(point[0], str):
        raise SceneError(f"{who}: point is {show(point)}; it must be one point")
    if known is not None and isinstance(point, str) and point not in known:
        raise SceneError(
            f"{who}: {said(body)} has no point '{point}'; its points are {listed(known)}, "
            "or give coordinates"
        )


def finite_in_time(function: Any, t_end: float, who: str, size: int) -> None:
    """Try a function of time at the beginning, the middle and the end; anything else passes.

    Raises:
        SceneError: If it fails, or gives something else than ``size`` finite numbers.
    """
    if not callable(function):
        return
    wanted = "a finite number" if size == 1 else f"{size} finite numbers"
    for t in (0.0, t_end / 2, t_end):
        try:
            given = function(t)
            value = np.asarray(given)
        except Exception as error:
            raise SceneError(
                f"{who} fails at t = {t:g} ({in_words(error)}); it must give {wanted}"
            ) from error
        # a truth value may switch something, a text is no number
        if not (value.dtype.kind in "biuf" and value.size == size and np.isfinite(value).all()):
            raise SceneError(f"{who} gives {show(given)} at t = {t:g}; it must give {wanted}")
