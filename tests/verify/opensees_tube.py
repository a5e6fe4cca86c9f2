"""The short cylinder of `demos/short_cylinder.py` in OpenSees: corotational quads, Newmark.

    python -m tests.verify.opensees_tube > demos/references/data/short_cylinder.csv

Nothing of shellmb is used. Its momenta at 1.4 s are (5.008, 0, 0) and (70.89, 8.84, -36.77), by the
velocities of the nodes; the impulse of the forces is (5, 0, 0).
"""

import numpy as np

RADIUS, HEIGHT = 7.5, 3.0
SECTION = (2e8, 0.25, 0.02, 1.0)
AROUND, ALONG, DT, STEPS, EVERY = 32, 2, 0.01, 140, 5
# of increments, m and rad
TOLERANCE = 1e-5
# names, places by node around and along, and directions of the forces
FORCES = {
    "A": (3 * AROUND // 4, 0, (0.0, -1.0, -1.0)),
    "B": (AROUND // 4, 0, (1.0, 1.0, 1.0)),
    "C": (AROUND // 4, ALONG, (1.0, 1.0, 1.0)),
    "D": (3 * AROUND // 4, ALONG, (0.0, -1.0, -1.0)),
}


def tag(i: int, j: int) -> int:
    """Number of a node."""
    return 1 + j * AROUND + i % AROUND


def motion() -> np.ndarray:
    """Time and displacements of A, B, C, D, shape (rows, 13)."""
    import openseespy.opensees as ops

    ops.wipe()
    ops.model("basic", "-ndm", 3, "-ndf", 6)
    ops.section("ElasticMembranePlateSection", 1, *SECTION)
    for j in range(ALONG + 1):
        for i in range(AROUND):
            a = 2 * np.pi * i / AROUND
            x, y = RADIUS * np.cos(a), RADIUS * np.sin(a)
            ops.node(tag(i, j), float(x), float(y), HEIGHT * j / ALONG)
    for j in range(ALONG):
        for i in range(AROUND):
            nodes = (tag(i, j), tag(i + 1, j), tag(i + 1, j + 1), tag(i, j + 1))
            ops.element("ASDShellQ4", 1 + j * AROUND + i, *nodes, 1, "-corotational")
    ops.timeSeries("Path", 1, "-time", 0.0, 0.5, 1.0, 1e3, "-values", 0.0, 5.0, 0.0, 0.0)
    ops.pattern("Plain", 1, 1)
    for i, j, force in FORCES.values():
        ops.load(tag(i, j), *force, 0.0, 0.0, 0.0)
    ops.constraints("Plain")
    ops.numberer("RCM")
    ops.system("UmfPack")
    ops.test("NormDispIncr", TOLERANCE, 50, 0)
    ops.algorithm("Newton")
    ops.integrator("Newmark", 0.5, 0.25)
    ops.analysis("Transient", "-noWarnings")
    rows = [[0.0] * 13]
    for _ in range(STEPS):
        assert ops.analyze(1, DT) == 0, f"Newton's method does not converge at {ops.getTime()} s"
        moved = [ops.nodeDisp(tag(i, j), k) for i, j, _ in FORCES.values() for k in (1, 2, 3)]
        rows.append([ops.getTime(), *moved])
    return np.array(rows)


def table(rows: np.ndarray) -> str:
    """The table, first its comment lines."""
    lines = [
        "# Short cylinder, thrown by four forces: displacements (m) of the loaded points over time "
        "(s). R = 7.5, H = 3, h = 0.02,",
        "# E = 2e8, nu = 0.25, rho = 1; forces as in demos/short_cylinder.py. Computed by OpenSees "
        "3.7.1.2, ASDShellQ4 -corotational,",
        "# 32x2, Newmark (1/2, 1/4), dt = 0.01 s (tests/verify/opensees_tube.py).",
        "t_s," + ",".join(f"{name}_u{axis}" for name in FORCES for axis in "xyz"),
    ]
    lines += [f"{row[0]:.2f}," + ",".join(f"{u:.6e}" for u in row[1:]) for row in rows[::EVERY]]
    return "\n".join(lines)


if __name__ == "__main__":
    print(table(motion()))
