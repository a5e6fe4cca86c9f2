"""Forms share a program if UFL's signature says that they are alike, and only then."""

from collections.abc import Iterator
from itertools import combinations

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import basix.ufl
import ufl

from shellmb.native.structure import structure


def forms() -> Iterator[ufl.Form]:
    """One form in all variants that make another one of it, and in some that do not."""
    for cell, degree, count in (("triangle", 1, 2), ("triangle", 2, 2), ("quadrilateral", 1, 3)):
        mesh = ufl.Mesh(basix.ufl.element("Lagrange", cell, 1, shape=(count,)))
        space = ufl.FunctionSpace(mesh, basix.ufl.element("Lagrange", cell, degree, shape=(3,)))
        scalars = ufl.FunctionSpace(mesh, basix.ufl.element("Lagrange", cell, degree))
        f, g, s = ufl.Coefficient(space), ufl.Coefficient(space), ufl.Coefficient(scalars)
        v, u = ufl.TestFunction(space), ufl.TrialFunction(space)
        c, k = ufl.Constant(mesh), ufl.Constant(mesh, shape=(3,))
        for _ in range(2):  # indices and labels have other names each time
            i, j = ufl.indices(2)
            marked = ufl.variable(s)
            yield c * f[i] * ufl.grad(v)[i, j] * ufl.grad(g)[0, j] * ufl.dx
            yield ufl.diff(marked**2 + c * marked, marked) * v[0] * ufl.dx
            yield ufl.derivative(ufl.dot(f, f) ** 2 * ufl.dx, f, v)
        yield c * f[i] * ufl.grad(v)[i, j] * ufl.grad(g)[1, j] * ufl.dx
        yield c * g[i] * ufl.grad(v)[i, j] * ufl.grad(f)[0, j] * ufl.dx
        yield c * f[j] * ufl.grad(v)[i, j] * ufl.grad(g)[0, i] * ufl.dx
        yield k[0] * ufl.dot(f, v) * ufl.dx
        yield c * ufl.dot(f, v) * ufl.dx
        yield c * ufl.dot(v, f) * ufl.dx
        yield c * ufl.dot(u, v) * ufl.dx
        yield c * ufl.dot(f, v) * ufl.dx(3)
        yield c * ufl.dot(f, v) * ufl.dx(metadata={"quadrature_degree": 3})
        yield c * ufl.dot(f, v) * ufl.ds
        yield 2 * ufl.dot(f, v) * ufl.dx
        yield 2.5 * ufl.dot(f, v) * ufl.dx
        yield ufl.dot(f, v) * ufl.SpatialCoordinate(mesh)[0] * ufl.dx
        yield ufl.dot(f, v) * ufl.CellVolume(mesh) * ufl.dx
        yield ufl.dot(f, v) * ufl.conditional(ufl.gt(s, 0), 1, 2) * ufl.dx
        yield ufl.dot(f, v) * ufl.conditional(ufl.lt(s, 0), 1, 2) * ufl.dx
        yield c * ufl.dot(f, v) * ufl.dx + ufl.dot(g, v) * ufl.ds
        yield c * ufl.dot(f, v) * ufl.dx + ufl.dot(f, v) * ufl.ds


def test_forms_are_alike_as_their_signatures_say() -> None:
    marks = [(structure(form), form.signature()) for form in forms()]
    same = [a[1] == b[1] for a, b in combinations(marks, 2)]
    assert [a[0] == b[0] for a, b in combinations(marks, 2)] == same
    assert 3 * 3 <= sum(same) < len(same) / 20
