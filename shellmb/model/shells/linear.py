"""A shell whose strains are small relative to a floating frame."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

from mpi4py import MPI as _MPI  # noqa: F401  (before dolfinx)

from ufl.core.expr import Expr

from shellmb.forms.floating import shell as floating
from shellmb.forms.floating.frame import frame_constraints
from shellmb.forms.measure import Measure
from shellmb.meshes.mesh import SurfaceMesh
from shellmb.model.frames.floating import EVERYWHERE, FRAME, FloatingFrame, identified
from shellmb.model.sections.natural import Distributed
from shellmb.model.shells.shell import ShellModel
from shellmb.scene import Shell


class LinearShell(ShellModel):
    """A shell with a floating frame; made as `DiscreteShell` is."""

    everywhere = EVERYWHERE

    def __init__(
        self,
        shell: Shell,
        surface_mesh: SurfaceMesh,
        loads: Sequence[Distributed],
        dynamic: bool,
    ) -> None:
        super().__init__(shell, surface_mesh, loads, dynamic)
        full, force = self.rules.full, self.section.force
        self.ties = (FloatingFrame(self.mixed, self._apart, full, force),)
        self.links = tuple(identified(self.mixed, self.name))
        self.kinematic |= {FRAME}

    def _frame(self, q: Expr) -> Expr:
        return self.layout.part(q, FRAME)

    def _apart(self, q: Expr) -> Expr:
        """Constraints that tie the frame, shape (9,)."""
        return frame_constraints(self._frame(q), floating.turned(*self.straining(q), self.surface))

    def _moved(self, q: Expr) -> tuple[Expr, Expr, Expr]:
        return (*self.straining(q), self._frame(q))

    @cached_property
    def strain(self) -> Measure:
        """Strains relative to the frame, shape (8,)."""
        return floating.strain_measure(self.surface, self._moved)


def build_shell(
    shell: Shell, surface_mesh: SurfaceMesh, loads: Sequence[Distributed], dynamic: bool
) -> ShellModel:
    """A shell with the strains that its model has; arguments as of `DiscreteShell`."""
    kind = LinearShell if shell.model == "floating-frame" else ShellModel
    return kind(shell, surface_mesh, loads, dynamic)
