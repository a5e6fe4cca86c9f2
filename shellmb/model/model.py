"""The model: all bodies of a scene, bound to meshes, joined, supported and loaded."""

from dataclasses import dataclass

from mpi4py import MPI

import numpy as np

from shellmb.build.mesh import build_surface
from shellmb.model.body import Body, NodeLink
from shellmb.model.joins import join_shells
from shellmb.model.nodal import PointLoads
from shellmb.model.places import local_nodes, shared_nodes
from shellmb.model.shell import ShellModel
from shellmb.model.supports import SupportedShell
from shellmb.scene import Scene
from shellmb.scene.loads import PointForce


@dataclass
class Model:
    """Everything that has unknowns.

    Args:
        scene: The scene it was made from.
        comm: Communicator.
        bodies: All bodies; the shells first.
        shells: The shells by name.
    """

    scene: Scene
    comm: MPI.Comm
    bodies: list[Body]
    shells: dict[str, ShellModel]

    @property
    def elements(self) -> int:
        """Number of shell elements."""
        return sum(
            s.surface_mesh.mesh.topology.index_map(2).size_global for s in self.shells.values()
        )

    @property
    def length(self) -> float:
        """Characteristic length of the scene, m."""
        return max(s.surface_mesh.length for s in self.shells.values())

    @property
    def supported(self) -> bool:
        """Whether anything is held or driven."""
        return bool(self.scene.supports)


def build_model(scene: Scene, comm: MPI.Comm) -> Model:
    """Mesh the shells and bind supports, loads and joins to them.

    Args:
        scene: A validated scene.
        comm: Communicator of all meshes.

    Raises:
        SceneError: If something the scene names does not exist on the meshes.
    """
    shells: dict[str, ShellModel] = {}
    for shell in scene.shells:
        mesh = build_surface(shell, comm)
        loads = [
            load
            for load in scene.loads
            if not isinstance(load, PointForce) and shell in scene.shells_of(load)
        ]
        shells[shell.name] = ShellModel(shell, mesh, loads, not scene.static)
    bodies: list[Body] = list(shells.values())
    for join in scene.joins:
        links, constraint = join_shells(join, shells[join.first], shells[join.second])
        shells[join.second].links += tuple(links)
        if constraint is not None:
            bodies.append(constraint)
    supported = {name: SupportedShell(body) for name, body in shells.items()}
    for support in scene.supports:
        for shell in scene.shells_of(support):
            supported[shell.name].add(support)
    for item in supported.values():
        bodies += item.constraints()
    forces = [load for load in scene.loads if isinstance(load, PointForce)]
    if forces:
        bodies.append(_point_loads(scene, shells, forces, comm))
    _resolve_links(bodies, comm)
    for probe in scene.probes:
        # found out now: before anything is compiled
        (shell,) = scene.shells_of(probe)
        local_nodes(shells[shell.name], probe.point, f"probe '{probe.name}'")
    return Model(scene, comm, bodies, shells)


def _point_loads(
    scene: Scene, shells: dict[str, ShellModel], forces: list[PointForce], comm: MPI.Comm
) -> PointLoads:
    targets = []
    for force in forces:
        (shell,) = scene.shells_of(force)
        nodes = shared_nodes(shells[shell.name], force.point, "point force")
        targets.append((shell.name, nodes.dofs["u"][0]))
    values = np.array([force.force for force in forces], dtype=float)
    return PointLoads(comm, targets, values, [force.time for force in forces])


def _resolve_links(bodies: list[Body], comm: MPI.Comm) -> None:
    """Let every link point to a dof that is not linked itself (three shells at one edge, say)."""
    alias: dict[tuple[str, int], tuple[str, int]] = {}
    for body in bodies:
        index_map = body.mixed.space.dofmap.index_map
        local = {
            (body.name, int(g)): (link.body, int(target))
            for link in body.links
            for g, target in zip(index_map.local_to_global(link.dofs), link.targets, strict=True)
        }
        for part in comm.allgather(local):
            alias.update(part)
    for body in bodies:
        resolved: dict[str, tuple[list[int], list[int]]] = {}
        for link in body.links:
            for dof, target in zip(link.dofs, link.targets, strict=True):
                end = (link.body, int(target))
                while end in alias:
                    end = alias[end]
                dofs, targets = resolved.setdefault(end[0], ([], []))
                dofs.append(int(dof))
                targets.append(end[1])
        # numbering links is collective: every rank has a link to the same bodies, if an empty one
        names = sorted(set().union(*comm.allgather(set(resolved))))
        body.links = tuple(_as_link(name, *resolved.get(name, ([], []))) for name in names)


def _as_link(name: str, dofs: list[int], targets: list[int]) -> NodeLink:
    return NodeLink(np.array(dofs, dtype=np.int32), name, np.array(targets, dtype=np.int64))
