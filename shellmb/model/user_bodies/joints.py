"""Equations of joints, looked through before anything is built: of a user's own and all others."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

from mpi4py import MPI as _MPI  # noqa: F401  (before dolfinx)

import basix.ufl
import ufl
from ufl.algorithms.analysis import extract_coefficients
from ufl.core.expr import Expr

from shellmb.errors import SceneError
from shellmb.forms.constraints.joints import JointKind, Place
from shellmb.forms.steps.path import is_quadratic
from shellmb.model.user_forms import called
from shellmb.scene.multibody.joints import Joint, OwnJoint
from shellmb.scene.values.validate import show

# kinds of unknowns that equations are of: of the first place, of the second, values over time
Groups = tuple[Expr, Expr, Expr, Expr, Expr]


def own_kind(joint: OwnJoint, framed: tuple[int, int]) -> JointKind:
    """Kind of a user's joint: as many rows as its function has, of what these depend on.

    Args:
        joint: The description.
        framed: Numbers of directors of both places.

    Raises:
        SceneError: If the function fails, or returns no scalars.
    """
    who, equations = f"{joint.said}: constraints", joint.constraints

    def listed(a: Place, b: Place, length: Expr, *given: Expr) -> list[Expr]:
        value = called(equations, (a, b, *given), who)
        rows: Any = value if isinstance(value, list | tuple) else [value]
        try:
            found = [ufl.as_ufl(row) for row in rows]
            # a vector of UFL has rows, too
            found = [part for row in found for part in (row if len(row.ufl_shape) == 1 else [row])]
        except (TypeError, ValueError):
            found = []
        if not found or any(row.ufl_shape for row in found):
            raise SceneError(
                f"{who} {show(equations)} returns {show(value)}; it must return a list of scalars "
                "of UFL"
            )
        return found

    parts = _unknowns(framed, len(joint.values))
    rows = listed(*_arguments(parts, framed, len(joint.values)))
    on_first, turns_first, on_second, turns_second, _ = (_of(rows, part) for part in parts)
    vectors = 3 * any(turns_first), 3 * any(turns_second)
    moves = zip(on_first, on_second, strict=True)
    directions = tuple(k for k, depends in enumerate(moves) if not any(depends))
    return JointKind(len(rows), listed, vectors, directions)


@cache
def _space(size: int) -> ufl.FunctionSpace:
    mesh = ufl.Mesh(basix.ufl.element("Lagrange", "interval", 1, shape=(3,)))
    return ufl.FunctionSpace(mesh, basix.ufl.element("DG", "interval", 0, shape=(size,)))


def _unknowns(framed: tuple[int, int], given: int) -> Groups:
    first, second = (max(3 * n, 1) for n in framed)
    sizes = 3, first, 3, second, max(given, 1)
    a, d, b, e, s = (ufl.Coefficient(_space(n)) for n in sizes)
    return a, d, b, e, s


def _arguments(parts: Groups, framed: tuple[int, int], given: int) -> tuple[Any, ...]:
    """Arguments of a function of equations: places, a length, values."""
    xs, es = (parts[0], parts[2]), (parts[1], parts[3])
    places = (
        Place(x, tuple(ufl.as_vector([e[3 * k + i] for i in range(3)]) for k in range(n)))
        for x, e, n in zip(xs, es, framed, strict=True)
    )
    return (*places, ufl.as_ufl(1.0), *(parts[4][k] for k in range(given)))


def _of(rows: list[Expr], part: Expr) -> list[bool]:
    """Find which rows depend on a kind of unknowns."""
    return [part in extract_coefficients(row) for row in rows]


def check_equations(joint: Joint, kind: JointKind, framed: tuple[int, int], given: int) -> None:
    """See that a joint's equations are as many as it says, quadratic, and about its bodies.

    Args:
        joint: The description.
        kind: Its kind.
        framed: Numbers of directors that its places have.
        given: Number of its values over time.

    Raises:
        SceneError: Names the joint and the row.
    """
    count, wrong = _looked_through(kind.constraints, framed, given)
    if count != kind.rows:
        raise SceneError(
            f"{joint.said}: its kind has {kind.rows} rows, and its function returns {count} "
            "constraints; both must be the same number"
        )
    for row, what in wrong:
        raise SceneError(f"{joint.said}: constraint {row} {what}")


@cache
def _looked_through(
    function: Callable[..., list[Expr]], framed: tuple[int, int], given: int
) -> tuple[int, tuple[tuple[int, str], ...]]:
    """Number of rows of a function of equations, and what is wrong with which."""
    parts = _unknowns(framed, given)
    rows = function(*_arguments(parts, framed, given))
    sizes = [ufl.shape(part)[0] for part in parts]
    whole, found = ufl.Coefficient(_space(sum(sizes))), []
    on_bodies = zip(*(_of(rows, part) for part in parts[:4]), strict=True)
    for k, (row, depends) in enumerate(zip(rows, on_bodies, strict=True)):

        def at(q: Expr, row: Expr = row) -> Expr:
            begin, places = 0, {}
            for part, size in zip(parts, sizes, strict=True):
                places[part] = ufl.as_vector([q[begin + i] for i in range(size)])
                begin += size
            return ufl.as_vector([ufl.replace(row, places)])

        if not any(depends):
            found.append((k, "does not depend on the places of its bodies; it must"))
        elif not is_quadratic(at, whole):
            found.append(
                (
                    k,
                    "is not quadratic in positions, directors and values over time; it must be, "
                    "as a distance is by its square",
                )
            )
    return len(rows), tuple(found)
