"""Supports of bodies in modes.

An edge that is clamped stays a rigid frame, as the hinged end of a beam does: with the frame of its
own it has a joint to the ground. What other supports hold does not move as a frame, and where edges
meet they have nodes in common. The modes are then those of the body in its supports, and one frame
stands for all of these: none of the displacements that they leave moves it. So it is fixed by a
weld or, where hinged edges are in one straight line, by a revolute joint about that.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from shellmb.errors import SceneError
from shellmb.preprocessing.constraint_analysis.mobility import SMALL, Frame, describe
from shellmb.preprocessing.modal.isolated import IsolatedBody
from shellmb.scene import GROUND, Clamped, Joint, Revolute, Support, Weld
from shellmb.scene.multibody.rigid import Interface


def stays_rigid(support: Any, target: Any) -> bool:
    """Decide whether each edge of a support moves as a rigid frame."""
    if support.hinges:
        return target.directors == 3 and not np.any(support.offset)
    return isinstance(support, Clamped)


def support_joint(
    held: IsolatedBody, name: str, who: str, supports: Sequence[Support]
) -> tuple[Interface, Joint]:
    """The frame of all supports of a body, and its joint to the ground; collective.

    Args:
        held: The body in its supports.
        name: Name of the body.
        who: What messages call it.
        supports: The supports.

    Raises:
        SceneError: If supports leave it motions that no joint has.
    """
    places = np.vstack([body.node_positions() for body in held.model.meshed.values()])
    X = np.concatenate(held.comm.allgather(places))
    middle = (X.min(axis=0) + X.max(axis=0)) / 2
    free = held.free_motions(middle)

    def frame(at: Any) -> Interface:
        x, y, z = map(float, at)
        return Interface(f"{name} (supports)", 0.0, (0.0, 0.0, 0.0), (x, y, z), of=name)

    joint = f"{name}.supports"
    if not free.shape[1]:
        # moments of what supports carry are about the origin
        return frame(middle), Weld(joint, GROUND, frame(middle).name, at=(0.0, 0.0, 0.0))
    size = float(np.linalg.norm(np.ptp(X, axis=0)))
    shift, turn = free[:3, 0], free[3:, 0]
    about = free.shape[1] == 1 and np.linalg.norm(turn) * size > SMALL * np.linalg.norm(shift)
    if about and all(s.hinges for s in supports):
        at = middle + np.cross(turn, shift) / (turn @ turn)
        x, y, z = map(float, turn / np.linalg.norm(turn))
        place = frame(at)
        return place, Revolute(joint, GROUND, place.name, at=place.position, axis=(x, y, z))
    motions = np.vstack([free[:3] / size, free[3:]])
    raise SceneError(
        f"{who} is reduced to modes, and its supports leave it free to "
        f"{describe(Frame(middle, size), motions)}; they must hold it, or be Hinged edges in one "
        "straight line, or the model must be 'exact'"
    )
