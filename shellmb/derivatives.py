"""Derivatives of forms, taken only when their kernels are not known yet.

To differentiate a residual in UFL takes longer than to find the kernel of its derivative, and two
residuals of one signature have the same derivative. So beside a kernel stands, in a small file,
which kernel its derivative has and what of the residual goes into it.
"""

import json
import os
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import ufl
from dolfinx import fem
from ufl import Form


@dataclass(frozen=True)
class Record:
    """The kernel of a derivative, in terms of the form that was differentiated.

    Attributes:
        kernel: Name of its module; empty if the derivative vanishes.
        coefficients: Which coefficients of the form are its coefficients.
        constants: Which constants of the form are its constants.
    """

    kernel: str
    coefficients: tuple[int, ...] = ()
    constants: tuple[int, ...] = ()


class Derivative:
    """The derivative of a form by a function that is one of its coefficients.

    Args:
        form: A form.
        function: The function.
    """

    def __init__(self, form: Form, function: fem.Function) -> None:
        self.of, self.function = form, function
        self.position = form.coefficients().index(function)

    def form(self) -> Form:
        """The derivative in UFL; it may be empty."""
        trial = ufl.TrialFunction(self.function.function_space)
        derivative = ufl.derivative(self.of, self.function, trial)
        return ufl.algorithms.expand_derivatives(derivative)

    def record(self, form: Form, kernel: str) -> Record:
        """What to remember.

        Args:
            form: The derivative in UFL.
            kernel: Name of its module.
        """
        if form.empty():
            return Record("")
        coefficients, constants = self.of.coefficients(), self.of.constants()
        return Record(
            kernel,
            tuple(coefficients.index(c) for c in form.coefficients()),
            tuple(constants.index(c) for c in form.constants()),
        )

    def file(self, folder: Path, name: str) -> Path:
        """Where the record is kept.

        Args:
            folder: Of the kernels.
            name: Name of the module of the form that is differentiated.
        """
        return folder / f"{name}.by{self.position}"


def read(file: Path) -> Record | None:
    """A record, if there is one.

    Args:
        file: Its file.
    """
    try:
        found: dict[str, Any] = json.loads(file.read_text())
    except (FileNotFoundError, ValueError):
        return None
    places = {key: tuple(found[key]) for key in ("coefficients", "constants")}
    return Record(found["kernel"], **places)


def write(file: Path, record: Record) -> None:
    """Keep a record; whoever reads meanwhile finds the whole of it or nothing.

    Args:
        file: Its file.
        record: The record.
    """
    part = file.with_name(f"{file.name}.{os.getpid()}")
    part.write_text(json.dumps(asdict(record)))
    part.replace(file)
