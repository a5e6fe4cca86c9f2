"""Faults in what solves: schemes, supports, the system; as in `faults`."""

from .faults import ACCURACY, PRESCRIBED, SUPPORTS, Fault

ENDS = "tests/schemes/test_end_forces.py"

FAULTS: tuple[Fault, ...] = (
    # schemes
    Fault(
        "state j of prescribed dofs on the wrong side",
        "shellmb/schemes/ed.py",
        "return start - dt * moved_to_j(a, b, 0, self.alpha)",
        "return start + dt * moved_to_j(a, b, 0, self.alpha)",
        (f"{PRESCRIBED}[ed-1-plate]", f"{PRESCRIBED}[ed-0-plate]"),
    ),
    Fault(
        "dissipation of prescribed dofs with the wrong sign",
        "shellmb/schemes/ed.py",
        "return start - dt * moved_to_j(a, b, 0, self.alpha)",
        "return start - dt * moved_to_j(a, -b, 0, self.alpha)",
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
    Fault(
        "forces at the end without the constraints' own acceleration",
        "shellmb/simulate/start/endforces.py",
        "turned = None if rate is None else ufl.derivative(rate, q, v)",
        "turned = None if rate is None else -ufl.derivative(rate, q, v)",
        (f"{ENDS}::test_forces_of_a_pendulum_have_the_order_of_the_scheme[ep-0]",),
    ),
    Fault(
        "forces at the end from velocities that violate constraints",
        "shellmb/simulate/start/consistent.py",
        "found[name][dofs] = unknown.x.array[dofs]",
        "found[name][dofs] = self._levels[name].rates['v'].x.array[dofs]",
        (f"{ENDS}::test_torque_of_the_slider_crank_at_the_end_of_a_step[ep]",),
    ),
    Fault(
        "moment of a quadratic step's forces without their first moment in time",
        "shellmb/observers/forces/reactions.py",
        "carrier.resultants(arms.of(steps), whole,",
        "carrier.resultants(arms.of(steps) * float(self._first), whole,",
        (
            "tests/hard/test_spins.py::test_stiff_plate_spins_in_schemes_quadratic_in_time"
            "[True-ep4-0.0]",
        ),
    ),
    Fault(
        "resultants of ED at the end of a step",
        "shellmb/observers/fields/resultants.py",
        "return self.at_nodes(self._expressions[-1])",
        "return self.at_nodes(self._expressions[0])",
        ("tests/hard/test_spins.py::test_a_driven_plate_pulls_as_it_should[ed-1.0-None]",),
    ),
    # supports
    Fault(
        "driven edges that turn the other way",
        "shellmb/model/supports/supports.py",
        "return np.sin(angle) * cross +",
        "return -np.sin(angle) * cross +",
        (f"{SUPPORTS}::test_a_driven_edge_goes_where_it_is_told",),
    ),
    Fault(
        "driven edges that leave their directors",
        "shellmb/model/supports/supports.py",
        "lambda t: turned(nodes.director, t).ravel())",
        "lambda t: 0 * turned(nodes.director, t).ravel())",
        (f"{SUPPORTS}::test_a_driven_edge_goes_where_it_is_told",),
    ),
    # the system
    Fault(
        "a border that is left with the wrong sign",
        "shellmb/system/newton/bordered.py",
        "missing = given - self.dot(normal, system.x.array_r)",
        "missing = given + self.dot(normal, system.x.array_r)",
        ("tests/simulate/test_arclength.py::test_a_truss_goes_through_both_limit_points",),
    ),
    Fault(
        "pivots of one sign only",
        "shellmb/system/direct/mumps.py",
        "return int(self._symmetric.getFactorMatrix().getInertia()[0])",
        "return int(self._symmetric.getFactorMatrix().getInertia()[2])",
        ("tests/system/test_inertia.py::test_negative_eigenvalues",),
    ),
    Fault(
        "factorisations kept when they do not pay",
        "shellmb/system/newton/refactorisation.py",
        "self._wanted = left > min(self._cost, PATIENCE) + AFRESH",
        "self._wanted = left < min(self._cost, PATIENCE) + AFRESH",
        ("tests/system/test_refresh.py::test_costly_factorisations_are_kept_for_longer",),
    ),
    Fault(
        "one update of a linear system with given values that still change",
        "shellmb/system/newton/iteration.py",
        "x.array[self.system.fixed] = self.system.fixed_values()",
        "x.array[self.system.fixed] += 0.0",
        ("tests/simulate/test_linear_dynamics.py::test_a_small_drive",),
    ),
    Fault(
        "reactions of the first guess",
        "shellmb/system/newton/iteration.py",
        "        # reactions are those of the solution\n        self.residual(x, b)",
        "        # reactions are those of the solution\n",
        ("tests/simulate/test_linear_dynamics.py::test_a_small_drive",),
    ),
    Fault(
        "jumps of partly held directors that keep what is not tangent",
        "shellmb/system/nullspace/directornodes.py",
        "return self._jump_correction(fields) if self.partial else None",
        "return None",
        (
            "tests/mechanisms/test_partly_held.py::"
            "test_jumps_of_partly_held_directors_do_no_work[0.5]",
        ),
    ),
)
