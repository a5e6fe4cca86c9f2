"""Faults of reports of joints, watches, decks, modes about states and paths; as in `faults`."""

from .faults import Fault

DECKS = "tests/meshes/test_deck_details.py"

FAULTS: tuple[Fault, ...] = (
    Fault(
        "the length of directors that lean is taken away twice",
        "forms/floating/strains.py",
        "strains(a.here, b.frame) + kept * lengths",
        "strains(a.here, b.frame) - kept * lengths",
        ("tests/forms/test_floating.py::test_directors_that_lean_in_a_tube",),
    ),
    Fault(
        "dissipation of potentials goes by the size of motions",
        "forms/steps/potentials.py",
        "ufl.sqrt(ufl.dot(change, change) * ufl.dot(motion, motion) + 1e-60)",
        "ufl.sqrt(ufl.dot(change, change) + ufl.dot(motion, motion) + 1e-60)",
        (
            "tests/forms/test_discrete.py::"
            "test_what_dissipates_is_scaled_down_where_it_would_gain[0.05-0.5]",
        ),
    ),
    Fault(
        "impacts of six steps are too short",
        "shellmb/diagnostics/contacts.py",
        "SUDDEN = 0.8",
        "SUDDEN = 0.5",
        ("tests/diagnostics/test_watched_numbers.py::test_impacts_of_a_linear_spring[4.5-False]",),
    ),
    Fault(
        "pulls of joints are sums of two steps",
        "shellmb/diagnostics/contacts.py",
        "(force + self._last.get(name, force)) / 2",
        "(force + self._last.get(name, force))",
        (
            "tests/diagnostics/test_watched_numbers.py::"
            "test_joints_that_pull_in_the_mean_of_two_steps[forces2-1.0]",
        ),
    ),
    Fault(
        "nodes lie on sides from twice as far",
        "shellmb/meshes/files/joined.py",
        "NEAR = 1e-2",
        "NEAR = 2e-2",
        (
            "tests/meshes/test_gaps.py::"
            "test_nodes_lie_on_sides_within_a_hundredth_of_the_shorter[1.0-0.0065-False]",
        ),
    ),
    Fault(
        "axes of joints are those of the end of a step",
        "shellmb/observers/forces/joints.py",
        "for q in (at.start, at.end)))",
        "for q in (at.end, at.end)))",
        (
            "tests/mechanisms/test_joint_momenta.py::"
            "test_what_a_joint_exerts_is_what_its_body_gains[ep-None-1e-12]",
        ),
    ),
    Fault(
        "moments of joints miss how forces change in a step",
        "shellmb/observers/forces/joints.py",
        "        if first is not None:",
        "        if first is None:",
        (
            "tests/mechanisms/test_joint_momenta.py::"
            "test_what_a_joint_exerts_is_what_its_body_gains[ep4-None-0.0004]",
        ),
    ),
    Fault(
        "friction is taken where what rolls slips along its path",
        "shellmb/schemes/quadratic.py",
        "root = (self.alpha**2 + 3) ** 0.5",
        "root = (self.alpha**2 + 5) ** 0.5",
        ("tests/contact/test_friction.py::test_nothing_slips_where_a_ball_rolls[0.24-ep4-0.0]",),
    ),
    Fault(
        "impulses of impacts stay in the history",
        "shellmb/observers/forces/endforces.py",
        "        if not self._new:",
        "        if self._new:",
        ("tests/mechanisms/test_joint_momenta.py::test_locks_tell_their_impulses[ep]",),
    ),
    Fault(
        "instances of Abaqus stay where their part is",
        "shellmb/meshes/files/abaqus.py",
        "    if moved:\n",
        "    if not moved:\n",
        (f"{DECKS}::test_instances_are_where_the_file_says[translated]",),
    ),
    Fault(
        "instances of Abaqus are turned before they are translated",
        "shellmb/meshes/files/abaqus.py",
        "apply(x - a)",
        "apply(x)",
        (f"{DECKS}::test_instances_are_where_the_file_says[about a line apart]",),
    ),
    Fault(
        "instances of Abaqus turn the other way round",
        "shellmb/meshes/files/abaqus.py",
        "axis = (b - a) /",
        "axis = (a - b) /",
        (f"{DECKS}::test_instances_are_where_the_file_says[turned]",),
    ),
    Fault(
        "instances of Abaqus are translated the other way",
        "shellmb/meshes/files/abaqus.py",
        "x = x + np.array(moved[0][:3])",
        "x = x - np.array(moved[0][:3])",
        (f"{DECKS}::test_instances_are_where_the_file_says[both]",),
    ),
    Fault(
        "a strain of one's own without its value at rest",
        "forms/steps/path.py",
        "parts.append(m.linear[0] * measure.rest(states[0]))",
        "pass",
        (
            "tests/api/test_motion.py::"
            "test_a_strain_that_is_not_zero_at_rest_is_a_prestrain[ep4-0.0]",
        ),
    ),
    Fault(
        "edge hinges that hold what others hold",
        "shellmb/preprocessing/constraint_analysis/redundancy.py",
        "            left += held",
        "            pass",
        (
            "tests/mechanisms/test_redundant_hinges.py::"
            "test_hinges_that_hold_the_same_are_redundant[equal-1]",
        ),
    ),
)
