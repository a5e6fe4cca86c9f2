"""Faults of where things are attached and looked at from; as in `faults`."""

from .faults import Fault

OFFSETS = "tests/mechanisms/test_offsets.py"

FAULTS: tuple[Fault, ...] = (
    Fault(
        "an arm at a shell's node of twice its length",
        "shellmb/model/locations/ends.py",
        "x = x + data[6] * w",
        "x = x + 2 * data[6] * w",
        (f"{OFFSETS}::test_force_at_an_arm_is_a_force_and_a_moment",),
    ),
    Fault(
        "hinges on a face that hold the mid-surface",
        "shellmb/model/supports/prescribed.py",
        "moved = sum((data[3 + k] * vector for k, vector in enumerate(added)), start=first)",
        "moved = first",
        (f"{OFFSETS}::test_strip_on_hinges_at_its_lower_face_is_an_arch",),
    ),
    Fault(
        "moments of welds along areas about the middle of the body",
        "shellmb/model/joints/joints.py",
        "about=frame.point",
        "about=frame.node",
        ("tests/model/test_areas.py::test_clamped_strip_leaves_a_shorter_plate[quad]",),
    ),
    Fault(
        "moments on directors that are short between two states",
        "forms/loads.py",
        "dd) / ufl.dot(d, d)",
        "dd)",
        (
            "tests/simulate/test_point_moments.py::"
            "test_free_strip_gets_the_impulse_and_the_work[ep-0.0]",
        ),
    ),
    Fault(
        "velocities in a frame without its rotation",
        "shellmb/observers/probes.py",
        "return along(d, point.v - frame.v) + along(frame.rate, R + moved)",
        "return along(d, point.v - frame.v)",
        ("tests/observers/test_frames_of_probes.py::test_rates_are_those_of_the_values",),
    ),
    Fault(
        "friction at the centre of a ball that rolls",
        "forms/contact.py",
        "return motion - arm * ufl.cross(turn(directors, changes), normal)",
        "return motion",
        ("tests/contact/test_friction.py::test_a_ball_rolls_down",),
    ),
    Fault(
        "friction on an obstacle that moves sees its point and not how it turns",
        "forms/contact.py",
        "return sum((part * change for part, change in zip(y, changes, strict=True)), start=moved)",
        "return moved",
        (
            "tests/contact/test_moving.py::test_friction_and_damping_are_between_the_bodies[0.0-ep-0.0]",
        ),
    ),
    Fault(
        "forces of contact without what Gauss points lack of the energy",
        "forms/steps/potentials.py",
        "return first + ratio * e.chord, second + ratio * e.bow",
        "return first, second",
        ("tests/contact/test_bounce.py::test_a_ball_bounces_with_restitution_one[ep4-0.0]",),
    ),
)
