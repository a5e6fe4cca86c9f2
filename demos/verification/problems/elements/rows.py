"""Rows of the evidence of elements: a problem, a mesh, and what each element gives there.

A problem is a function of a mesh that returns values over their references. A row says on which
mesh, and for each element what the trial of the elements gave there in NumPy (of nodes and
directors as the product has them). A value passes within 1 % of that, or nearer to 1.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats
from shellmb.demos.verification.cases import Check, case
from shellmb.demos.verification.setups import Cell
from shellmb.demos.verification.solve import solved
from shellmb.scene import Scene, Section, Shell, Surface
from shellmb.simulate.simulation import Simulation

# beside what was tried, or nearer to 1
NEAR = 0.01
# of an element's size, as the meshes of `Shell(distortion=)`
MOVED = 0.25

Values = dict[str, float]
Figures = float | Sequence[float]


@dataclass(frozen=True)
class Mesh:
    """Mesh of a shell, by its elements.

    Args:
        cell: Cell type.
        size: Numbers of elements.
        moved: Distortion.
    """

    cell: Cell
    size: tuple[int, int]
    moved: float = 0.0

    def shell(self, surface: Surface, section: Section, name: str = "shell", **more: Any) -> Shell:
        """A shell on this mesh.

        Args:
            surface: Its surface.
            section: Its section.
            name: Its name.
            more: Further arguments of `Shell`.
        """
        return Shell(
            name, surface, section, self.size, cell=self.cell, distortion=self.moved, **more
        )


@dataclass(frozen=True)
class Row:
    """A problem on a mesh.

    Args:
        size: Numbers of elements.
        quad: Value over the reference that quadrilaterals were tried to give, or values in the
            order in which the problem returns them; one for all of them.
        tri: The same of triangles.
        moved: Distortion.
        given: Further arguments of the problem.
    """

    size: tuple[int, int]
    quad: Figures
    tri: Figures
    moved: float = 0.0
    given: dict[str, Any] = field(default_factory=dict)

    def title(self, cell: Cell) -> str:
        """Mesh and arguments in words."""
        said = [f"{cell} {self.size[0]}x{self.size[1]}"]
        said += [f"moved by {100 * self.moved:g} %"] if self.moved else []
        said += [
            f"{name}={value:g}" if isinstance(value, float) else str(value)
            for name, value in self.given.items()
        ]
        return ", ".join(said)


def problem(
    name: str, source: str, *rows: Row, slow: bool = False
) -> Callable[[Callable[..., Values]], Callable[..., Values]]:
    """Register a problem on meshes of both elements.

    Args:
        name: Name of the case, behind "elements/".
        source: Where the references come from.
        rows: Its meshes and figures.
        slow: Whether it is left out unless requested.
    """

    def register(values: Callable[..., Values]) -> Callable[..., Values]:
        def checks() -> Iterator[Check]:
            for row in rows:
                both: tuple[tuple[Cell, Figures], ...] = ("quad", row.quad), ("tri", row.tri)
                for cell, figures in both:
                    found = values(Mesh(cell, row.size, row.moved), **row.given)
                    tried = np.broadcast_to(figures, len(found))
                    for (what, value), figure in zip(found.items(), tried, strict=True):
                        bound = abs(float(figure) - 1) + NEAR
                        yield Check(
                            f"{row.title(cell)}{'; ' if what else ''}{what}",
                            float(value),
                            1.0,
                            source,
                            bound,
                        )

        checks.__doc__ = values.__doc__
        case(f"elements/{name}", slow)(checks)
        return values

    return register


def statics(*shells: Shell, **more: Any) -> Simulation:
    """Shells in linear statics, solved.

    Args:
        shells: The shells.
        more: Further arguments of `Scene`.
    """
    return solved(Scene("elements", shells, scheme="linear-statics", **more))


def everywhere(simulation: Simulation, name: str = "shell") -> tuple[Floats, Floats]:
    """Nodes of a shell and their displacements, each of shape (n, 3), the same on all ranks.

    Args:
        simulation: The simulation, with a step solved.
        name: Name of the shell.
    """
    body = simulation.model.shells[name]
    state = simulation.problem.levels[name].unknown[simulation.problem.last].x.array
    owned = body.mixed.subspaces["u"].dofmap.index_map.size_local
    u = state[body.mixed.dofs["u"]].reshape(-1, 3)[:owned]
    both = np.concatenate([body.mixed.nodes("u")[:owned], u], axis=1)
    comm: MPI.Comm = simulation.model.comm
    gathered = np.concatenate(comm.allgather(both))
    return gathered[:, :3], gathered[:, 3:]
