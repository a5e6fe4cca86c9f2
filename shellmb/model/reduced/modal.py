"""Reduced bodies as the schemes see them: modes, points with mass, interfaces, and loads."""

from __future__ import annotations

from collections.abc import Sequence

from mpi4py import MPI

from shellmb.model.body import Body
from shellmb.model.frames.rigid import RigidBodies
from shellmb.model.reduced.data import ModalBody
from shellmb.model.reduced.loads import FrameLoads, LoadPoints
from shellmb.model.reduced.modes import Modes
from shellmb.model.reduced.onframe import InertiaPoints, Interfaces
from shellmb.model.reduced.places import ModalPoints, Reduced


def modal_bodies(
    comm: MPI.Comm,
    data: Sequence[ModalBody],
    rigid: RigidBodies,
    dynamic: bool,
    force: float,
    length: float,
) -> list[Body]:
    """The bodies of the system that reduced bodies consist of, besides their frames.

    Args:
        comm: Communicator.
        data: The reduced bodies.
        rigid: All frames, theirs included.
        dynamic: Whether they have inertia.
        force: Size of the multipliers' forces, N.
        length: Size of the scene, m.
    """
    ends = rigid.ends()
    found: list[Body] = []
    for body in data:
        modes, frame = Modes(comm, body), ends[body.name]
        found.append(modes)
        if dynamic:
            found.append(InertiaPoints(comm, body, modes, frame, force, length))
        if body.points_loaded:
            found.append(LoadPoints(comm, body, modes, frame, force, length))
        if body.turning_loads:
            found.append(FrameLoads(comm, body, modes, frame))
        if body.interfaces:
            others = [ends[item.name] for item in body.interfaces]
            found.append(Interfaces(comm, body, modes, frame, others, force, length))
    return found


def modal_points(bodies: Sequence[Body], rigid: RigidBodies | None) -> dict[str, ModalPoints]:
    """Points of reduced bodies by the names of potentials and contacts there; collective.

    Args:
        bodies: The bodies of the system.
        rigid: All frames.

    Raises:
        SceneError: If there is no such place.
    """
    found: dict[str, ModalPoints] = {}
    for modes in (body for body in bodies if isinstance(body, Modes)):
        assert rigid is not None
        reduced = Reduced(modes.data, modes, rigid.ends()[modes.data.name])
        for name, (member, on, who) in modes.data.touched.items():
            found[name] = reduced.points(member, on, who)
    return found
