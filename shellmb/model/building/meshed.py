"""First stage: shells and beams on their meshes, joined, with their distributed loads."""

from typing import NamedTuple

from mpi4py import MPI

from shellmb.meshes.mesh import build_surface
from shellmb.meshes.surfaces.shell_lines import ShellLine
from shellmb.model.frames.beam import BeamModel
from shellmb.model.frames.glue import line_along
from shellmb.model.frames.linear import build_beam
from shellmb.model.sanity_checks import doubt_slits, doubt_thickness
from shellmb.model.sections.natural import Distributed
from shellmb.model.sections.natural_size import doubt_natural
from shellmb.model.sections.unit_slips import doubt_units
from shellmb.model.shells.joins import join_shells
from shellmb.model.shells.linear import build_shell
from shellmb.model.shells.shell import ShellModel
from shellmb.model.supports.nodal import NodalConstraint
from shellmb.scene import Beam, Scene, Shell
from shellmb.scene.loads.loads import PointLoad


class Meshed(NamedTuple):
    """Bodies with meshes of their own.

    Args:
        shells: The shells by name.
        beams: The beams by name.
        kinks: Constraints of shells that are joined at an angle.
        lines: Lines of beams along edges of shells, by the name of the beam.
    """

    shells: dict[str, ShellModel]
    beams: dict[str, BeamModel]
    kinks: list[NodalConstraint]
    lines: dict[str, ShellLine]

    @property
    def all(self) -> dict[str, ShellModel | BeamModel]:
        """Shells and beams by name."""
        return {**self.shells, **self.beams}


def build_meshed(scene: Scene, comm: MPI.Comm) -> Meshed:
    """Mesh shells and beams, and join them.

    Args:
        scene: The scene.
        comm: Communicator of all meshes.

    Raises:
        SceneError: If something the scene names does not exist on the meshes.
    """
    dynamic = not scene.static
    shells = {
        shell.name: build_shell(shell, build_surface(shell, comm), _loads_of(scene, shell), dynamic)
        for shell in scene.shells
    }
    kinks = _join(scene, shells)
    # joins change directors: lines of shells come after them
    lines = {
        beam.name: line_along(beam, shells[beam.curve.shell])
        for beam in scene.beams
        if beam.curve.shell is not None
    }
    beams = {}
    for beam in scene.beams:
        line = lines[beam.name].line if beam.name in lines else None
        beams[beam.name] = build_beam(beam, comm, _loads_of(scene, beam), dynamic, line)
    doubt_thickness(comm, shells, beams)
    doubt_slits(comm, shells)
    doubt_units(comm, scene, shells, beams)
    found = Meshed(shells, beams, kinks, lines)
    doubt_natural(comm, scene.t_end or 1.0, found.all)
    return found


def _join(scene: Scene, shells: dict[str, ShellModel]) -> list[NodalConstraint]:
    """Join shells along edges; returns the constraints of kinks."""
    kinks = []
    for join in scene.joins:
        first, second = shells[join.first], shells[join.second]
        links, constraint = join_shells(join, first, second)
        second.links += tuple(links)
        if constraint is not None:
            constraint.inertialess = first.inertialess and second.inertialess
            kinks.append(constraint)
    return kinks


def _loads_of(scene: Scene, body: Shell | Beam) -> list[Distributed]:
    """Distributed loads of a body, and its natural strain, whose stress is one.

    Loads at points are bodies of the system themselves.
    """
    found: list[Distributed] = [
        load
        for load in scene.loads
        if not isinstance(load, PointLoad) and body in scene.bodies_of(load)
    ]
    return found if body.natural is None else [*found, body.natural]
