"""Fronts, offers and the sentence, on made-up errors and times."""

from dataclasses import replace

import pytest

from shellmb.accuracy.studies.advice import find_targets, sentence
from shellmb.accuracy.studies.choice import Choice
from shellmb.accuracy.studies.points import Point, credited, front
from shellmb.accuracy.studies.quantity import Quantity

from .conftest import judged, point


def test_nobody_on_the_front_is_beaten():
    fast, both, slow = point("ep", 1, 0.1, 1), point("ep", 2, 0.01, 2), point("ep", 3, 0.001, 9)
    beaten = [point("ep", 4, 0.1, 1.5), point("ep", 5, 0.02, 2.5), point("ep", 6, 0.01, 2.1)]
    assert front([slow, *beaten, both, fast]) == [fast, both, slow]


def test_a_lucky_error_gets_no_credit():
    # the number crosses the reference at the mesh 4x4
    errors = {(2, 2): 0.02, (4, 4): 0.0001, (8, 8): 0.004, (16, 16): 0.001}
    points = [point("static", 1.0, e, m[0] / 8, mesh=m) for m, e in errors.items()]
    other = point("static", 1.0, 0.5, 1.0, mesh=(4, 2))
    failed = Point(Choice(scheme="static", dt=1.0, mesh=(32, 32)), failed="no convergence")
    some = credited([*points, other, failed])
    assert [p.credit for p in some[:4]] == [0.5, 0.004, 0.004, 0.001]
    assert some[5] == failed
    assert [p.choice.mesh for p in front(some[:4])] == [(2, 2), (4, 4), (16, 16)]
    study = judged(some[:4], swept=("mesh",))
    told = sentence(study, find_targets(study, [1e-2, 1e-3]))
    assert "choose 4x4 (its error is 0.01 %, finer runs have up to 0.4 %)" in told
    assert "choose 16x16 (its error is 0.1 %)" in told


def test_errors_below_the_reference_are_equal():
    cheap = point("ep", 1, 0.004, 1.0, uncertainty=0.01)
    dear = point("ep", 2, 0.001, 2.0, uncertainty=0.01)
    assert front([dear, cheap], 0.01) == [cheap]


def test_times_are_interpolated_in_logarithms(two_schemes):
    target = find_targets(two_schemes, [1e-3])[0]
    # ED reaches 1e-3 at dt = (1e-3/3)^(1/3), EP at (1e-3/3)^(1/2); time goes with 1/dt exactly
    ed, ep = target.offers
    assert (ed.family, ep.family) == ("ED alpha = 1", "EP")
    assert ed.time_s == pytest.approx(0.03 / (1e-3 / 3) ** (1 / 3), rel=1e-12)
    assert ep.time_s == pytest.approx(0.01 / (1e-3 / 3) ** (1 / 2), rel=1e-12)
    assert ed.point.choice.dt == 0.04, "the first run with at most that error"
    assert not target.missing


def test_the_winner_depends_on_the_error(two_schemes):
    coarse, fine = find_targets(two_schemes, [1.5e-2, 3e-4])
    assert coarse.offers[0].family == "EP"
    assert coarse.offers[1].bound, "all runs of ED are better than that"
    assert fine.offers[0].family == "ED alpha = 1"


def test_the_sentence_says_what_to_choose(two_schemes):
    told = sentence(two_schemes, find_targets(two_schemes, [1e-2, 1e-3]))
    assert told.startswith("For 1 % error in tip:end choose EP, dt = 0.04 s (its error is 0.48 %)")
    assert "For 0.1 % error in tip:end choose ED alpha = 1, dt = 0.04 s" in told
    assert "times as much" in told
    assert "EP takes 0.548 s" in told


def test_the_sentence_is_honest():
    missed = judged([point("ep", 0.1, 0.5, 1.0), point("ep", 0.05, 0.2, 2.0)])
    told = sentence(missed, find_targets(missed, [1e-2]))
    assert told == (
        "1 % error in tip:end is not reached: the best is EP, dt = 0.05 s with 20 % in 2 s."
    )
    uncertain = judged([point("ep", 0.1, 5e-4, 1.0, uncertainty=2e-3)], uncertainty=2e-3)
    told = sentence(uncertain, find_targets(uncertain, [1e-2, 1e-3]))
    assert "(its error is below 0.2 %)" in told
    assert told.endswith("cannot be determined: the reference is accurate to 0.2 % only.")
    failed = judged([Point(Choice(scheme="ep", dt=0.1), failed="no convergence")])
    assert "No run succeeded" in sentence(failed, find_targets(failed))


def test_a_family_that_misses_is_named(two_schemes):
    kept = [p for p in two_schemes.points if p.choice.scheme == "ed" or p.error > 1e-2]
    told = sentence(replace(two_schemes, points=tuple(kept)), find_targets(two_schemes, [1e-3]))
    assert "EP takes" in told
    some = replace(two_schemes, points=tuple(kept))
    assert sentence(some, find_targets(some, [1e-3])).endswith("EP does not reach it.")


def test_differences_within_the_spread_are_no_differences():
    near = [point("ep", 0.1, 1e-3, 1.0, spread=0.3), point("ed", 0.1, 1e-3, 1.1, 1.0, spread=0.3)]
    clear = [near[0], replace(near[1], time_s=5.0)]
    for points, noise in ((near, True), (clear, False)):
        some = judged(points)
        told = sentence(some, find_targets(some, [1e-2]))
        assert ("within the noise" in told) is noise


def test_curves_are_named_after_what_is_swept():
    a, b = point("ep", 0.1, 0.1, 1.0, mesh=(2, 1)), point("ep", 0.1, 0.05, 2.0, mesh=(4, 2))
    some = judged([a, b], swept=("mesh",))
    assert [*some.families()] == [""]
    assert some.name(b) == "4x2"
    assert str(Quantity("tip", "l2")) == "tip:l2"
