"""Input of the block system: fields and what follows from them, links of nodes, fixed dofs.

The system layer knows no shells: a field is a function space with an unknown function in it.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from dolfinx import fem
from ufl import Form

from shellmb.arrays import Floats, Int32s, Ints
from shellmb.native import library as native
from shellmb.native.assembler import is_native
from shellmb.native.library import CArrays


@dataclass(frozen=True)
class Part:
    """A named part of a field whose convergence is judged on its own.

    Args:
        name: Name for messages, for example "displacement of 'wing'".
        dofs: Local dofs (owned and ghost).
        scale: Size below which the values of this part count as small (its unit).
        advice: What to try when this part does not converge.
        bound: Size of an update beyond which the iteration has diverged.
        idle: Whether these are forces of constraints, which do no work.
        beside: Size of what the equations add to the values, with the round-off of which they do.
    """

    name: str
    dofs: Int32s
    scale: float
    advice: str
    bound: float = math.inf
    idle: bool = False
    beside: float = 0.0


@dataclass(frozen=True)
class Link:
    """Dofs of this field that are the same unknowns as dofs of another field.

    The paper calls this Boolean identification of nodes (section 5).

    Args:
        dofs: Local dofs of the field that holds the link (owned and ghost).
        field: Index of the other field in the system.
        targets: Global dofs in the other field's own index map, one per entry of `dofs`.
    """

    dofs: Int32s
    field: int
    targets: Ints


@dataclass(frozen=True)
class Directors:
    """Unit vectors or orthonormal triples at nodes, with their multipliers.

    A director is `reference + value` of the field's function.

    Args:
        dofs: Their local dofs (owned and ghost nodes), shape (n, 3) or (n, 9).
        multipliers: Local dofs of their multipliers, shape (n, 1) or (n, 6).
        reference: Reference values, shape of `dofs`.
        before: State at the start of the sub-interval at whose middle forces act; None: forces act
            at the state itself.
        linear: Whether directors change little: they stay where `before` is.
    """

    dofs: Int32s
    multipliers: Int32s
    reference: Floats
    before: fem.Function | None = None
    linear: bool = False


@dataclass(frozen=True)
class DirectorRates(Directors):
    """Rates of directors at the middle between `before` and another field's state.

    Args:
        state: Number of the field that has the state.
    """

    state: int = -1


@dataclass(frozen=True)
class DirectorPath(Directors):
    """Directors at the end of a step that is quadratic in time, or their velocities times the step.

    Both fields have it, that of the velocities with `state`. Forces act along the path, whose
    states are combinations of `before`, `start_velocity` and the two unknown ones (eq. Q4).

    Args:
        start_velocity: Velocity at the start times the step.
        alpha: Dissipation.
        state: Number of the field that has the directors; -1 in that field itself.
        rate: Number of the field that has the velocities; -1 in that field itself.
        massless: Whether they have no inertia, and are held at the middle of the step (eq. Q6).
    """

    start_velocity: fem.Function = field(kw_only=True)
    alpha: float = 0.0
    state: int = -1
    rate: int = -1
    massless: bool = False


class DependentFunctions(NamedTuple):
    """Functions that are combinations of others, among them unknown ones.

    Args:
        functions: They.
        sources: What they are combinations of.
        weights: The combinations, shape (number of functions, number of sources).
    """

    functions: Sequence[fem.Function]
    sources: Sequence[fem.Function]
    weights: Floats


class ResidualTerm(NamedTuple):
    """A form of the residuals of one or several fields on a mesh.

    Args:
        residual: The form, tested with a function for each of its rows, one after the other.
        rows: Numbers of the fields whose rows they are.
        alone: Forms of each row by itself, of which derivatives are taken.
    """

    residual: Form
    rows: tuple[int, ...]
    alone: tuple[Form, ...]


@dataclass
class Field:
    """One field of unknowns.

    Args:
        name: Name for messages.
        function: The unknown function, updated during the solution.
        residual: Forms that add up to the residual, tested with the function's space.
        parts: Named parts.
        fixed: Local dofs with given values (owned and ghost).
        values: Their values, in the order of `fixed`; may be changed between solutions.
        links: Int32s that belong to other fields.
        elementwise: Local dofs that are coupled to others of their cell only.
        directors: Nodes whose values are constrained node by node.
        terms: More forms of the residual, at functions that follow the unknown ones, and perhaps of
            those of other fields, too.
        kept: Local dofs that no cell eliminates, because what determines them is of other cells.
    """

    name: str
    function: fem.Function
    residual: tuple[Form, ...]
    parts: tuple[Part, ...]
    fixed: Int32s = field(default_factory=lambda: np.zeros(0, dtype=np.int32))
    values: Floats = field(default_factory=lambda: np.zeros(0))
    links: tuple[Link, ...] = ()
    elementwise: Int32s = field(default_factory=lambda: np.zeros(0, dtype=np.int32))
    directors: Directors | None = None
    terms: tuple[ResidualTerm, ...] = ()
    kept: Int32s = field(default_factory=lambda: np.zeros(0, dtype=np.int32))

    @property
    def forms(self) -> list[Form]:
        """All forms of the residual."""
        return [*self.residual, *(term.residual for term in self.terms)]

    @property
    def size_local(self) -> int:
        """Number of dofs of the space that this rank owns."""
        return int(self.function.function_space.dofmap.index_map.size_local)

    @property
    def size_all(self) -> int:
        """Number of dofs of the space on this rank, with ghosts."""
        return self.size_local + int(self.function.function_space.dofmap.index_map.num_ghosts)


@contextmanager
def general_position(forms: Sequence[Form]) -> Iterator[None]:
    """For a moment, all that forms depend on has such values.

    Args:
        forms: The forms.
    """
    # in the order of the forms and not of a set, so that each run finds the same entries
    functions = dict.fromkeys(c for form in forms for c in form.coefficients())
    arrays = [c.x.array for c in functions if isinstance(c, fem.Function)]
    constants = dict.fromkeys(c for form in forms for c in form.constants())
    arrays += [c.value for c in constants if isinstance(c, fem.Constant)]
    kept = [array.copy() for array in arrays]
    general = np.random.default_rng(0)
    for array in arrays:
        # near what is not zero: directors stay on their side of a curved surface
        size = np.max(np.abs(array), initial=0.0)
        array[...] += general.uniform(0.5, 1.5, array.shape) * (0.1 * size or 1.0)
    try:
        yield
    finally:
        for array, values in zip(arrays, kept, strict=True):
            array[...] = values


def following(followers: Sequence[DependentFunctions]) -> Callable[[], None]:
    """Make what gives functions that follow others their values.

    Args:
        followers: The functions.
    """
    return Following(followers) if is_native() else partial(_follow, followers)


def _follow(followers: Sequence[DependentFunctions]) -> None:
    for some in followers:
        sources = [source.x.array for source in some.sources]
        for function, row in zip(some.functions, some.weights, strict=True):
            # what is always zero stays so
            if np.any(row):
                function.x.array[:] = sum(w * s for w, s in zip(row, sources, strict=True) if w)


class Following:
    """Gives functions that are combinations of others their values.

    Args:
        followers: The functions, whose arrays live as long as this object.

    Attributes:
        members: For C, in the order of the arguments.
    """

    def __init__(self, followers: Sequence[DependentFunctions]) -> None:
        self._lib, self._pointer = native.cells().lib, CArrays()
        sizes, terms, sources, weights, targets = [], [], [], [], []
        for some in followers:
            for function, row in zip(some.functions, some.weights, strict=True):
                # what is always zero stays so
                of = [k for k, weight in enumerate(row) if weight]
                if of:
                    sizes.append(len(function.x.array))
                    terms.append(len(of))
                    targets.append(self._pointer(function.x.array))
                    sources += [self._pointer(some.sources[k].x.array) for k in of]
                    weights += [row[k] for k in of]
        self.members: dict[str, Any] = {
            "followers": len(sizes),
            "sizes": self._pointer(np.array(sizes or [0], dtype=np.int32)),
            "terms": self._pointer(np.array(terms or [0], dtype=np.int32)),
            "from": self._pointer.many("double *", sources),
            "weights": self._pointer(np.array(weights or [0.0])),
            "to": self._pointer.many("double *", targets),
        }

    def __call__(self) -> None:
        """Take the values of their sources."""
        self._lib.follow(*self.members.values())
