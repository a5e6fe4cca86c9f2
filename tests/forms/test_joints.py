"""The constraints of all kinds of joints: exact discrete gradient, tangent, invariance."""

from mpi4py import MPI

import numpy as np
import pytest
import ufl
from dolfinx import fem

from shellmb.forms.constraints.joints import KINDS
from shellmb.forms.steps.mixed import Interval
from shellmb.model.joints.joints import BoundJoint, JointGroup
from shellmb.model.locations.ends import End, frame_about
from shellmb.model.massless import Scale
from shellmb.scene import Spherical
from shellmb.schemes.residuals.residual import interval_forces, velocity_constraint
from tests.forms.conftest import compiled

FORCE = 3.0


def random_rotation(rng: np.random.Generator) -> np.ndarray:
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else -q


def make_end(rng: np.random.Generator, directors: int, offset: float) -> End:
    frame = random_rotation(rng)
    node = rng.normal(size=3)
    dofs = {"u": np.arange(3), "w": np.arange(3 * directors)}
    point = node + offset * rng.normal(size=3) * (directors == 3)
    return End("body", "body", dofs, node, frame[:directors], point)


def make_group(kind: str, offset: float = 0.3) -> JointGroup:
    """Two joints of a kind between two places in general position."""
    rng = np.random.default_rng(7)
    joints = []
    for number in range(2):
        second = 1 if kind == "shell revolute" else 3
        ends = (make_end(rng, 3, offset), make_end(rng, second, offset))
        axes = np.array([frame_about(rng.normal(size=3)), frame_about(rng.normal(size=3))])
        described = Spherical(f"joint {number}", "a", "b")
        joints.append(BoundJoint(described, kind, ends, axes, 0.8))
    return JointGroup(Scale(MPI.COMM_SELF, FORCE, 1.0), joints, False)


def random_state(group: JointGroup, seed: int) -> fem.Function:
    q = fem.Function(group.mixed.space)
    q.x.array[:] = np.random.default_rng(seed).normal(size=len(q.x.array))
    return q


def values_of(group: JointGroup, q: fem.Function) -> np.ndarray:
    """Values of the constraints, one row per joint."""
    return group.violations_at(q.x.array[None])[0]


def rows(group: JointGroup, form: ufl.Form) -> np.ndarray:
    """Entries of a residual at the multipliers, one row per joint."""
    vector = fem.assemble_vector(compiled(form)).array / FORCE
    return vector[group.mixed.dofs["mu"]].reshape(-1, group.count)


@pytest.mark.parametrize("kind", KINDS)
def test_mid_point_gradient_is_exact(kind):
    """g(b) - g(a) = Dg(m)[b - a]: constraint forces do no work, and there is no drift."""
    group = make_group(kind)
    a, b = random_state(group, 1), random_state(group, 2)
    test = ufl.TestFunction(group.mixed.space)
    work = rows(group, velocity_constraint(group, b - a, (a + b) / 2, test))
    change = values_of(group, b) - values_of(group, a)
    # random states of order one, sums of some ten products
    assert np.allclose(work, change, atol=1e-13)
    assert np.max(np.abs(change)) > 0.1


@pytest.mark.parametrize("kind", KINDS)
def test_tangent_of_the_residual(kind):
    """The Jacobian that the system assembles against a central difference of the residual."""
    group = make_group(kind)
    a, b, d = (random_state(group, seed) for seed in (3, 4, 5))
    span = Interval(a=a, b=b, mid=(a + b) / 2, unknown=b, beta=0.0)
    test, trial = ufl.TestFunction(group.mixed.space), ufl.TrialFunction(group.mixed.space)
    residual = interval_forces(group, span, test)
    tangent = fem.assemble_matrix(compiled(ufl.derivative(residual, b, trial))).to_dense()
    form, step, start = compiled(residual), 1e-4, b.x.array.copy()

    def at(s: float) -> np.ndarray:
        b.x.array[:] = start + s * d.x.array
        return fem.assemble_vector(form).array

    difference = (at(step) - at(-step)) / (2 * step)
    # cubic at most: the difference errs by step^2 times a third derivative of order one
    assert np.allclose(tangent @ d.x.array, difference, atol=1e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_rigid_motion_changes_nothing(kind):
    """Moving both bodies together leaves each constraint as it is; a gap turns with them."""
    group = make_group(kind)
    q, moved = random_state(group, 6), random_state(group, 6)
    rng = np.random.default_rng(8)
    R, c = random_rotation(rng), rng.normal(size=3)
    for end in group.ends:
        for tag, source in (("u", "node"), ("w", "directors")):
            dofs = group.mixed.dofs[f"{tag}{end.tag}"] if f"{tag}{end.tag}" in end.parts else []
            if not len(dofs):
                continue
            values = q.x.array[dofs].reshape(len(end.ends), -1, 3)
            for k, place in enumerate(end.ends):
                reference = getattr(place, source).reshape(-1, 3)
                turned = (reference + values[k]) @ R.T + (c if tag == "u" else 0)
                values[k] = turned - reference
            moved.x.array[dofs] = values.ravel()
    before, after = values_of(group, q), values_of(group, moved)
    together = KINDS[kind].rows >= 3 and kind not in ("cylindrical", "prismatic", "planar")
    scalars = slice(3, None) if together else slice(None)
    assert np.allclose(before[:, scalars], after[:, scalars], atol=1e-12)
    if together:
        assert np.allclose(after[:, :3], before[:, :3] @ R.T, atol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_reference_configuration_is_closed(kind):
    """With both places at one point and one frame (a universal's axes crossed) nothing is off."""
    rng = np.random.default_rng(9)
    point, first = rng.normal(size=3), frame_about(rng.normal(size=3))
    second = frame_about(first[0]) if kind == "universal" else first
    ends = []
    for k in range(2):
        shell = kind == "shell revolute" and k == 1
        directors = first[2:] if shell else random_rotation(rng)
        node = point if shell else rng.normal(size=3)
        away = 0.8 * first[0] if kind.endswith("distance") and k == 1 else 0.0
        dofs = {"u": np.arange(3), "w": np.arange(directors.size)}
        ends.append(End("body", "body", dofs, node, directors, point + away))
    described = Spherical("joint", "a", "b")
    joint = BoundJoint(described, kind, (ends[0], ends[1]), np.array([first, second]), 0.8)
    group = JointGroup(Scale(MPI.COMM_SELF, FORCE, 1.0), [joint], False)
    # the directors come from a QR factorisation, orthonormal to some round-offs
    assert np.max(np.abs(values_of(group, fem.Function(group.mixed.space)))) < 1e-14


# motions of the second place that a joint leaves free, along and about `e1, e2, e3` of the first;
# a universal joint turns about its own `e3'`, which is the first place's `e1` here, and its `e3`
TURNS = {"rx", "ry", "rz"}
FREE = {
    "spherical": TURNS,
    "revolute": {"rz"},
    "universal": {"rx", "rz"},
    "cylindrical": {"tz", "rz"},
    "prismatic": {"tz"},
    "planar": {"tx", "ty", "rz"},
    "weld": set(),
    "distance": {"ty", "tz", *TURNS},
    "given distance": {"ty", "tz", *TURNS},
    "in-plane": {"tx", "ty", *TURNS},
    "fixed point": TURNS,
    "shell revolute": {"rz"},
}


@pytest.mark.parametrize("kind", KINDS)
def test_a_joint_leaves_its_freedoms_and_no_others(kind):
    """Two equal rows hold one motion, and leave one free that the joint is there to hold."""
    first = frame_about(np.random.default_rng(11).normal(size=3))
    second = first[[1, 2, 0]] if kind == "universal" else first
    directors = (np.eye(3), first[2:] if kind == "shell revolute" else np.eye(3))
    point = np.zeros(3)
    away = 0.8 * first[0] if kind.endswith("distance") else 0.0
    dofs = [{"u": np.arange(3), "w": np.arange(d.size)} for d in directors]
    ends = tuple(
        End("body", "body", dofs[k], point + k * away, d, point + k * away)
        for k, d in enumerate(directors)
    )
    joint = BoundJoint(Spherical("joint", "a", "b"), kind, ends, np.array([first, second]), 0.8)
    group = JointGroup(Scale(MPI.COMM_SELF, FORCE, 1.0), [joint], False)
    closed, motion = (fem.Function(group.mixed.space) for _ in range(2))
    test = ufl.TestFunction(group.mixed.space)
    moved = compiled(velocity_constraint(group, motion, closed, test))
    rates = {}
    for name in ("tx", "ty", "tz", "rx", "ry", "rz"):
        axis = first["xyz".index(name[1])]
        motion.x.array[:] = 0.0
        for tag in ("u2", "w2"):
            if tag not in group.mixed.dofs:
                continue
            if name[0] == "t":
                change = axis if tag == "u2" else 0.0
            else:
                change = 0.0 if tag == "u2" else np.cross(axis, directors[1]).ravel()
            motion.x.array[group.mixed.dofs[tag]] = change
        vector = fem.assemble_vector(moved).array / FORCE
        rates[name] = vector[group.mixed.dofs["mu"]]
    free = {name for name, rate in rates.items() if np.abs(rate).max() < 1e-14}
    assert free == FREE[kind]
    held = np.array([rate for name, rate in rates.items() if name not in free])
    # every row holds something, and no two the same
    assert np.linalg.matrix_rank(held) == len(held) == KINDS[kind].rows == 6 - len(free)
