"""Faults in what solves: schemes, supports, the system; as in `faults`."""

from .faults import ACCURACY, PRESCRIBED, SUPPORTS, Fault

FAULTS: tuple[Fault, ...] = (
    # schemes
    Fault(
        "state j of prescribed dofs on the wrong side",
        "shellmb/schemes/ed.py",
        "return start - dt * (a - self.alpha * b) / 6",
        "return start + dt * (a - self.alpha * b) / 6",
        (f"{PRESCRIBED}[ed-1-plate]", f"{PRESCRIBED}[ed-0-plate]"),
    ),
    Fault(
        "dissipation of prescribed dofs with the wrong sign",
        "shellmb/schemes/ed.py",
        "return start - dt * (a - self.alpha * b) / 6",
        "return start - dt * (a + self.alpha * b) / 6",
        (f"{PRESCRIBED}[ed-1-plate]",),
    ),
    Fault(
        "jump of velocities of prescribed dofs with the wrong sign",
        "shellmb/schemes/ed.py",
        "b = 2 * (end - start) / dt - 2 * v - a",
        "b = 2 * (end - start) / dt - 2 * v + a",
        (f"{PRESCRIBED}[ed-1-joint]", f"{PRESCRIBED}[ed-1-plate]"),
    ),
    Fault(
        "loads of row j as those of row f",
        "shellmb/schemes/ed.py",
        'return 1.0 if stage == "f" else 4.0 - 6.0 * tau',
        "return 1.0",
        (f"{ACCURACY}::test_order[ed-1]",),
    ),
    # supports
    Fault(
        "driven edges that turn the other way",
        "shellmb/model/supports.py",
        "return np.sin(angle) * cross +",
        "return -np.sin(angle) * cross +",
        (f"{SUPPORTS}::test_a_driven_edge_goes_where_it_is_told",),
    ),
    Fault(
        "driven edges that leave their directors",
        "shellmb/model/supports.py",
        "lambda t: turned(nodes.director, t).ravel())",
        "lambda t: 0 * turned(nodes.director, t).ravel())",
        (f"{SUPPORTS}::test_a_driven_edge_goes_where_it_is_told",),
    ),
    # the system
    Fault(
        "a border that is left with the wrong sign",
        "shellmb/system/bordered.py",
        "missing = given - self.dot(normal, system.x.array_r)",
        "missing = given + self.dot(normal, system.x.array_r)",
        ("tests/simulate/test_arclength.py::test_a_truss_goes_through_both_limit_points",),
    ),
    Fault(
        "pivots of one sign only",
        "shellmb/system/inertia.py",
        "return int(self._pc.getFactorMatrix().getInertia()[0])",
        "return int(self._pc.getFactorMatrix().getInertia()[2])",
        ("tests/system/test_inertia.py::test_negative_eigenvalues",),
    ),
    Fault(
        "factorisations kept when they do not pay",
        "shellmb/system/refresh.py",
        "self._wanted = left > self._cost + AFRESH",
        "self._wanted = left < self._cost + AFRESH",
        ("tests/system/test_refresh.py::test_costly_factorisations_are_kept_for_longer",),
    ),
)
