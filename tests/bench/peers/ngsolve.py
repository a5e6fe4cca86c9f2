"""Shells in NGSolve (PyPI `ngsolve`, the extra `peers`), by forms as its documentation writes them.

NGSolve has no shell of its own: its documentation shows the nonlinear Koiter shell by the method of
Hellan, Herrmann and Johnson (M. Neunteufel, J. Schoeberl, Comput. Struct. 305 (2024) 107543), with
moments that cells eliminate, angles at edges against averaged normals of the last load step, and
membrane strains interpolated into Regge's space. Written here with its recommendations: `Compile`,
static condensation, `sparsecholesky`, and damped first iterations where curved shells need them.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping
from typing import Any

from shellmb.demos.verification.measuring import Stopwatch
from tests.bench.peers.codes import require_package

# Newton iterations of a load step at most
MOST = 60


def require() -> Any:
    """The module, silent.

    Raises:
        SceneError: If it is not installed.
    """
    require_package("ngsolve")
    import ngsolve

    ngsolve.ngsglobals.msg_level = 0
    return ngsolve


class Koiter:
    """A Koiter shell on a structured mesh of quadrilaterals.

    Args:
        ngs: The module.
        mesh: Elements along two directions.
        degree: Degree of the displacements; that of moments is one less.
        section: E, Poisson's ratio, thickness, density.
        place: Position of a point, both arguments from 0 to 1, in functions of `ngs`.
        fixed: Edges at which displacements along x, y, z are held, by the keywords of `VectorH1`.
        clamped: Edges whose normals stay; "": none.
        symmetric: Edges in planes of symmetry; "": none.
        points: Corners by the names under which forces act there.
    """

    def __init__(
        self,
        ngs: Any,
        mesh: tuple[int, int],
        degree: int,
        section: tuple[float, float, float, float],
        place: Callable[[Any, Any, Any], Any],
        fixed: Mapping[str, str],
        clamped: str = "",
        symmetric: str = "",
        points: Mapping[str, tuple[float, float, float]] | None = None,
    ) -> None:
        from netgen.meshing import SurfaceGeometry

        points = points or {}
        (nx, ny), (modulus, poisson, thickness, _) = mesh, section
        geometry = SurfaceGeometry(place)
        # 6.2.2608: the program ends in a segmentation fault where one was freed
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(geometry))
        surface = geometry.GenerateMesh(
            quads=True, nx=nx, ny=ny, bbbpts=list(points.values()), bbbnames=list(points)
        )
        self._ngs, self.mesh = ngs, ngs.Mesh(surface)
        self.mesh.Curve(degree)
        held = "|".join(filter(None, (clamped, symmetric)))
        moments = ngs.HDivDivSurface(self.mesh, order=degree - 1, discontinuous=True)
        space = ngs.VectorH1(self.mesh, order=degree, **fixed) * moments
        space *= ngs.NormalFacetSurface(self.mesh, order=degree - 1, dirichlet_bbnd=held)
        regge = ngs.HCurlCurl(self.mesh, order=degree - 1, discontinuous=True)
        self.solution = ngs.GridFunction(space)
        self.u, m, turn = space.TrialFunction()
        m, turn = m.Trace(), turn.Trace()
        normal, along = ngs.specialcf.normal(3), ngs.specialcf.tangential(3)
        across = ngs.Cross(normal, along)
        tangent = ngs.Id(3) - ngs.OuterProduct(normal, normal)

        def moved(gradient: Any) -> tuple[Any, Any]:
            deformation = gradient + tangent
            return deformation, ngs.Cof(deformation) * normal

        deformation, area = moved(ngs.Grad(self.u).Trace())
        strain = 0.5 * (deformation.trans * deformation - tangent)
        normal_now, along_now = ngs.Normalize(area), ngs.Normalize(deformation * along)
        across_now = ngs.Cross(normal_now, along_now)
        hessian = (self.u.Operator("hesseboundary").trans * normal_now).Reshape((3, 3))
        bent = hessian + (ngs.Norm(area) - normal * normal_now) * ngs.Grad(normal)
        # normals at edges: averages of the last load step, and of the start
        edges = ngs.FacetSurface(self.mesh, order=0)
        marks = [ngs.GridFunction(edges), ngs.GridFunction(edges)]
        for mark, names in zip(marks, (clamped, symmetric), strict=True):
            if names:
                mark.Set(1, definedon=self.mesh.BBoundaries(names))
        averages = ngs.VectorFacetSurface(self.mesh, order=degree - 1)
        average, first = ngs.GridFunction(averages), ngs.GridFunction(averages)
        everywhere = self.mesh.Boundaries(".*")
        for each in (average, first):
            each.Set(normal, dual=True, definedon=everywhere)
        last = ngs.Normalize(moved(ngs.Grad(self.solution.components[0]))[1])
        kept = (1 - marks[0] - marks[1]) * last + marks[0] * normal
        kept += marks[1] * (last - (last * across) * across)
        self._normals = average, kept
        seen = ngs.Normalize(average - (along_now * average) * along_now)
        angle = ngs.acos(across_now * seen) - ngs.acos(across * ngs.Normalize(first))

        def squared(tensor: Any, a: float, b: float) -> Any:
            return a * ngs.InnerProduct(tensor, tensor) + b * ngs.Trace(tensor) ** 2

        plane = modulus / (1 - poisson**2)
        stretched = squared(ngs.Interpolate(strain, regge), plane * (1 - poisson), plane * poisson)
        soft = squared(m, (1 + poisson) / modulus, -poisson / modulus)
        self.factor = ngs.Parameter(0.0)
        self._form = ngs.BilinearForm(space, symmetric=True, condense=True)
        work = ngs.InnerProduct(bent, m) / ngs.Norm(area) - 6 / thickness**3 * soft
        edge = ngs.ds(element_boundary=True)
        for energy in (
            0.5 * thickness * stretched * ngs.ds,
            work * ngs.ds,
            (angle + turn * across) * m[across, across] * edge,
        ):
            self._form += ngs.Variation(energy).Compile()
        # the moment about an edge goes with this
        self._turn = turn * across

    def moment(self, density: Any) -> None:
        """Turn edges.

        Args:
            density: Moment per length of an edge, zero at all others.
        """
        edge = self._ngs.ds(element_boundary=True)
        self._form += self._ngs.Variation(-self.factor * density * self._turn * edge)

    def force(self, point: str, component: int, size: float) -> None:
        """Pull at a named corner.

        Args:
            point: Its name.
            component: Direction.
            size: The force.
        """
        where = self._ngs.dx(definedon=self.mesh.BBBoundaries(point))
        self._form += self._ngs.Variation(-self.factor * size * self.u[component] * where)

    def solve(self, steps: int, tolerance: float, damping: float = 1.0) -> tuple[int, float, str]:
        """Solve in equal load steps; set-up is not timed.

        Args:
            steps: Their number.
            tolerance: Of the last increment of Newton's method, relative to the solution.
            damping: Part of the first increment that is made; of the n-th one n times as much.

        Returns:
            Newton iterations, processor time [s], and why it ended early, "" if it did not.
        """
        watch, iterations = Stopwatch(), 0
        for step in range(1, steps + 1):
            self.factor.Set(step / steps)
            average, now = self._normals
            average.Set(now, dual=True, definedon=self.mesh.Boundaries(".*"))
            made = self._newton(tolerance, damping)
            iterations += made or MOST
            if made is None:
                return iterations, watch.cpu, f"no convergence in load step {step}"
        return iterations, watch.cpu, ""

    def _newton(self, tolerance: float, damping: float) -> int | None:
        ngs, form, x = self._ngs, self._form, self.solution.vec
        residual, change = x.CreateVector(), x.CreateVector()
        for k in range(1, MOST + 1):
            form.AssembleLinearization(x)
            form.Apply(x, residual)
            inverse = form.mat.Inverse(self.solution.space.FreeDofs(True), "sparsecholesky")
            residual.data += form.harmonic_extension_trans * residual
            change.data = inverse * residual
            change.data += form.harmonic_extension * change
            change.data += form.inner_solve * residual
            share = min(1.0, k * damping)
            x.data -= share * change
            size = ngs.Norm(change)
            if not size < 1e10 * max(ngs.Norm(x), 1.0):
                return None
            if share == 1.0 and size <= tolerance * ngs.Norm(x):
                return k
        return None

    def moved(self, x: float, y: float, z: float) -> list[float]:
        """Displacement of a point of the undeformed shell."""
        there = self.solution.components[0](self.mesh(x, y, z, self._ngs.BND))
        return [float(v) for v in there]
