"""Reduced bodies as the schemes see them: modes, points with mass, interfaces, and loads."""

from __future__ import annotations

from collections.abc import Sequence

from mpi4py import MPI

from shellmb.model.body import Body
from shellmb.model.frames.rigid import RigidBodies
from shellmb.model.reduced.data import ModalBody
from shellmb.model.reduced.floating_body import InertiaPoints, Interfaces, Reduced
from shellmb.model.reduced.loads import FrameLoads, LoadPoints
from shellmb.model.reduced.locations import ModalPoints, reduced_points
from shellmb.model.reduced.modes import Modes
from shellmb.model.reduced.terms import ModalTerms, has_terms


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
    for kept in data:
        body = Reduced(Modes(comm, kept), ends[kept.name])
        found.append(body.modes)
        if dynamic:
            found.append(InertiaPoints(body, force, length))
        if kept.points_loaded:
            found.append(LoadPoints(body, force, length))
        if kept.follower_loads:
            found.append(FrameLoads(body))
        found += [ModalTerms(body, m) for m in kept.members.values() if has_terms(m)]
        if kept.interfaces:
            others = [ends[item.name] for item in kept.interfaces]
            found.append(Interfaces(body, others, force, length))
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
        body = Reduced(modes, rigid.ends()[modes.data.name])
        for name, (member, on, who) in modes.data.touched.items():
            found[name] = reduced_points(body, member, on, who)
    return found
