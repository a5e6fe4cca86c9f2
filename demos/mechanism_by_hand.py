"""A curved shell on a hinged arm by hand: ED, eq. (35) and a revolute joint in plain DOLFINx.

The sister of `weak_form_by_hand`: the energy decaying scheme, eqs. (28)-(34), with the multipliers
of joints among the unknowns of one matrix. Of shellmb is the space of forces only; 20 steps agree
with the package's to 1e-10. Equation numbers are those of the paper. It is no scene: run it by

    python -m shellmb.demos.mechanism_by_hand
"""

# CI: python -m shellmb.demos.mechanism_by_hand

from mpi4py import MPI

import basix.ufl
import numpy as np
import ufl
from dolfinx import fem, mesh
from dolfinx.fem.petsc import NewtonSolverNonlinearProblem
from dolfinx.nls.petsc import NewtonSolver
from ufl import as_matrix, as_vector, det, dot, grad, sqrt

from shellmb.meshes.tying import shell_forces

# A sector of a cylinder about x, soft as rubber, falls. Its corner is on an arm, which turns about
# a hinge on the ground. Units: m, kg, s.
RADIUS, LENGTH, ANGLE = 0.5, 0.4, np.pi / 3
E, NU, THICK, RHO = 2e6, 0.3, 0.02, 1000.0
CORNER, HINGE, AXIS = np.array([0, 0, RADIUS]), np.array([-0.3, 0.1, RADIUS]), (0.6, 0.8, 0.0)
MASS, EULER = 0.5, (8e-3, 2e-3, 1e-3)  # of the arm; second moments along its axes x, y, z
GRAVITY, DT, ALPHA = (0.0, 0.0, -9.81), 0.01, 0.5

# The reference surface: two quadratic elements, x along the first coordinate, the arc along the
# second. Nodes of an element: corners, middles of sides, middle.
NODES = [(0, 0), (2, 0), (0, 2), (2, 2), (1, 0), (0, 1), (2, 1), (1, 2), (1, 1)]
cells = np.array([[5 * i + j + 2 * k for i, j in NODES] for k in range(2)])
grid = [(i * LENGTH / 2, j * ANGLE / 4) for i in range(3) for j in range(5)]
points = np.array([(x, -RADIUS * np.sin(a), RADIUS * np.cos(a)) for x, a in grid])
nodal = basix.ufl.element("Lagrange", "quadrilateral", 2, shape=(3,))
domain = mesh.create_mesh(MPI.COMM_SELF, cells, nodal, points)


def constant(value):
    return fem.Constant(domain, np.asarray(value, dtype=float))


def rule(points, weights, **where):
    custom = {"quadrature_points": np.array(points), "quadrature_weights": np.array(weights)}
    return ufl.Measure("dx", domain, metadata={"quadrature_rule": "custom", **custom}, **where)


FORCES = shell_forces(basix.CellType.quadrilateral, 2)
dx, dx_taken = ufl.dx(domain, degree=5), [rule(r.points, r.weights) for r in FORCES.rules]
dx_nodes = ufl.dx(domain, metadata={"quadrature_rule": "GLL", "quadrature_degree": 3})
# The arm and its joints are a point: the corner at which the first element begins.
first, rest = (np.flatnonzero(domain.topology.original_cell_index == k) for k in range(2))
tags = mesh.meshtags(domain, 2, first, np.ones(1, dtype=np.int32))
dx_corner = rule([[0, 0]], [1], subdomain_data=tags, subdomain_id=1)  # of arm and joints
per_area = 1 / ufl.JacobianDeterminant(domain)  # makes dx_corner the value there

# The triad of eq. (3), whose third vector points outwards, and the director in the reference. This
# one turns from node to node: kappa of eq. (10) is that of the reference tangents.
J = ufl.Jacobian(domain)
E1, E2 = (line / sqrt(dot(line, line)) for line in (J[:, 0], -J[:, 1]))
F = as_matrix([[dot(e, J[:, k]) for k in range(2)] for e in (E1, E2)])  # of the reference cell
D = fem.Function(fem.functionspace(domain, nodal))
D.interpolate(lambda x: (0 * x[0], x[1] / RADIUS, x[2] / RADIUS))

# Section: N* = A eps, M* = B kap, Q* = G gam; inertia m, I* of eq. (16).
plane_stress = E / (1 - NU**2) * np.array([[1, NU, 0], [NU, 1, 0], [0, 0, (1 - NU) / 2]])
A_inv, B = constant(np.linalg.inv(THICK * plane_stress)), constant(THICK**3 / 12 * plane_stress)
m, I = (constant(RHO * moment) for moment in (THICK, THICK**3 / 12))  # noqa: E741 (the paper's)
G, N0 = (constant(THICK * k) for k in (5 / 6 * E / (2 * (1 + NU)), plane_stress[0, 0]))  # N0: scale

# Unknowns. Of the shell: displacement u, change w of the director E3 = D + w, forces N/N0 of the
# elements, discontinuous, and the multiplier of |E3| = 1. Of the arm: displacement of its centre,
# changes of its three directors, six multipliers that keep these orthonormal, and five of either
# joint. Velocities are unknown, too, with impulses of multipliers.
multiplier = basix.ufl.element("Lagrange", "quadrilateral", 2)
arm = basix.ufl.element("DQ", "quadrilateral", 0, shape=(28,))
STATE = [nodal, nodal, multiplier, arm, FORCES.element]


def tangents(q):  # columns of E and H, eqs. (7)-(8), less the reference: u,1 u,2 w w,1 w,2
    u, w = q[:2]
    return grad(u) * E1, grad(u) * E2, w, grad(w) * E1, grad(w) * E2


def bilinear(T, t):
    """Eq. (9) as a symmetric form: e = b(T0, t) + b(t, t)/2 with the reference tangents T0."""
    (x1, x2, d, d1, d2), (y1, y2, f, f1, f2) = T, t
    eps = dot(x1, y1), dot(x2, y2), dot(x1, y2) + dot(x2, y1)
    kap12 = dot(x1, f2) + dot(x2, f1) + dot(d1, y2) + dot(d2, y1)
    kap = dot(x1, f1) + dot(d1, y1), dot(x2, f2) + dot(d2, y2), kap12
    return as_vector([*eps, *kap, dot(x1, f) + dot(d, y1), dot(x2, f) + dot(d, y2)])


def lin(q):
    return bilinear((E1, E2, D, grad(D) * E1, grad(D) * E2), tangents(q))


def strain(q):  # e(q) of eq. (9)
    return lin(q) + bilinear(tangents(q), tangents(q)) / 2


def slope(q, dq):  # De(q) dq; e is quadratic: e_b - e_a = De(q_ab)(q_b - q_a), eq. (20)
    return lin(dq) + bilinear(tangents(q), tangents(dq))


def part(e, *components):
    return as_vector([e[k] for k in components])


def force(N):  # of an element at a point: see `weak_form_by_hand`
    p = F * as_matrix([[N[1], N[4]], [N[4], N[3]]]) * F.T / det(F)
    return as_vector([p[0, 0], p[1, 1], p[0, 1]]) + part(N, 7, 8, 9), F * part(N, 11, 13) / det(F)


def work(N, e):  # <N, e>
    strains = F.T * as_matrix([[e[0], e[2] / 2], [e[2] / 2, e[1]]]) * F / det(F)
    g = F.T * part(e, 6, 7) / det(F)
    first, second = N[0] * strains[0, 0] + N[10] * g[0], N[2] * strains[1, 1] + N[12] * g[1]
    taken = first, second, 2 * N[4] * strains[0, 1]
    uniform = dot(part(N, 7, 8, 9), part(e, 0, 1, 2)) * dx
    return N0 * (uniform + sum(t * d for t, d in zip(taken, dx_taken, strict=True)))


def internal(e, N, de):
    """Work of stresses of strains e and forces N on strains de, (12), (22)."""
    return dot(B * part(e, 3, 4, 5), part(de, 3, 4, 5)) * dx + work(N, de)


def compatible(e, N, dN):  # independent forces are those of strains: eps = A^-1 N*, gam = Q*/G
    (n, Q), (dn, dQ) = force(N), force(dN)
    return work(dN, e) - N0**2 * (dot(dn, A_inv * n) + dot(dQ, Q) / G) * dx


def inertia(p, dq):  # virtual work of rates of h = m u' and g = I* E3', of shell and arm; p = DT v
    v, factors = [x / DT**2 for x in p[:4]], np.repeat((MASS, *EULER), 3)
    point = per_area * sum(c * v[3][k] * dq[3][k] for k, c in enumerate(factors))
    return m * dot(v[0], dq[0]) * dx + I * dot(v[1], dq[1]) * dx_nodes + point * dx_corner


def external(dq):  # virtual work of the weights
    g = constant(GRAVITY)
    return m * dot(g, dq[0]) * dx + per_area * MASS * dot(g, part(dq[3], 0, 1, 2)) * dx_corner


def turned(q, axis):  # change of a vector with these components along the arm's directors
    return as_vector([sum(axis[k] * q[3][3 + 3 * k + c] for k in range(3)) for c in range(3)])


def joints(q):
    """Constraints of the arm, its hinge, and the shell revolute joint, eq. (35), shape (16,)."""
    axes = [(constant(axis), turned(q, axis)) for axis in np.eye(3)]  # E3 is the third one at rest
    pairs = [(axes[k], axes[m]) for k in range(3) for m in range(k + 1)]
    own = [dot(e, df) + dot(de, f) + dot(de, df) for (e, de), (f, df) in pairs]  # orthonormal
    arms = [turned(q, end - (CORNER + HINGE) / 2) for end in (HINGE, CORNER)]
    at_hinge, at_shell = (part(q[3], 0, 1, 2) + arm for arm in arms)  # displacements of its ends
    across = np.linalg.svd([AXIS])[2][1:]  # two vectors of the ground at right angles to the hinge
    hinge = [*at_hinge, *(dot(constant(e), turned(q, AXIS)) for e in across)]
    shell = [dot(D + q[1], de) + dot(q[1], e) for e, de in axes[:2]]  # E3 . e_alpha = 0, eq. (35)
    return as_vector([*own, *hinge, *(q[0] - at_shell), *shell])


def values(q):  # of all constraints: (E3.E3 - 1)/2 of the shell's directors, and of the joints
    return dot(D, q[1]) + dot(q[1], q[1]) / 2, joints(q)


def slopes(q, dq):  # Dg(q) dq of all constraints
    at = [ufl.variable(x) for x in q]
    return dot(D + q[1], dq[1]), sum(ufl.diff(joints(at), at[k]) * dq[k] for k in (0, 1, 3))


def held(q, value, forces, dq):
    """Forces along the slopes of constraints at q, and values that vanish: no work, eq. (20)."""
    change, lam, dlam = slopes(q, dq), forces[3], dq[3]
    pairs = [(lam[12 + k], change[1][k], dlam[12 + k], value[1][k]) for k in range(16)]
    of_length = forces[2] * change[0] + dq[2] * value[0]
    of_joints = sum(a * b + c * d for a, b, c, d in pairs)
    return G * of_length * dx_nodes + per_area * G * of_joints * dx_corner


def total(*terms):  # sum of states or rates, each with its weight
    return [sum(weight * q[k] for weight, q in terms) for k in range(len(terms[-1][1]))]


def rates(qi, pi, qj, qf, pf):
    """Changes of velocities p = DT v: a = p_f - p_i, b = p_j - p_i, and what (31) leaves of b."""
    a, b = total((1, pf), (-1, pi)), total((2, qf), (-2, qi), (-1, pi), (-1, pf))  # (31), first
    return a, b, total((6, qj), (-6, qi), (1, a), (-ALPHA, b))  # (31), second


def ed(qi, pi, qj, qf, pf, dqj, dqf, dp):
    """Energy decaying, (28)-(32); in (30) p_h = <(1 - 2 tau) p> is zero for constant loads."""
    h, g = total((0.5, qi), (0.5, qj)), total((0.5, qj), (0.5, qf))  # (28)
    a, b, left = rates(qi, pi, qj, qf, pf)
    ei, ej, ef = strain(qi), strain(qj), strain(qf)
    ep, Np = ((x + y + ALPHA * (y - x)) / 2 for x, y in ((ei, ej), (qi[4], qj[4])))  # (32)
    row_f = inertia(a, dqf) + internal((ej + ef) / 2, g[4], slope(g, dqf)) - external(dqf)  # (29)
    row_f += held(g, values(qf), qf, dqf) + compatible(ef, qf[4], dqf[4])
    three = total((1, a), (3, b))  # (29) plus three times (30)
    row_j = inertia(three, dqj) + internal(ep, Np, slope(h, dqj)) - external(dqj)
    row_j += held(h, values(qj), qj, dqj) + compatible(ej, qj[4], dqj[4])
    # velocities jump by (31) as far as constraints allow: their impulses do no work on the jump
    return row_f + row_j + inertia(left, dp) + held(h, slopes(h, b), pf, dp)


def energy(q, p):  # K + V, eqs. (13), (11), with the potential of the weights
    return 0.5 * inertia(p, p) + 0.5 * internal(strain(q), q[4], strain(q)) - external(q)


def dissipation(qi, pi, qj, qf, pf):  # ALPHA c^2, eq. (34)
    b, e = rates(qi, pi, qj, qf, pf)[1], strain(qj) - strain(qi)
    return ALPHA / 2 * (inertia(b, b) + internal(e, qj[4] - qi[4], e))


def history(steps):
    """Displacements of the far corner and the arm's centre, K + V, ALPHA c^2; shape (steps, 8)."""
    space = fem.functionspace(domain, basix.ufl.mixed_element(STATE * 2 + STATE[:4]))
    known, unknown = fem.Function(space), fem.Function(space)  # (q_j, q_f, DT v_f) of two steps
    qs, us, ds = (ufl.split(f) for f in (known, unknown, ufl.TestFunction(space)))
    step = qs[5:10], qs[10:], us[:5], us[5:10], us[10:]
    residual = ed(*step, ds[:5], ds[5:10], ds[10:])
    quick = {"cffi_extra_compile_args": ["-O0"]}  # to compile
    accounts = [fem.form(f, jit_options=quick) for f in (energy(*step[3:]), dissipation(*step))]
    domain.topology.create_connectivity(2, 2)
    unused = [fem.locate_dofs_topological(space.sub(k), 2, rest) for k in (3, 8, 13)]  # one arm
    bcs = [fem.dirichletbc(fem.Function(space), dofs) for dofs in unused]
    problem = NewtonSolverNonlinearProblem(residual, unknown, bcs, jit_options=quick)
    newton = NewtonSolver(domain.comm, problem)
    newton.convergence_criterion, newton.rtol = "incremental", 1e-10
    newton.krylov_solver.getPC().setFactorSolverType("mumps")
    u, places = space.sub(5).collapse()
    far = np.linalg.norm(u.tabulate_dof_coordinates() - points[-1], axis=1).argmin()
    center = space.sub(8).dofmap.cell_dofs(first[0])[:3]
    seen = [*np.reshape(places, (-1, 3))[far], *center]
    rows = []
    for _ in range(steps):
        newton.solve(unknown)
        rows.append([*unknown.x.array[seen], *(fem.assemble_scalar(form) for form in accounts)])
        known.x.array[:] = unknown.x.array
    return np.array(rows)


if __name__ == "__main__":
    print(rows := history(20))
    assert np.abs(np.diff(rows[:, 6]) + rows[1:, 7]).max() < 1e-13  # (33), of K = 8 J
    assert abs(rows[-1, 2] / -1.566299596316e-01 - 1) < 1e-10
