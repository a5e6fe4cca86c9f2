"""Constraints at single nodes of shells and beams: kinks, planes that are not axis-parallel."""

from collections.abc import Callable

from mpi4py import MPI

import numpy as np
import ufl
from ufl.core.expr import Expr

from shellmb.arrays import Floats, Ints
from shellmb.forms.constraints import nodal as nodal_forms
from shellmb.forms.state import Layout
from shellmb.meshes.nodes import constant_vector, node_mesh, node_space
from shellmb.model.identification import node_links
from shellmb.model.joints.constraints import ConstraintGroup
from shellmb.model.locations.nodes import said_point


class NodalConstraint(ConstraintGroup):
    """One scalar constraint at each of a list of nodes, with its multiplier.

    Args:
        name: Name of the constraint.
        comm: Communicator.
        parts: Name of each nodal vector to (body, global dofs of shape (n, 3), reference values
        (n, 3)).
        constraint: Function of the nodal vectors and of the data, a scalar.
        data: Values that the constraint needs at each node, shape (n, m).
        scale: Size of the multiplier's force, N.
        x: Positions of the nodes, for messages, shape (n, 3), m.
        size: What violations are relative to: a length, m, or 1 where directors are held.
    """

    def __init__(
        self,
        name: str,
        comm: MPI.Comm,
        parts: dict[str, tuple[str, Ints, Floats]],
        constraint: Callable[[dict[str, Expr], Expr], Expr],
        data: Floats,
        scale: float,
        x: Floats,
        size: float = 1.0,
    ) -> None:
        nodes = node_mesh(comm, len(data))
        mixed = node_space(nodes, {**dict.fromkeys(parts, 3), "mu": 1})
        links = tuple(
            link
            for part, (body, dofs, _) in parts.items()
            for link in node_links(nodes, mixed.dofs[part].reshape(-1, 3), [body] * len(dofs), dofs)
        )
        layout = Layout(mixed.parts)
        reference = {
            part: constant_vector(nodes, values, part) for part, (_, _, values) in parts.items()
        }
        constants = constant_vector(nodes, data, "data")

        def violation(q: Expr) -> Expr:
            values = {p: r + layout.part(q, p) for p, r in reference.items()}
            return ufl.as_vector([constraint(values, constants)])

        super().__init__(name, nodes, mixed, links, violation, scale, size)
        extent = float(np.max(np.abs(x))) or 1.0
        self.labels = [f"{name} at {said_point(node, extent)}" for node in x]


def kink(
    name: str,
    comm: MPI.Comm,
    first: tuple[str, Ints, Floats],
    second: tuple[str, Ints, Floats],
    scale: float,
    x: Floats,
) -> NodalConstraint:
    """The angle between the directors of two shells is locked at each node of their common edge."""
    angle = np.sum(first[2] * second[2], axis=1, keepdims=True)
    return NodalConstraint(
        name,
        comm,
        {"d1": first, "d2": second},
        lambda q, data: nodal_forms.locked_kink(q["d1"], q["d2"], data),
        angle,
        scale,
        x,
    )


def plane(
    name: str,
    comm: MPI.Comm,
    vector: tuple[str, Ints, Floats],
    normals: Floats,
    scale: float,
    x: Floats,
    size: float,
) -> NodalConstraint:
    """A nodal vector (a change from the reference) stays in the plane with the given normal.

    Args:
        name: Name of the constraint.
        comm: Communicator.
        vector: Name of the body, global dofs of shape (n, 3), reference values (n, 3).
        normals: Unit normals, shape (n, 3).
        scale: Size of the multiplier's force, N, or moment, N m.
        x: Positions of the nodes, for messages, shape (n, 3), m.
        size: What violations are relative to: the body's length, m, or 1 of a director.
    """
    body, dofs, _ = vector
    return NodalConstraint(
        name,
        comm,
        {"q": (body, dofs, np.zeros((len(normals), 3)))},
        lambda q, data: nodal_forms.in_plane(q["q"], data),
        normals,
        scale,
        x,
        size,
    )


def arm_plane(
    name: str,
    comm: MPI.Comm,
    body: str,
    dofs: dict[str, Ints],
    arms: Floats,
    normals: Floats,
    scale: float,
    x: Floats,
    length: float,
) -> NodalConstraint:
    """The ends of arms at nodes stay in the planes with the given normals.

    Args:
        name: Name of the constraint.
        comm: Communicator.
        body: Name of the body.
        dofs: Global dofs of the nodes' displacements "u", (n, 3), and directors "w", (n, 3 m).
        arms: Components of the arms along the directors, shape (n, m), m.
        normals: Unit normals, shape (n, 3).
        scale: Size of the multiplier's force, N.
        x: Positions of the nodes, for messages, shape (n, 3), m.
        length: Size of the body, m.
    """
    zeros, count = np.zeros((len(x), 3)), arms.shape[1]
    turns = {f"w{k}": (body, dofs["w"][:, 3 * k : 3 * k + 3], zeros) for k in range(count)}

    def constraint(q: dict[str, Expr], data: Expr) -> Expr:
        end = sum((data[3 + k] * q[f"w{k}"] for k in range(count)), start=q["u"])
        return nodal_forms.in_plane(end, ufl.as_vector([data[i] for i in range(3)]))

    parts = {"u": (body, dofs["u"], zeros), **turns}
    data = np.hstack([normals, arms])
    return NodalConstraint(name, comm, parts, constraint, data, scale, x, length)
