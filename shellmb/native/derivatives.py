"""Derivatives of forms, taken or written only when their kernels are not known yet.

To differentiate a residual in UFL takes longer than to find the kernel of its derivative, and two
residuals of one signature have the same derivative. So beside a kernel stands, in a small file,
which kernel its derivative has and what of the residual goes into it.
"""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import ufl
from dolfinx import fem
from ufl import Form
from ufl.algorithms.analysis import extract_type, has_type
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives
from ufl.algorithms.map_integrands import map_integrands
from ufl.classes import Variable, VariableDerivative

from shellmb.native.compiling.store import writing
from shellmb.native.later import plain

Items = Sequence[Any]


@dataclass(frozen=True)
class Record:
    """The kernel of a derivative, in terms of what it can depend on.

    Attributes:
        kernel: Name of its module; empty if the derivative vanishes.
        coefficients: Which of the coefficients are its own.
        constants: Which of the constants are.
    """

    kernel: str
    coefficients: tuple[int, ...] = ()
    constants: tuple[int, ...] = ()


class CachedDerivative:
    """A derivative whose kernel can be known without it.

    Args:
        of: The form that it is a derivative of; of forms with one signature it has one kernel.
        spaces: Of its arguments.
        label: What tells it from other derivatives of the form.

    Attributes:
        coefficients: What its coefficients are among.
        constants: What its constants are among.
    """

    coefficients: Items
    constants: Items

    def __init__(self, of: Form, spaces: Items, label: str) -> None:
        self.of, self.spaces, self.label = of, spaces, label

    def form(self) -> Form:
        """The derivative in UFL; it may be empty."""
        raise NotImplementedError

    def record(self, form: Form, kernel: str) -> Record:
        """Values to remember.

        Args:
            form: The derivative in UFL.
            kernel: Name of its module.
        """
        if form.empty():
            return Record("")
        return Record(
            kernel,
            tuple(_place(c, self.coefficients) for c in form.coefficients()),
            tuple(_place(c, self.constants) for c in form.constants()),
        )

    def file(self, folder: Path, name: str) -> Path:
        """Path of the record.

        Args:
            folder: Of the kernels.
            name: Name of the module of the form that is differentiated.
        """
        return folder / f"{name}.{self.label}"


class Derivative(CachedDerivative):
    """The derivative of a form by functions that are among its coefficients.

    Args:
        form: A form.
        function: The function, or the first of them.
        others: More functions, all of one space, that change with the same unknown one.
        shares: Shares of that in all of them: a Constant, so that the derivatives by several
            unknown functions have one kernel. None: there is but one function.
    """

    def __init__(
        self,
        form: Form,
        function: fem.Function,
        others: Sequence[fem.Function] = (),
        shares: fem.Constant | None = None,
    ) -> None:
        coefficients, self._functions = form.coefficients(), (function, *others)
        self._shares, constants = shares, form.constants()
        label = "by" if shares is None else "shares"
        label += "-".join(str(coefficients.index(f)) for f in self._functions)
        spaces = [argument.ufl_function_space() for argument in form.arguments()]
        spaces.append(function.function_space)
        if shares is not None:
            constants = (shares, *constants)
        self.coefficients, self.constants = coefficients, constants
        super().__init__(form, spaces, label)

    def form(self) -> Form:
        """The derivative in UFL; it may be empty."""
        trial = ufl.TrialFunction(self.spaces[-1])
        if self._shares is None:
            return through(
                plain(self.of),
                lambda value: ufl.algorithms.expand_derivatives(
                    ufl.derivative(value, self._functions[0], trial)
                ),
            )
        shares = [self._shares[k] for k in range(len(self._functions))]
        return by_shares(plain(self.of), self._functions, shares, trial)


def by_shares(form: Form, functions: Sequence[Any], shares: Sequence[Any], trial: Any) -> Form:
    """Derivative by what several functions have shares of.

    Args:
        form: The form.
        functions: Functions of one space.
        shares: Theirs.
        trial: Direction.
    """
    return by_directions(form, functions, [share * trial for share in shares])


def by_directions(form: Form, functions: Sequence[Any], directions: Sequence[Any]) -> Form:
    """Derivative by several functions, each in a direction of its own.

    Args:
        form: The form.
        functions: The functions.
        directions: A direction for each, linear in an argument.
    """
    # gradients are derived in directions that stand by themselves
    alone = tuple(ufl.Coefficient(f.ufl_function_space()) for f in functions)
    put = dict(zip(alone, directions, strict=True))

    def take(value: Any) -> Any:
        derivative = ufl.derivative(value, tuple(functions), alone)
        return ufl.replace(apply_derivatives(apply_algebra_lowering(derivative)), put)

    return through(form, take)


def through(form: Form, take: Callable[[Any], Any]) -> Form:
    """Derivative of a form through vectors that are marked as variables, by the chain rule.

    What is made of few numbers is derived by these, and not by all unknowns: kernels of angles have
    half the code. Forms that hold derivatives by variables are derived as they are.

    Args:
        form: The form.
        take: Derivative of a form or an expression in which variables are constant.
    """
    if has_type(form, VariableDerivative) or not has_type(form, Variable):
        return take(form)
    domain = form.ufl_domain()

    @cache
    def whole(value: Any) -> Any:
        marked = [v for v in extract_type(value, Variable) if len(v.ufl_shape) == 1]
        marked.sort(key=lambda v: v.label().count())
        held = {v: ufl.variable(ufl.Constant(domain, v.ufl_shape)) for v in marked}
        rest = ufl.replace(value, held)
        found, there = take(rest), extract_type(rest, Variable)
        for v, constant in held.items():
            if constant in there:
                by = apply_derivatives(apply_algebra_lowering(ufl.diff(rest, constant)))
                found += ufl.dot(by, whole(v.ufl_operands[0]))
        return ufl.replace(found, {c: v.ufl_operands[0] for v, c in held.items()})

    return map_integrands(whole, form)


class Written(CachedDerivative):
    """A derivative that is written by hand, with a form that is always written.

    Args:
        of: That form.
        roles: Functions by what they are in the derivative, the first of the space of both of its
            arguments; those of the form may be of more rows.
        numbers: Constants, likewise: two derivatives with the same label, of forms of one
            signature, differ in these and in the functions only.
        label: What tells it from other derivatives of the form.
        write: Writes it.
    """

    def __init__(
        self, of: Form, roles: Items, numbers: Items, label: str, write: Callable[[], Form]
    ) -> None:
        # what is one in two places here may be two in another derivative, which has another kernel
        places = {id(item): k for k, item in reversed([*enumerate((*roles, *numbers))])}
        if len(places) < len(roles) + len(numbers):
            pattern = [places[id(item)] for item in (*roles, *numbers)]
            label += f"-{zlib.crc32(bytes(pattern)):x}"
        space = roles[0].function_space
        super().__init__(of, (space, space), label)
        self._roles, self._numbers, self._write = roles, numbers, write

    @cached_property
    def coefficients(self) -> Items:  # type: ignore[override]
        """Functions that it may depend on."""
        return *self._roles, *self.of.coefficients()

    @cached_property
    def constants(self) -> Items:  # type: ignore[override]
        """Constants that it may depend on."""
        return *self._numbers, *self.of.constants()

    def form(self) -> Form:
        """The derivative in UFL."""
        return self._write()

    def plus(self, other: Written, of: Form) -> Written:
        """The sum with another derivative.

        Args:
            other: The derivative.
            of: The sum of the forms.
        """
        roles, numbers = (*self._roles, *other._roles), (*self._numbers, *other._numbers)
        label = f"{self.label}+{other.label}"
        return Written(of, roles, numbers, label, lambda: self.form() + other.form())


@cache
def written_as(folder: Path) -> str:
    """Key of the programs in a folder, which changes when they do.

    What is written by hand may change while what it is a derivative of stays.

    Args:
        folder: The folder.
    """
    sources = (file.read_bytes() for file in sorted(folder.rglob("*.py")))
    return f"{zlib.crc32(b''.join(sources)):x}"


def _place(item: Any, among: Items) -> int:
    return next(k for k, other in enumerate(among) if other is item)


def read(file: Path) -> Record | None:
    """A record, if there is one.

    Args:
        file: Its file.
    """
    try:
        found: dict[str, Any] = json.loads(file.read_text())
        places = [tuple(map(int, found[key])) for key in ("coefficients", "constants")]
        return Record(str(found["kernel"]), *places)
    except (OSError, ValueError, TypeError, KeyError):
        # it is damaged, and is made anew
        return None


def write(file: Path, record: Record) -> None:
    """Keep a record; whoever reads meanwhile finds the whole of it or nothing.

    Args:
        file: Its file.
        record: The record.
    """
    part = file.with_name(f"{file.name}.{os.getpid()}")
    with writing(file.parent):
        part.write_text(json.dumps(asdict(record)))
        part.replace(file)
