"""Functions that users write in UFL: what they return is looked at before it is used."""

import inspect
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from types import FrameType
from typing import Any

import basix.ufl
import numpy as np
import ufl
from ufl.algorithms import expand_derivatives
from ufl.algorithms.analysis import extract_arguments, extract_coefficients
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.check_arities import ArityMismatch, check_integrand_arity
from ufl.constantvalue import ScalarValue, Zero
from ufl.core.expr import Expr
from ufl.corealg.traversal import traverse_unique_terminals

from shellmb.errors import SceneError
from shellmb.forms.constraints.joints import JointKind, Place
from shellmb.forms.steps.path import is_quadratic
from shellmb.scene.multibody.joints import Joint, OwnJoint
from shellmb.scene.values.validate import in_words, show

# what numbers of Python are made of expressions by
VALUES = Expr.__float__.__code__, Expr.__complex__.__code__


def called(function: Callable[..., Any], arguments: Sequence[Any], who: str) -> Any:
    """Value that a user's function in UFL returns.

    Args:
        function: The function.
        arguments: What it is called with.
        who: What it is, for errors, as in ``"shell 'plate': energy"``.

    Raises:
        SceneError: If it fails; says in which file and line.
    """
    try:
        with _without_values():
            return function(*arguments)
    except (Exception, SystemExit) as error:
        right = "it must be written with operators and functions of UFL"
        raise _refused(function, who, f"fails ({in_words(error)}); {right}", error) from error


def _refused(
    function: Callable[..., Any], who: str, text: str, error: BaseException | None = None
) -> SceneError:
    """Error about a user's function, which it names with the place of it, or of what it raised."""
    return SceneError(f"{place_of(function, error)}{who} {show(function)} {text}")


def vector_of(function: Callable[..., Any], arguments: Sequence[Any], who: str) -> Expr:
    """The vector that a user's function returns; a scalar is one of one component.

    Args:
        function: The function.
        arguments: What it is called with.
        who: What it is, for errors.

    Raises:
        SceneError: If it fails, or returns something else; says in which file and line.
    """
    found = _returned(function, arguments, who, "scalar or a vector", 1)
    return found if found.ufl_shape else ufl.as_vector([found])


def _returned(
    function: Callable[..., Any], arguments: Sequence[Any], who: str, what: str, most: int
) -> Expr:
    """Return what a user's function returns, with so many indices at most."""
    value, found = called(function, arguments, who), None
    with suppress(TypeError, ValueError):
        found = ufl.as_ufl(value)
    if found is None or isinstance(value, bool) or len(found.ufl_shape) > most:
        text = f"returns {_said(value)}; it must return a {what} of UFL"
        raise _refused(function, who, text)
    _check_numbers(found, function, who)
    return found


def components(
    function: Callable[..., Any], arguments: Sequence[Any], who: str, parts: Mapping[str, int]
) -> list[Expr]:
    """Components of the vectors that a user's function returns as attributes of an object.

    Args:
        function: The function.
        arguments: What it is called with.
        who: What it is, for errors.
        parts: Names of the attributes, and how many components each must have.

    Raises:
        SceneError: If it fails, or returns something else; says in which file and line.
    """
    value, found = called(function, arguments, who), []
    for name, size in parts.items():
        try:
            part = ufl.as_ufl(getattr(value, name))
            right = part.ufl_shape == (size,)
        except (AttributeError, TypeError, ValueError):
            right = False
        if not right:
            given = _said(getattr(value, name, value)) + f" as {name}" * hasattr(value, name)
            right = f"ShellStrains, with {name} a vector of UFL of shape ({size},)"
            raise _refused(function, who, f"returns {given}; it must return {right}")
        _check_numbers(part, function, who)
        found += [part[k] for k in range(size)]
    return found


def written(function: Callable[..., Any], arguments: Sequence[Any], who: str) -> Expr:
    """The scalar that a user's function returns.

    Args:
        function: The function.
        arguments: What it is called with.
        who: What it is, for errors, as in ``"shell 'plate': energy"``.

    Raises:
        SceneError: If it fails, or returns something else than a number or a scalar of UFL; says in
            which file and line.
    """
    return _returned(function, arguments, who, "scalar", 0)


def _check_numbers(expression: Expr, function: Callable[..., Any], who: str) -> None:
    """Refuse numbers that are not finite or not real."""
    for number in traverse_unique_terminals(expression):
        if isinstance(number, ScalarValue):
            value = complex(number)
            if not np.isfinite(value) or value.imag:
                text = f"has the number {number}; it must be finite and real"
                raise _refused(function, who, text)


@contextmanager
def _without_values() -> Iterator[None]:
    """Refuse what asks for the value of a quantity, as `math.sin` does: UFL looks for it for hours.

    Raises:
        ValueError: Where a function asks for it.
    """
    before = sys.getprofile()

    def watch(frame: FrameType, event: str, argument: Any) -> None:
        if event == "call" and frame.f_code in VALUES:
            if not isinstance(frame.f_locals["self"], ScalarValue | Zero):
                raise ValueError("it asks for the value of a quantity, as math.sin and float do")

    sys.setprofile(watch)
    try:
        yield
    finally:
        sys.setprofile(before)


def place_of(function: Callable[..., Any], error: BaseException | None = None) -> str:
    """File and line of a user's function, or where in that file it failed: begins a sentence.

    Args:
        function: The function.
        error: What it raised; None: nothing.
    """
    code = getattr(inspect.unwrap(function), "__code__", None)
    if code is None:
        return ""
    frames = traceback.extract_tb(None if error is None else error.__traceback__)
    lines = [frame.lineno for frame in frames if frame.filename == code.co_filename]
    line = lines[-1] if lines else code.co_firstlineno
    return f"{Path(code.co_filename).name}, line {line}: "


def resists_all(
    energy: Callable[..., Any], strains: Any, parameters: Mapping[str, Expr], who: str
) -> None:
    """Refuse an energy that some strain does not enter: nothing would resist it.

    Args:
        energy: The user's function.
        strains: A named tuple of strains, each a coefficient or constant of its own.
        parameters: Second argument of the energy.
        who: What it is, for the error.

    Raises:
        SceneError: Names the strains, or says what else is wrong with the function.
    """
    value = written(energy, (strains, parameters), who)
    used = set(traverse_unique_terminals(value))
    missing = [name for name, strain in strains._asdict().items() if strain not in used]
    if missing:
        text = f"does not depend on {' and '.join(missing)}; it must resist all strains"
        raise _refused(energy, who, text)


def virtual_work(terms: Sequence[Callable[..., Any]], point: Any, dq: Expr, who: str) -> Expr:
    """Sum of a user's terms.

    Args:
        terms: Functions of a point of a shell or a beam.
        point: The point.
        dq: Variation of the state; where it is no test function but a motion, work is meant.
        who: The body, for errors.

    Raises:
        SceneError: If a term fails, or is no virtual work: linear in the variation.
    """
    at = (point,), f"{who}: term"
    if extract_arguments(dq):
        found = [virtual(term, *at, "point.du") for term in terms]
    else:
        found = [written(term, *at) for term in terms]
    return sum(found[1:], found[0])


def virtual(
    function: Callable[..., Any], arguments: Sequence[Any], who: str, du: str = "du"
) -> Expr:
    """The scalar that a user's function returns, which is linear in the test function.

    Args:
        function: The function.
        arguments: What it is called with, a test function among them.
        who: What it is, for errors.
        du: What the test function is called there.

    Raises:
        SceneError: If it fails, or is not linear.
    """
    value = written(function, arguments, who)
    if not _linear(value):
        text = f"returns {_said(value)}, which is not linear in the variation"
        right = f"it must be a virtual work, as ufl.dot(force, {du})"
        raise _refused(function, who, f"{text}; {right}")
    return value


def _linear(value: Expr) -> bool:
    """Decide whether an expression is linear in the test function, or zero."""
    lowered = expand_derivatives(apply_algebra_lowering(value))
    if isinstance(lowered, Zero) or lowered == 0:
        return True
    arguments = extract_arguments(lowered)
    if not arguments:
        return False
    try:
        check_integrand_arity(lowered, tuple(arguments))
    except ArityMismatch:
        return False
    return True


def _said(value: Any) -> str:
    """Describe what was returned; expressions of UFL are too long to be shown."""
    if isinstance(value, ScalarValue):
        return str(value)
    if isinstance(value, Expr):
        return f"an expression of shape {value.ufl_shape}" if value.ufl_shape else "an expression"
    return show(value)


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
        for row in found:
            _check_numbers(row, equations, who)
        return found

    on_bodies, _ = _looked_through(listed, framed, len(joint.values))
    vectors = tuple(3 * any(depends[k] for depends in on_bodies) for k in (1, 3))
    directions = tuple(k for k, (a, _, b, _) in enumerate(on_bodies) if not (a or b))
    return JointKind(len(on_bodies), listed, (vectors[0], vectors[1]), directions)


@cache
def _space(size: int) -> ufl.FunctionSpace:
    mesh = ufl.Mesh(basix.ufl.element("Lagrange", "interval", 1, shape=(3,)))
    return ufl.FunctionSpace(mesh, basix.ufl.element("DG", "interval", 0, shape=(size,)))


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
    rows, wrong = _looked_through(kind.constraints, framed, given)
    if len(rows) != kind.rows:
        raise SceneError(
            f"{joint.said}: its kind has {kind.rows} rows, and its function returns {len(rows)} "
            "constraints; both must be the same number"
        )
    for row, what in wrong:
        raise SceneError(f"{joint.said}: constraint {row} {what}")


@cache
def _looked_through(
    function: Callable[..., list[Expr]], framed: tuple[int, int], given: int
) -> tuple[list[list[bool]], list[tuple[int, str]]]:
    """On which unknowns each row of equations depends, and what is wrong with which."""
    # position and vectors of both places, and values over time
    sizes = [3, max(3 * framed[0], 1), 3, max(3 * framed[1], 1), max(given, 1)]
    parts = [ufl.Coefficient(_space(n)) for n in sizes]
    places = (
        Place(x, tuple(ufl.as_vector([e[3 * k + i] for i in range(3)]) for k in range(n)))
        for x, e, n in zip(parts[0:4:2], parts[1:4:2], framed, strict=True)
    )
    rows = function(*places, ufl.as_ufl(1.0), *(parts[4][k] for k in range(given)))
    whole, found = ufl.Coefficient(_space(sum(sizes))), []
    on_bodies = [[part in extract_coefficients(row) for part in parts[:4]] for row in rows]
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
            what = "positions, directors and values over time"
            found.append(
                (k, f"is not quadratic in {what}; it must be, as a distance is by its square")
            )
    return on_bodies, found
