"""A beam whose strains are small relative to a floating frame, and beams of both kinds."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

from mpi4py import MPI

from ufl.core.expr import Expr

from shellmb.forms.floating import beam as floating
from shellmb.forms.floating.frame import frame_constraints
from shellmb.forms.measure import Measure
from shellmb.meshes.curve_mesh import LineMesh, build_line
from shellmb.model.frames.beam import BeamModel
from shellmb.model.frames.floating import EVERYWHERE, FRAME, FloatingFrame, identified
from shellmb.model.sections.natural import Distributed
from shellmb.scene import Beam


class LinearBeam(BeamModel):
    """A beam with a floating frame; made as `BeamModel` is."""

    everywhere = EVERYWHERE

    def __init__(
        self, beam: Beam, domain: LineMesh, loads: Sequence[Distributed], dynamic: bool
    ) -> None:
        super().__init__(beam, domain, loads, dynamic)
        self.ties = (FloatingFrame(self.mixed, self._apart, self.rules.full, self.force),)
        self.links = tuple(identified(self.mixed, self.name))
        self.kinematic |= {FRAME}

    def _apart(self, q: Expr) -> Expr:
        """Constraints that tie the frame, shape (9,)."""
        turned = floating.turned(self.layout.part(q, "w"), self.line)
        return frame_constraints(self.layout.part(q, FRAME), turned)

    def _moved(self, q: Expr) -> tuple[Expr, Expr, Expr]:
        return (*self._motion(q), self.layout.part(q, FRAME))

    @cached_property
    def strain(self) -> Measure:
        """Strains relative to the frame, shape (6,)."""
        return floating.strain_measure(self.line, self._moved)

    def acting(self, e: Expr, N: Expr, M: Expr) -> tuple[Expr, Expr]:
        """Forces and moments that balance loads: those conjugate to small strains."""
        return N, M


def build_beam(
    beam: Beam,
    comm: MPI.Comm,
    loads: Sequence[Distributed],
    dynamic: bool,
    domain: LineMesh | None = None,
) -> BeamModel:
    """Mesh a beam and bind its section and loads.

    Args:
        beam: Description.
        comm: Communicator; the call is collective.
        loads: Distributed loads on it.
        dynamic: Whether it moves in time.
        domain: Its meshed line, if it runs along a shell.

    Raises:
        SceneError: If its curve cannot be meshed as described.
    """
    if domain is None:
        domain = build_line(beam.name, beam.curve, beam.elements, beam.degree, beam.up, comm)
    kind = LinearBeam if beam.model == "floating-frame" else BeamModel
    return kind(beam, domain, loads, dynamic)
