"""Shapes of rigid bodies and of obstacles as surfaces, for files and pictures."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.errors import SceneError
from shellmb.meshes.files.meshio_files import read_meshio
from shellmb.model.locations.ends import frame_about
from shellmb.scene import Ball, Box, Contact, Plane, RigidBody, Rod
from shellmb.scene.lookup import by_kind, said

# pieces around a circle, and along half of it
AROUND = 32
# a side of no length is drawn so thin, parts of the longest one
THIN = 1e-3
# planes and rods reach so far, parts of the scene
REACH = 1.2
# two triangles of four corners
HALVES = ((0, 1, 2), (0, 2, 3))


class Solid(NamedTuple):
    """A surface of triangles in the reference.

    Args:
        label: Name of the body, or of the contact whose obstacle it is.
        points: Corners, shape (n, 3), m.
        triangles: Numbers of corners, shape (f, 3).
        body: Name of the rigid body that it moves with; None: it is fixed in space.
    """

    label: str
    points: Floats
    triangles: Ints
    body: str | None = None


def body_solid(body: RigidBody) -> Solid:
    """The shape of a rigid body.

    Args:
        body: The body, whose `shape` is not None.

    Raises:
        SceneError: If its file is no surface.
    """
    shape = body.shape
    if isinstance(shape, Path):
        found = read_meshio(shape, said(body))
        corners = [nodes for kind, nodes in found.cells if kind == "tri3"]
        if not corners:
            raise SceneError(f"{said(body)}: {shape} has no triangles; its shape must be a surface")
        # each triangle has corners of its own: edges stay sharp
        local, triangles = _apart(found.x[np.array(corners)])
        return Solid(
            body.name, np.asarray(body.position) + local @ body.axes.T, triangles, body.name
        )
    if isinstance(shape, tuple):
        turned, (local, triangles) = np.eye(3), _box(np.array(shape, dtype=float))
    else:
        # int rho y y^T: of a box m a^2 / 12 along each side, of a rod m r^2 / 4 across
        moments, turned = np.linalg.eigh(body.euler_tensor)
        squares = np.maximum(moments, 0.0) / body.mass
        others = (squares.sum() - squares) / 2
        along = int(np.argmax(np.abs(squares - others)))
        if shape == "box":
            local, triangles = _box(np.sqrt(12 * squares))
        else:
            local, triangles = _rod(2 * np.sqrt(others[along]), np.sqrt(12 * squares[along]))
            turned = turned[:, [(along + 1) % 3, (along + 2) % 3, along]]
        turned = turned * np.sign(np.linalg.det(turned))
    return Solid(body.name, body.center + local @ turned.T @ body.axes.T, triangles, body.name)


def obstacle_solid(contact: Contact, centre: Floats, size: float) -> Solid | None:
    """The obstacle of a contact near the scene; None where it has no shape here.

    Args:
        contact: The contact.
        centre: The middle of the scene, shape (3,), m.
        size: Size of the scene, m.
    """
    shape = by_kind(_OBSTACLES, contact.obstacle)
    if shape is None:
        return None
    corners, triangles = shape(contact.obstacle, centre, REACH * size / 2)
    return Solid(contact.name, corners, triangles, contact.obstacle_body)


def _ball(ball: Ball, *_: Any) -> tuple[Floats, Ints]:
    local, triangles = _revolved(*_arc(ball.radius))
    return np.asarray(ball.center) + local, triangles


def _block(box: Box, *_: Any) -> tuple[Floats, Ints]:
    local, triangles = _box(np.array(box.size))
    return np.asarray(box.center) + local @ box.axes, triangles


def _plane(plane: Plane, centre: Floats, half: float) -> tuple[Floats, Ints]:
    frame = frame_about(plane.normal)
    # the foot of the scene's middle
    foot = centre - np.outer(frame[2], frame[2]) @ (centre - np.asarray(plane.point))
    local = half * np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
    return foot + local @ frame, np.array(HALVES)


def _shaft(rod: Rod, centre: Floats, half: float) -> tuple[Floats, Ints]:
    frame, point = frame_about(rod.axis), np.asarray(rod.point)
    foot = point + np.outer(frame[2], frame[2]) @ (centre - point)
    local, triangles = _revolved(np.array([rod.radius, rod.radius]), np.array([-half, half]))
    return foot + local @ frame, triangles


_OBSTACLES: dict[type, Any] = {Ball: _ball, Box: _block, Plane: _plane, Rod: _shaft}


def joined(solids: Sequence[Solid]) -> tuple[Floats, Ints]:
    """Corners and triangles of several solids as of one.

    Args:
        solids: They.
    """
    first = np.cumsum([0, *(len(s.points) for s in solids[:-1])])
    triangles = [s.triangles + k for s, k in zip(solids, first, strict=True)]
    return np.concatenate([s.points for s in solids]), np.concatenate(triangles)


def _apart(corners: Floats) -> tuple[Floats, Ints]:
    """Pieces (f, k, 3) with corners of their own, in triangles."""
    numbers: Ints = np.arange(corners.shape[0] * corners.shape[1]).reshape(corners.shape[:2])
    if corners.shape[1] == 4:
        numbers = numbers[:, np.array(HALVES)].reshape(-1, 3)
    return corners.reshape(-1, 3), numbers


def _box(sides: Floats) -> tuple[Floats, Ints]:
    """A box about the origin."""
    sides = np.maximum(sides, THIN * sides.max())
    square = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    # x, z around y goes the other way; all turn about the outward normal
    faces = [np.insert(square[:: s * (-1) ** k], k, s, axis=1) for k in range(3) for s in (-1, 1)]
    return _apart(np.array(faces) * sides / 2)


def _rod(radius: float, length: float) -> tuple[Floats, Ints]:
    """A cylinder about the origin along the third axis, with its ends."""
    longest = max(2 * radius, length)
    r, h = max(radius, THIN * longest), max(length, THIN * longest) / 2
    rings = (([0.0, r], [-h, -h]), ([r, r], [-h, h]), ([r, 0.0], [h, h]))
    parts = [Solid("", *_revolved(np.array(a), np.array(z))) for a, z in rings]
    return joined(parts)


def _arc(radius: float) -> tuple[Floats, Floats]:
    angles = np.linspace(-np.pi / 2, np.pi / 2, AROUND // 2 + 1)
    return radius * np.cos(angles), radius * np.sin(angles)


def _revolved(radii: Floats, heights: Floats) -> tuple[Floats, Ints]:
    """A surface of revolution about the third axis by its profile, shape (k,) each."""
    angles = 2 * np.pi * np.arange(AROUND) / AROUND
    circle = np.stack([np.cos(angles), np.sin(angles), np.zeros(AROUND)], axis=1)
    points = radii[:, None, None] * circle + heights[:, None, None] * np.array([0.0, 0.0, 1.0])
    i, j = np.meshgrid(np.arange(len(radii) - 1), np.arange(AROUND), indexing="ij")
    after = (j + 1) % AROUND
    ring, above = i * AROUND, (i + 1) * AROUND
    corners = np.stack([ring + j, ring + after, above + after, above + j], axis=-1).reshape(-1, 4)
    return points.reshape(-1, 3), corners[:, np.array(HALVES)].reshape(-1, 3)
