"""The shell of `sudden_load` by hand: EP and EP4 in plain DOLFINx, all equations on one page.

Numbers of the scene and the space of forces are those of shellmb. All unknowns are in one matrix;
20 steps agree with the package's to 1e-10. Equation numbers are those of the paper; (Q1)-(Q4) are
in `docs/theory/schemes.md`. The file is no scene: run it by

    python -m shellmb.demos.weak_form_by_hand
"""

# CI: python -m shellmb.demos.weak_form_by_hand

from mpi4py import MPI

import basix.ufl
import numpy as np
import ufl
from dolfinx import fem, mesh
from dolfinx.fem.petsc import NewtonSolverNonlinearProblem
from dolfinx.nls.petsc import NewtonSolver
from ufl import as_matrix, as_vector, det, dot, grad

from shellmb.demos.sudden_load import LENGTH, WIDTH, scene
from shellmb.meshes.tying import shell_forces

NUMBERS = scene()
(PLATE,), DT = NUMBERS.shells, NUMBERS.dt
E, NU, THICK, RHO = (getattr(PLATE.section, k) for k in ("E", "nu", "thickness", "density"))

# The reference surface and its triad, eq. (3). It is plane: kappa of eq. (10) is zero
domain = mesh.create_rectangle(
    MPI.COMM_SELF, [(0, 0), (LENGTH, WIDTH)], PLATE.mesh, mesh.CellType.quadrilateral, gdim=3
)


def constant(value):
    return fem.Constant(domain, np.asarray(value, dtype=float))


def rule(points, weights):
    custom = {"quadrature_points": points, "quadrature_weights": weights}
    return ufl.dx(domain, metadata={"quadrature_rule": "custom", **custom})


FORCES = shell_forces(basix.CellType.quadrilateral, 2)
# for all that is integrated, and where strains are taken: 11 and 13; 22 and 23; 12
dx, dx_taken = ufl.dx(domain, degree=5), [rule(r.points, r.weights) for r in FORCES.rules]
dx_nodes = ufl.dx(domain, metadata={"quadrature_rule": "GLL", "quadrature_degree": 3})
at_tip = ufl.conditional(ufl.gt(ufl.SpatialCoordinate(domain)[0], 0.999 * LENGTH), 1.0, 0.0)
E1, E2, D = (constant(axis) for axis in np.eye(3))
J = ufl.Jacobian(domain)
F = as_matrix([[J[0, 0], J[0, 1]], [J[1, 0], J[1, 1]]])  # of the reference cell, in the triad

# Section: N* = A eps, M* = B kap, Q* = G gam; inertia m, I* of eq. (16).
plane_stress = E / (1 - NU**2) * np.array([[1, NU, 0], [NU, 1, 0], [0, 0, (1 - NU) / 2]])
A_inv, B = constant(np.linalg.inv(THICK * plane_stress)), constant(THICK**3 / 12 * plane_stress)
m, I = constant(RHO * THICK), constant(RHO * THICK**3 / 12)  # noqa: E741 (the paper's symbol)
G, N0 = (constant(THICK * k) for k in (5 / 6 * E / (2 * (1 + NU)), plane_stress[0, 0]))  # N0: scale

# Unknowns q: displacement u (4), change w of the director E3 = D + w, independent forces N/N0 of
# the elements (docs/theory/shells.md), discontinuous, and the multiplier lam of |E3| = 1.
nodal = basix.ufl.element("Lagrange", "quadrilateral", 2, shape=(3,))
SHELL = [nodal, nodal, FORCES.element, basix.ufl.element("Lagrange", "quadrilateral", 2)]


def tangents(q):  # columns of E and H, eqs. (7)-(8), less the reference: u,1 u,2 w w,1 w,2
    u, w = q[:2]
    return grad(u)[:, 0], grad(u)[:, 1], w, grad(w)[:, 0], grad(w)[:, 1]


def bilinear(T, t):
    """Eq. (9): e = b(T0, t) + b(t, t)/2, T0 at rest; eps, kap 11, 22, 2*12; gam 13, 23."""
    (x1, x2, d, d1, d2), (y1, y2, f, f1, f2) = T, t
    eps = dot(x1, y1), dot(x2, y2), dot(x1, y2) + dot(x2, y1)
    kap12 = dot(x1, f2) + dot(x2, f1) + dot(d1, y2) + dot(d2, y1)
    kap = dot(x1, f1) + dot(d1, y1), dot(x2, f2) + dot(d2, y2), kap12
    return as_vector([*eps, *kap, dot(x1, f) + dot(d, y1), dot(x2, f) + dot(d, y2)])


def lin(q):
    return bilinear((E1, E2, D, 0 * E1, 0 * E1), tangents(q))


def quad(q, p):
    return bilinear(tangents(q), tangents(p))


def strain(q):  # e(q) of eq. (9)
    return lin(q) + quad(q, q) / 2


def slope(q, dq):  # De(q) dq; e is quadratic: e_f - e_i = De(q_m)(q_f - q_i), eq. (20)
    return lin(dq) + quad(q, dq)


def part(e, *components):
    return as_vector([e[k] for k in components])


def force(N):  # membrane and shear forces of an element, from contravariant components, constants
    p = F * as_matrix([[N[1], N[4]], [N[4], N[3]]]) * F.T / det(F)
    return as_vector([p[0, 0], p[1, 1], p[0, 1]]) + part(N, 7, 8, 9), F * part(N, 11, 13) / det(F)


def work(N, e):  # <N, e>: covariant strains F^T e F by the weights of N where they are taken
    strains = F.T * as_matrix([[e[0], e[2] / 2], [e[2] / 2, e[1]]]) * F / det(F)
    g = F.T * part(e, 6, 7) / det(F)
    first, second = N[0] * strains[0, 0] + N[10] * g[0], N[2] * strains[1, 1] + N[12] * g[1]
    taken = first, second, 2 * N[4] * strains[0, 1]
    uniform = dot(part(N, 7, 8, 9), part(e, 0, 1, 2)) * dx
    return N0 * (uniform + sum(t * d for t, d in zip(taken, dx_taken, strict=True)))


def internal(e, N, de):
    """Virtual work of the stresses of strains e and forces N on the strains de, eqs. (12), (22)."""
    return dot(B * part(e, 3, 4, 5), part(de, 3, 4, 5)) * dx + work(N, de)


def compatible(e, N, dN):  # independent forces are those of strains: eps = A^-1 N*, gam = Q*/G
    (n, Q), (dn, dQ) = force(N), force(dN)
    return work(dN, e) - N0**2 * (dot(dn, A_inv * n) + dot(dQ, Q) / G) * dx


def inertia(rate, dq):  # virtual work of the rates of h = m u' and g = I* E3', eqs. (26), (27)
    return m * dot(rate[0], dq[0]) * dx + I * dot(rate[1], dq[1]) * dx_nodes


def external(dq):  # virtual work of the edge force, p of eq. (26), there at once
    return at_tip * dot(constant(NUMBERS.loads[0].force), dq[0]) * ufl.ds(domain)


def length(w):  # the constraint g(q) = (E3.E3 - 1)/2; quadratic, so its forces can do no work
    return dot(D, w) + dot(w, w) / 2


def total(*terms):  # sum of states, each with its weight
    return [sum(weight * q[k] for weight, q in terms) for k in range(4)]


def ep(qi, pi, qf, pf, dq, dp):
    """Energy preserving, eqs. (23), (25)-(27). Velocities are p = DT v."""
    qm, pm = total((0.5, qi), (0.5, qf)), total((0.5, pi), (0.5, pf))  # (17)
    update = sum(ufl.inner(f - i - p, d) for f, i, p, d in zip(qf, qi, pm, dp, strict=True))  # (23)
    tau_a = (strain(qi) + strain(qf)) / 2, (qi[2] + qf[2]) / 2  # (21)
    work = inertia(total((1 / DT**2, pf), (-1 / DT**2, pi)), dq) - external(dq)
    work += internal(*tau_a, slope(qm, dq))
    director = qf[3] * dot(D + qm[1], dq[1]) + dq[3] * length(qf[1])
    return work + compatible(strain(qf), qf[2], dq[2]) + G * director * dx_nodes + update * dx


def ep4(qi, pi, qf, pf, dq, dp):
    """Energy preserving, quadratic in time, (Q1)-(Q4) with alpha = 0; rows P0 (dq) and P1 (dp)."""
    chord, z = total((1, qf), (-1, qi)), total((1 / 12, pf), (-1 / 12, pi))  # (Q1)
    middle, y = total((0.5, qi), (0.5, qf)), total((0.25, pi), (0.25, pf))
    x = total((1, middle), (-1, z))
    e0 = lin(x) + (quad(x, x) - quad(z, z) + quad(chord, chord) / 4) / 2 - quad(chord, y) / 6  # <s>
    e1 = slope(middle, chord) / 2  # (e_f - e_i)/2
    # (Q2) with the stresses (Q3); the independent forces of S_1 are those of pf
    work = internal(e0, qf[2], slope(x, dq) + quad(chord, dp) / 6) - external(dq)
    work += internal(e1, pf[2], quad(y, dq) / 3 + slope(middle, dp) / 3)
    work += inertia(total((1 / DT**2, pf), (-1 / DT**2, pi)), dq)
    work += inertia(total((1 / DT**2, pf), (1 / DT**2, pi), (-2 / DT**2, chord)), dp)
    director = qf[3] * (dot(D + x[1], dq[1]) + dot(chord[1], dp[1]) / 6)  # (Q4)
    director += pf[3] * (dot(y[1], dq[1]) + dot(D + middle[1], dp[1]))
    director += dq[3] * length(qf[1]) + dp[3] * dot(D + qf[1], pf[1])  # g = 0 and Dg v = 0
    held = compatible(e0, qf[2], dq[2]) + compatible(e1, pf[2], dp[2])
    return work + held + G * director * dx_nodes


def tip_history(scheme, steps):
    """Displacements of the middle of the free edge at the ends of steps, shape (steps, 3) [m]."""
    space = fem.functionspace(domain, basix.ufl.mixed_element(SHELL * 2))
    known, unknown = fem.Function(space), fem.Function(space)  # (q, DT v) at both ends of a step
    states = [ufl.split(f) for f in (known, unknown, ufl.TestFunction(space))]
    residual = scheme(*(half for state in states for half in (state[:4], state[4:])))
    clamped = mesh.locate_entities_boundary(domain, 1, lambda x: np.isclose(x[0], 0))
    held = [fem.locate_dofs_topological(space.sub(k), 1, clamped) for k in (0, 1, 3, 4, 5, 7)]
    bcs = [fem.dirichletbc(fem.Function(space), dofs) for dofs in held]
    quick = {"cffi_extra_compile_args": ["-O0"]}  # to compile, where there are twelve elements
    problem = NewtonSolverNonlinearProblem(residual, unknown, bcs, jit_options=quick)
    newton = NewtonSolver(domain.comm, problem)
    newton.convergence_criterion, newton.rtol = "incremental", 1e-10
    newton.krylov_solver.getPC().setFactorSolverType("mumps")
    u, places = space.sub(0).collapse()
    node = np.linalg.norm(u.tabulate_dof_coordinates() - (LENGTH, WIDTH / 2, 0), axis=1).argmin()
    tip, history = np.reshape(places, (-1, 3))[node], np.empty((steps, 3))
    for step in range(steps):
        newton.solve(unknown)
        known.x.array[:] = unknown.x.array
        history[step] = unknown.x.array[tip]
    return history


if __name__ == "__main__":
    # the package's last step: tests/golden/test_by_hand.py compares all
    for scheme, last in ((ep, 2.742907925626e-03), (ep4, 2.756608533606e-03)):
        print(scheme.__name__, tip_z := tip_history(scheme, 20)[:, 2])
        assert abs(tip_z[-1] / last - 1) < 1e-10
