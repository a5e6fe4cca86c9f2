"""Tolerances of the step control in a study, beside fixed steps."""

from shellmb.accuracy.studies.choice import Base, Choice
from shellmb.accuracy.studies.points import Point, credited
from shellmb.accuracy.studies.sweep import Sweep, chain, make_grid

TOLERANCES, STEPS = (1e-2, 1e-3), (1e-2, 5e-3)


def test_tolerances_stand_beside_steps() -> None:
    """Not for each of them; the reference has fixed steps, twice as fine as the finest one."""
    sweep = Sweep(Base("sudden_load"), scheme=("ep",), dt=STEPS, step_error=TOLERANCES)
    grid = make_grid(sweep)
    kinds = {(c.dt if c.step_error is None else None, c.step_error) for c in grid.choices}
    assert kinds == {(1e-2, None), (5e-3, None), (None, 1e-2), (None, 1e-3)}
    assert [(c.dt, c.step_error) for c in chain(sweep, grid)] == [
        (2.5e-3, None),
        (5e-3, None),
        (1e-2, None),
    ]


def test_without_steps_the_reference_has_a_finer_tolerance() -> None:
    sweep = Sweep(Base("sudden_load"), scheme=("ep",), step_error=TOLERANCES)
    grid = make_grid(sweep)
    assert [c.step_error for c in chain(sweep, grid)] == [2.5e-4, 1e-3, 4e-3]
    scene = sweep.base.build(chain(sweep, grid)[0])
    assert scene.step_control.step_error == 2.5e-4


def test_fixed_steps_give_no_credit_to_controlled_ones() -> None:
    fixed = Point(Choice("ep", dt=1e-4), error=0.5)
    controlled = Point(Choice("ep", dt=1e-2, step_error=1e-3), error=0.1)
    coarse = Point(Choice("ep", dt=1e-2, step_error=1e-2), error=0.05)
    assert [p.credit for p in credited([fixed, controlled, coarse])] == [0.5, 0.1, 0.1]
