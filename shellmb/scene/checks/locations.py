"""Names of edges, points and times that a scene speaks of, tried against what there is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from shellmb.errors import SceneError
from shellmb.scene.beams.beam import Beam
from shellmb.scene.lookup import listed, said
from shellmb.scene.multibody.offsets import Offset
from shellmb.scene.multibody.own_bodies import UserBody
from shellmb.scene.multibody.rigid import RigidBody
from shellmb.scene.shells.shell import Shell
from shellmb.scene.values.copies import on_trial
from shellmb.scene.values.validate import edge_names, in_words, show

if TYPE_CHECKING:
    from shellmb.scene.description import Body


def edges_of(body: Body) -> tuple[str, ...] | None:
    """Names of the edges of a body, of a beam its ends; None where only the mesh knows them."""
    if isinstance(body, Shell):
        return body.surface.edges
    if isinstance(body, Beam):
        return body.curve.point_names
    return body.region_names if isinstance(body, UserBody) else ()


def points_of(body: Body) -> tuple[str, ...] | None:
    """Names of the points of a body; None where only the mesh knows them."""
    if isinstance(body, Shell):
        return body.surface.points
    return body.curve.point_names if isinstance(body, Beam) else body.point_names


def areas_of(body: Body) -> tuple[str, ...]:
    """Names of the areas that a shell was given."""
    return tuple(body.areas) if isinstance(body, Shell) else ()


def check_edges(
    body: Body, edge: str | tuple[str, ...], who: str, areas: tuple[str, ...] = ()
) -> None:
    """Refuse edges that the body does not have.

    Args:
        body: The body.
        edge: Name or names.
        who: Who asks, for the error.
        areas: Names of areas that will do, too.

    Raises:
        SceneError: If there is one.
    """
    known = edges_of(body)
    for name in edge_names(edge):
        if known is not None and name not in (*known, *areas):
            more = f", its areas {listed(areas)}" if areas else ""
            raise SceneError(
                f"{who}: {said(body)} has no edge '{name}'; its edges are {listed(known)}{more}"
            )


def check_point(body: Body, point: Any, who: str) -> None:
    """Refuse a point that the body does not have.

    Raises:
        SceneError: If there is none of that name, or an offset from it has no direction.
    """
    known = points_of(body)
    if isinstance(point, Offset):
        if isinstance(body, RigidBody | UserBody):
            raise SceneError(
                f"{who}: an offset is from a node of a shell or beam and {said(body)} has none; "
                "give the coordinates of the point"
            )
        if not (isinstance(point.by, tuple) or isinstance(body, Shell)):
            raise SceneError(
                f"{who}: the offset is {show(point.by)} and {said(body)} has no single director; "
                "it must be a vector"
            )
        point = point.at
    if known is not None and isinstance(point, str) and point not in known:
        raise SceneError(
            f"{who}: {said(body)} has no point '{point}'; its points are "
            f"{listed(known) or 'none'}, or give coordinates"
        )


def finite_in_time(function: Any, t_end: float, who: str, size: int) -> None:
    """Try a function of time at the beginning, the middle and the end; anything else passes.

    Raises:
        SceneError: If it fails, or gives something else than ``size`` finite numbers.
    """
    if not callable(function):
        return
    # a scene is checked again with each option: its functions begin their memory in the run
    function = on_trial(function)
    for t in (0.0, t_end / 2, t_end):
        given_at(function, t, who, size)


def given_at(function: Any, t: float, who: str, size: int) -> Any:
    """Value of a function of time.

    Raises:
        SceneError: If it fails, or gives something else than ``size`` finite numbers.
    """
    try:
        given = function(t)
    except (Exception, SystemExit) as error:
        raise SceneError(
            f"{who} fails at t = {t:g} ({in_words(error)}); it must give {_wanted(size)}"
        ) from error
    return numbers_at(given, t, who, size)


def numbers_at(given: Any, t: float, who: str, size: int = 1) -> Any:
    """Numbers that a function of time gave, checked.

    Args:
        given: It.
        t: The time [s].
        who: What messages call the function.
        size: How many numbers it must be.

    Raises:
        SceneError: If it is something else than ``size`` finite numbers.
    """
    try:
        value = np.asarray(given)
    except (TypeError, ValueError):
        value = np.asarray("")
    # texts, complex numbers and truth values are no numbers, nor is an array that has one
    shape = () if size == 1 else (size,)
    if not (value.dtype.kind in "iuf" and value.shape == shape and np.isfinite(value).all()):
        raise SceneError(f"{who} gives {show(given)} at t = {t:g}; it must give {_wanted(size)}")
    return value


def _wanted(size: int) -> str:
    return "a finite number" if size == 1 else f"{size} finite numbers"
