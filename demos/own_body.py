"""Bodies of one's own: a block of rubber and a chain of point masses, by every scheme.

A body is what it is made of, in UFL: measures with an energy or a stiffness, mass, forces, and
constraints. How it moves is the schemes' concern (`docs/tutorials/own_body.md`). The file is no
scene: run it by

    python -m shellmb.demos.own_body
"""

# CI: python -m shellmb.demos.own_body

from mpi4py import MPI

import basix.ufl
import numpy as np
import ufl
from dolfinx import fem, mesh
from ufl import as_vector, dot, grad

import shellmb as sm

SCHEMES = (("ep", 0.0), ("ed", 0.5), ("ep4", 0.0), ("ed3", 0.5))


def block():
    """Rubber, 1 m long, clamped at one end: Green's strain, an energy that stiffens."""
    size = ((0.0, 0.0, 0.0), (1.0, 0.25, 0.25))
    domain = mesh.create_box(MPI.COMM_WORLD, size, (4, 1, 1), mesh.CellType.hexahedron)
    space = fem.functionspace(domain, ("Lagrange", 1, (3,)))

    def strain(u):
        G = (grad(u) + grad(u).T + grad(u).T * grad(u)) / 2
        return as_vector([G[0, 0], G[1, 1], G[2, 2], G[0, 1], G[0, 2], G[1, 2]])

    def energy(e):
        volume, square = e[0] + e[1] + e[2], dot(e, e) + e[3] ** 2 + e[4] ** 2 + e[5] ** 2
        return 4e5 * (volume**2 / 2 + square / 2 + square**2)

    def mass(v, w):
        return 1e3 * dot(v, w)

    body = sm.OwnBody("block", space, strain=strain, energy=energy, mass=mass)
    body.hold(lambda x: np.isclose(x[0], 0.0))
    return body


def swing(scheme, alpha, dt=2e-3, steps=50):
    """The block, which begins to move across."""
    motion = sm.Motion(block(), scheme=scheme, alpha=alpha, dt=dt)
    motion.take("block", v=lambda x: np.array([0 * x[0], x[0] ** 2, 3 * x[0] ** 2]))
    motion.step(steps)
    return motion


LENGTH, GRAVITY = 0.5, 9.81


def chain(count=3):
    """Masses of 1 kg, hung on one another: the first rod is stiff, the others are springs."""
    domain = mesh.create_interval(MPI.COMM_SELF, 1, (0.0, 1.0))
    space = fem.functionspace(domain, ("DG", 0, (3 * count,)))
    rest = [as_vector([LENGTH, 0, 0])] * count

    def links(u):
        """From each mass to the next one."""
        at = [as_vector([u[3 * k], u[3 * k + 1], u[3 * k + 2]]) for k in range(count)]
        return [rest[k] + at[k] - (at[k - 1] if k else 0 * at[k]) for k in range(count)]

    def strain(u):
        return as_vector([(dot(r, r) / LENGTH**2 - 1) / 2 for r in links(u)[1:]])

    def weight(u, rate, du, time):
        return -GRAVITY * sum(du[3 * k + 2] for k in range(count))

    def rod(u):
        return (dot(links(u)[0], links(u)[0]) / LENGTH**2 - 1) / 2

    point = basix.ufl.element("DG", "interval", 0)
    held = sm.Hold(rod, point, ufl.dx, force=10.0)
    stiffness = 200 * np.eye(count - 1)
    make = {"strain": strain, "energy": stiffness, "mass": dot, "force": weight}
    return sm.OwnBody("chain", space, constraints=[held], size=LENGTH, **make)


def fall(scheme, alpha, dt=1e-2, steps=100):
    """The chain, which falls from a horizontal line."""
    motion = sm.Motion(chain(), scheme=scheme, alpha=alpha, dt=dt)
    motion.step(steps)
    return motion


if __name__ == "__main__":
    print(f"{'':14}{'total energy':>14}{'dissipated':>12}{'account':>10}{'held to':>10}")
    for run in (swing, fall):
        for scheme, alpha in SCHEMES:
            motion = run(scheme, alpha)
            e = motion.energies
            size = max(e["kinetic_energy"], abs(e["work_terms"]))
            account = abs(e["energy_balance"]) / size
            said = f"{e['total_energy']:14.5f}{e['dissipation']:12.2e}{account:10.0e}"
            print(f"{run.__name__:8}{scheme:6}{said}{motion.violation:10.0e}")
            assert account < 1e-12
            assert motion.violation < 1e-10
