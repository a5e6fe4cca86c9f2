"""One end of each of some joints, read from the state of their group."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from shellmb.arrays import Floats
from shellmb.model.joints.coordinates import CoordinateGroup
from shellmb.model.joints.joints import BoundJoint, JointGroup


class Places:
    """One end of each of some joints of a group, in states of the group or changes of these.

    Args:
        group: The group.
        which: 0 for the first, 1 for the second end.
        cells: Local cells of the joints.
        joints: The joints.

    Attributes:
        turn: Whether directors matter at this end; if not, it has none here.
    """

    def __init__(
        self,
        group: JointGroup | CoordinateGroup,
        which: int,
        cells: Sequence[int],
        joints: Sequence[BoundJoint],
    ) -> None:
        place, ends = group.ends[which], [joint.ends[which] for joint in joints]
        self.turn = place.turns
        self._u = _dofs(group, f"u{place.tag}", cells)
        self._nodes = np.array([end.node for end in ends])
        if not self.turn:
            return
        self._w = _dofs(group, f"w{place.tag}", cells).reshape(len(ends), -1, 3)
        self._directors = np.array([end.directors for end in ends])
        self._offsets = np.array([end.offset for end in ends])

    def nodes(self, q: Floats, whole: float = 1.0) -> Floats:
        """Positions of the nodes, shape (..., n, 3), m.

        Args:
            q: A state, or several, shape (..., dofs).
            whole: Zero where these are changes of states.
        """
        return whole * self._nodes + np.take(q, self._u, axis=-1)

    def directors(self, q: Floats, whole: float = 1.0) -> Floats:
        """Directors of the nodes, shape (..., n, m, 3)."""
        return whole * self._directors + np.take(q, self._w, axis=-1)

    def points(self, q: Floats, whole: float = 1.0) -> Floats:
        """Positions of the ends themselves, shape (..., n, 3), m."""
        x = self.nodes(q, whole)
        if not self.turn:
            return x
        return x + (self._offsets[:, None] @ self.directors(q, whole))[..., 0, :]

    def moments(self, q: Floats, work: Floats, about: Floats, whole: float = 1.0) -> Floats:
        """Forces and their moments, shape (..., n, 2, 3).

        Args:
            q: States of the group, shape (..., dofs).
            work: Virtual work for each of its dofs.
            about: Points that moments are about, shape (..., n, 3), m.
            whole: Zero where these are changes of states and points.
        """
        found = np.empty((*about.shape[:-1], 2, 3))
        force = found[..., 0, :] = np.take(work, self._u, axis=-1)
        # arms and what they turn with, one below the other
        arms, forces = (self.nodes(q, whole) - about)[..., None, :], force[..., None, :]
        if self.turn:
            arms = np.concatenate([arms, self.directors(q, whole)], axis=-2)
            forces = np.concatenate([forces, np.take(work, self._w, axis=-1)], axis=-2)
        # sums of products by pairs of axes
        products = arms.swapaxes(-1, -2) @ forces
        for k, (a, b) in enumerate(((1, 2), (2, 0), (0, 1))):
            found[..., 1, k] = products[..., a, b] - products[..., b, a]
        return found


def _dofs(
    group: JointGroup | CoordinateGroup, part: str, cells: Sequence[int]
) -> npt.NDArray[np.intp]:
    dofs = group.mixed.dofs[part].reshape(-1, group.mixed.parts[part][1])
    return np.asarray(dofs[list(cells)], dtype=np.intp)
