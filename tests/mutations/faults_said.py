"""Faults of what is said: warnings, units, frequencies, pictures, summaries; as in `faults`."""

from .faults import Fault

NUMBERS = "tests/diagnostics/test_numbers.py"
BOUNDS = f"{NUMBERS}::test_bounds_are_where_they_are_said_to_be"
SENTENCES = f"{NUMBERS}::test_sentences_of_numbers_that_are_given"
UNITS = "tests/show/test_units.py"
CAMPBELL = f"{UNITS}::test_a_campbell_diagram_has_its_data"
HERTZ = "tests/rotating/test_hertz.py"
REMEMBERED = (
    "tests/run/test_what_is_remembered.py::test_a_run_that_went_on_says_what_the_whole_run_says"
)
WATCHES = "shellmb/diagnostics"
ACCOUNT = "shellmb/observers/account"

FAULTS: tuple[Fault, ...] = (
    # watches: bounds
    Fault(
        "earlier states of large systems are said to be unstable",
        "shellmb/diagnostics/statics.py",
        "self._first[1] < t:",
        "self._first[1] <= t:",
        ("tests/simulate/test_stability.py::test_large_systems_are_looked_at_once",),
    ),
    Fault(
        "a drift named by a rotation that cannot be its cause",
        "shellmb/diagnostics/balances.py",
        "ROTATION * largest**2 > drift else None",
        "ROTATION * largest**2 >= 0.0 else None",
        ("tests/diagnostics/test_false_alarms.py::test_rotation_is_not_named_where_nothing_turns",),
    ),
    Fault(
        "much dissipation is not said",
        f"{WATCHES}/balances.py",
        "DISSIPATED = 0.05",
        "DISSIPATED = 0.5",
        (f"{BOUNDS}[dissipation]",),
    ),
    Fault(
        "an account that is open is said to be closed",
        f"{WATCHES}/balances.py",
        "CLOSED = 1e-8",
        "CLOSED = 1e-6",
        (f"{BOUNDS}[account]",),
    ),
    Fault(
        "momenta that should be kept may drift as others do",
        f"{WATCHES}/balances.py",
        "CONSERVED if kind in simulation.scheme.conserves else OTHERS",
        "OTHERS",
        (f"{BOUNDS}[momentum]", f"{BOUNDS}[angular momentum]"),
    ),
    Fault(
        "round-off that decides is not said",
        f"{WATCHES}/unknown_forces.py",
        "KNOWN = 1e-6",
        "KNOWN = 1e-3",
        (f"{BOUNDS}[round-off]",),
    ),
    Fault(
        "forces that alternate are not said",
        f"{WATCHES}/unknown_forces.py",
        "SHARE = 0.1",
        "SHARE = 0.4",
        (f"{BOUNDS}[alternation]",),
    ),
    Fault(
        "friction that alternates beside a larger pressure is not said",
        f"{WATCHES}/unknown_forces.py",
        "SLIGHT = 1e-3",
        "SLIGHT = 0.5",
        (
            "tests/diagnostics/test_alternating.py"
            "::test_a_component_that_counts_is_compared_with_itself",
        ),
    ),
    Fault(
        "steps may turn bodies by twice what the paper's schemes follow",
        "shellmb/schemes/base.py",
        "LINEAR_PATH = Rotations(0.75)",
        "LINEAR_PATH = Rotations(1.5)",
        (f"{NUMBERS}::test_from_the_bound_of_turns_on_the_angle_is_five_per_cent_off[ep]",),
    ),
    # watches: numbers
    Fault(
        "the body that turns least is blamed",
        f"{WATCHES}/balances.py",
        "most = max(turns, key=",
        "most = min(turns, key=",
        (SENTENCES,),
    ),
    Fault(
        "a share of dissipation of itself",
        f"{WATCHES}/balances.py",
        "part = dissipated[worst] / sum(dissipated.values())",
        "part = dissipated[worst] / dissipated[worst]",
        (SENTENCES,),
    ),
    Fault(
        "the step that is advised is too long",
        f"{WATCHES}/steps.py",
        "dt = turn.dt * bound / turn.largest",
        "dt = turn.dt * turn.largest / bound",
        (f"{NUMBERS}::test_from_the_bound_of_turns_on_the_angle_is_five_per_cent_off[ep]",),
    ),
    Fault(
        "a stiff body loses a tenth of the spin that it loses",
        f"{ACCOUNT}/rotations.py",
        "self.stiff += mean**2 /",
        "self.stiff += mean**2 / 10 /",
        (f"{NUMBERS}::test_a_stiff_body_loses_the_spin_that_is_said",),
    ),
    Fault(
        "a point that flies through a ball is looked for at the end of its step",
        f"{WATCHES}/contacts.py",
        "group.penetrations(shape.nearest(start, end))",
        "group.penetrations(end)",
        (f"{NUMBERS}::test_how_deep_a_point_comes_within_a_step[0.2-0.6]",),
    ),
    Fault(
        "a wheel that is held down presses",
        f"{WATCHES}/contacts.py",
        "self._note(name, -mean, simulation.t)",
        "self._note(name, -mean / 2, simulation.t)",
        (f"{NUMBERS}::test_by_how_much_a_rolling_joint_pulls[0.4]",),
    ),
    Fault(
        "rotations of small displacements by their largest component only",
        f"{WATCHES}/small_displacements.py",
        "np.sum(change.reshape(-1, 3) ** 2, axis=1), initial=0.0)))",
        "np.sum(change.reshape(-1, 3) ** 2, axis=1), initial=0.0))) / 2",
        (f"{NUMBERS}::test_rotations_of_small_displacements[0.103]",),
    ),
    Fault(
        "forces along a linear body beside all of its energy twice",
        f"{WATCHES}/small_displacements.py",
        "name, left / bending, how",
        "name, left / bending / 2, how",
        (f"{NUMBERS}::test_forces_along_a_linear_body[0.3]",),
    ),
    Fault(
        "a spin beside a frequency, not their squares",
        f"{WATCHES}/small_displacements.py",
        "share = (spin / lowest) ** 2",
        "share = spin / lowest",
        (f"{NUMBERS}::test_spins_of_a_linear_body[0.09]",),
    ),
    # units
    Fault(
        "moments per length in newtons per metre",
        "shellmb/scene/units.py",
        '"moment per length": (1, 1, -2)',
        '"moment per length": (0, 1, -2)',
        (f"{UNITS}::test_quantities_have_their_units",),
    ),
    Fault(
        "bending moments are forces per length",
        "shellmb/scene/fields.py",
        '_kind("bending moments", "moment per length"',
        '_kind("bending moments", "force per length"',
        (f"{UNITS}::test_fields_and_probes_have_the_units_of_what_they_are",),
    ),
    Fault(
        "bending of probes in newtons per metre",
        "shellmb/show/plots.py",
        '"bending": "moment per length"',
        '"bending": "force per length"',
        (f"{UNITS}::test_axes_of_probes[False]",),
    ),
    Fault(
        "curvatures without a unit",
        "shellmb/scene/fields.py",
        'return "curvature" if any(',
        'return "number" if any(',
        (f"{UNITS}::test_strains_and_curvatures_have_units_of_their_own[2 kap 12-1/m]",),
    ),
    Fault(
        "torques of motors in newtons",
        "shellmb/show/plots.py",
        'label("torque", "moment")',
        'label("torque", "force")',
        (f"{UNITS}::test_axes_of_energies_steps_and_joints",),
    ),
    # frequencies and their picture
    Fault(
        "complex modes in radians under the name of hertz",
        "shellmb/running/rotating/modes.py",
        "return self.omega / (2 * np.pi)",
        "return self.omega",
        (f"{HERTZ}::test_modes_at_rates", f"{HERTZ}::test_modes_about_a_state_of_a_run"),
    ),
    Fault(
        "frequencies without damping",
        "shellmb/running/rotating/modes.py",
        "return np.asarray(self.values.imag)",
        "return np.abs(self.values)",
        (f"{HERTZ}::test_modes_at_rates",),
    ),
    Fault(
        "growth and frequency change places in the table",
        "shellmb/running/rotating/files.py",
        'modes.values.imag + 0.0,\n        "growth_per_s": modes.values.real + 0.0,',
        'modes.values.real + 0.0,\n        "growth_per_s": modes.values.imag + 0.0,',
        (f"{HERTZ}::test_modes_at_rates",),
    ),
    Fault(
        "lines of orders that are of radians",
        "shellmb/show/campbell.py",
        "end = order * last / (2 * math.pi)",
        "end = order * last / math.pi",
        (f"{CAMPBELL}[True]",),
    ),
    Fault(
        "branches of a Campbell diagram in one another's colour",
        "shellmb/show/campbell.py",
        "own = branches == branch",
        "own = branches >= branch",
        (f"{CAMPBELL}[False]",),
    ),
    # what is remembered
    Fault(
        "the largest error of the account is forgotten by a run that goes on",
        f"{ACCOUNT}/energy.py",
        '_SUMS = ("_values", "_error", ',
        '_SUMS = ("_values", ',
        (f"{REMEMBERED}[rigid]",),
    ),
    Fault(
        "what was put in is forgotten by a run that goes on",
        f"{ACCOUNT}/energy.py",
        '"_floor", "_there")',
        '"_floor")',
        (f"{REMEMBERED}[rigid]",),
    ),
    Fault(
        "the largest violation is forgotten by a run that goes on",
        f"{ACCOUNT}/constraints.py",
        'remembered = ("_director_max", "_constraint_max", ',
        'remembered = ("_director_max", ',
        ("tests/run/test_what_is_remembered.py::test_the_largest_violations_are_remembered",),
    ),
    Fault(
        "a step that was not finished counts in what is remembered",
        "shellmb/restart.py",
        "return _copied(_values(value)) if is_dataclass(value) else value",
        "return vars(value) if is_dataclass(value) else value",
        (f"{REMEMBERED}[stiff]",),
    ),
    Fault(
        "the lost spin is forgotten by a run that goes on",
        f"{ACCOUNT}/rotations.py",
        "Turn(**values) for",
        'Turn(**values | {"stiff": 0.0}) for',
        (f"{REMEMBERED}[stiff]",),
    ),
    Fault(
        "an event that has gone off goes off again in a run that goes on",
        "shellmb/simulate/control/items.py",
        'remembered = ("times", "armed")',
        'remembered = ("times",)',
        ("tests/run/test_what_is_remembered.py::test_events_stay_as_they_were",),
    ),
    Fault(
        "folds that come and go are not said",
        f"{WATCHES}/base.py",
        "EVERY = 10",
        "EVERY = 10_000",
        ("tests/diagnostics/test_folded.py::test_a_fold_that_comes_and_goes",),
    ),
    Fault(
        "bodies that spin near their lowest frequency are not looked at",
        f"{WATCHES}/small_displacements.py",
        "CANTILEVER = 3.516",
        "CANTILEVER = 35.16",
        (f"{NUMBERS}::test_spins_of_a_linear_body[0.12]",),
    ),
    Fault(
        "half of an error is drawn",
        "shellmb/show/plots.py",
        "y - error, y + error",
        "y - error / 2, y + error / 2",
        (f"{UNITS}::test_bands_reach_by_an_error_to_both_sides",),
    ),
)
