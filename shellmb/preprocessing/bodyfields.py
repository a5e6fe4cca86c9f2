"""A body's unknowns as a field of a block system: what all systems of a model have in common."""

from collections.abc import Container, Iterable, Mapping, Sequence

import numpy as np
from dolfinx import fem
from ufl import Form

from shellmb.arrays import Floats, Int32s
from shellmb.model.body import Body, Term
from shellmb.system.assembly.fields import Directors, Field, Link, Part, ResidualTerm

# thickness over length below which resultants are not eliminated: round-off leaves
# `1e-16 / THIN^2 = 1e-7` of forces of bending, which Newton's method still makes up for
THIN = 3e-5

NONE: Int32s = np.zeros(0, dtype=np.int32)


def body_field(
    body: Body,
    function: fem.Function,
    residual: Iterable[Form | None],
    numbers: Mapping[str, int],
    parts: tuple[Part, ...] = (),
    name: str | None = None,
    without: Sequence[Int32s] = (),
) -> Field:
    """Field of a body with its links; its fixed dofs come first among the fixed ones.

    Args:
        body: The body.
        function: The unknown function.
        residual: Forms that add up to the residual; None: no form.
        numbers: Number of the field of each body in the system.
        parts: Named parts, judged by themselves.
        name: Name for messages; None: the body's.
        without: Dofs that have no equations, and are fixed at zero.
    """
    fixed = np.concatenate([*(f.dofs for f in body.fixed), *without, NONE]).astype(np.int32)
    return Field(
        name=name or body.name,
        function=function,
        residual=tuple(form for form in residual if form is not None),
        parts=parts,
        fixed=fixed,
        values=np.zeros(len(fixed)),
        links=tuple(Link(k.dofs, numbers[k.body], k.targets) for k in body.links),
        elementwise=elementwise_dofs(body),
    )


def residual_terms(terms: Iterable[Term], numbers: Sequence[int]) -> tuple[ResidualTerm, ...]:
    """Terms of a body as those of the fields of its unknown states.

    Args:
        terms: The terms.
        numbers: Numbers of the fields in the system.
    """
    return tuple(
        ResidualTerm(term.residual, tuple(numbers[k] for k in term.rows), term.alone)
        for term in terms
    )


def dofs_of(body: Body, parts: Iterable[str]) -> Int32s:
    """Local dofs of some parts of a body, one after the other.

    Args:
        body: The body.
        parts: Names of the parts; those that it does not have count for nothing.
    """
    found = [body.mixed.dofs[p].ravel() for p in parts if p in body.mixed.dofs]
    return np.concatenate([NONE, *found]).astype(np.int32)


def parts_of(
    body: Body, said: str, tested: Container[str] | None = None, advice: str | None = None
) -> tuple[Part, ...]:
    """Parts of a body in a system of its own.

    Args:
        body: The body.
        said: What messages call a part, with its title in place of "{}".
        tested: Names of those that have to converge; None: all.
        advice: What to try when one does not; None: as in a step.
    """
    return tuple(
        Part(
            said.format(p.title),
            body.mixed.dofs[p.name],
            p.scale if tested is None or p.name in tested else np.inf,
            advice or p.advice,
        )
        for p in body.parts
    )


def relative_size(body: Body, change: Floats) -> float:
    """Largest change of a kinematic part on this rank, relative to the scale of the part.

    Args:
        body: The body.
        change: Change of its state, a local array.
    """
    change, largest = np.abs(change), 0.0
    for part in body.parts:
        if part.name in body.kinematic:
            here = change[body.mixed.dofs[part.name]].max(initial=0.0)
            largest = max(largest, float(here) / part.scale)
    return largest


def elementwise_dofs(body: Body) -> Int32s:
    """Local dofs that are coupled to others of their cell only, and can be eliminated there.

    In very thin bodies resultants stay unknowns: without them round-off of strains, times the
    membrane stiffness, would be as large as forces of bending.
    """
    parts = body.mixed.elementwise
    if body.slenderness < THIN:
        parts = parts - {"N", "S"}
    return dofs_of(body, sorted(parts))


def body_directors(body: Body) -> Directors | None:
    """The directors that a body's nodes carry, as they are at a state by itself."""
    reference = body.manifold.directors
    if reference is None:
        return None
    size = reference.shape[1]
    lam = body.mixed.dofs["lam"].reshape(-1, body.mixed.parts["lam"][1])
    return Directors(body.mixed.dofs["w"].reshape(-1, size), lam, reference)


def kinematic_dofs(body: Body) -> Int32s:
    """Local dofs that have velocities."""
    return dofs_of(body, sorted(body.kinematic))


def without_jump(body: Body) -> list[Int32s]:
    """Dofs of a body that have no equations for velocities, neither its own nor another body's."""
    linked = np.concatenate([*(link.dofs for link in body.links), NONE])
    idle = sorted(body.mixed.parts.keys() - body.jump_parts)
    return [d for d in (body.mixed.dofs[p] for p in idle) if not np.isin(d, linked).any()]


def without_impulse(body: Body) -> list[Int32s]:
    """Dofs without an impulse: resultants and a floating frame, which has no mass."""
    floating = [body.mixed.dofs[p] for p in ("frame", "hold") if p in body.mixed.dofs]
    return without_jump(body) + floating


def resultant_dofs(body: Body) -> Int32s:
    """Local dofs of resultants that belong to the strains of a state, of linear sections."""
    return dofs_of(body, sorted(body.mixed.stresses))
