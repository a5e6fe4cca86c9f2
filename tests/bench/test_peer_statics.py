"""Static problems beside other codes: errors, words, and what each of them gets."""

import importlib.util

import numpy as np
import pytest

from shellmb.demos.verification.measuring import markdown
from shellmb.errors import SceneError
from tests.bench.peers.codes import EXUDYN, KRATOS, NGSOLVE, OPENSEES, OURS
from tests.bench.peers.statics import hemisphere, roll_up
from tests.bench.peers.statics.problem import COLUMNS, Solved, Static, compared, sentence

PEERS = {
    EXUDYN: "exudyn",
    OPENSEES: "openseespy",
    KRATOS: "KratosMultiphysics",
    NGSOLVE: "ngsolve",
}


def there(code):
    missing = importlib.util.find_spec(PEERS[code]) is None
    return pytest.mark.skipif(missing, reason="extra 'peers' not there")


def test_distance_from_the_circle():
    radius = 12.0 / (2 * np.pi)
    circle = radius * np.array([[1.0, 0, 1.0], [0.0, 0, 2.0], [-1.0, 0, 1.0], [0.0, 0, 0.0]])
    start = np.stack([roll_up.QUARTERS, np.zeros(4), np.zeros(4)], axis=-1)
    assert roll_up.distance(circle - start) < 1e-12
    assert roll_up.distance(circle - start + np.array([0.12, 0, 0])) == pytest.approx(0.01)


def test_error_of_the_hemisphere():
    moved = np.array([[hemisphere.EXACT[0], 0.0, 0.0], [0.0, -hemisphere.EXACT[1], 0.0]])
    assert hemisphere.relative(moved) < 1e-12
    assert hemisphere.relative(1.01 * moved) == pytest.approx(0.01)


def test_words_and_table():
    some = [
        Solved(Static(OURS, (4, 1), "degree 2"), 5e-3, 9, (0.3, 0.2), ""),
        Solved(Static(OURS, (8, 1), "degree 3"), 5e-4, 9, (0.4,), ""),
        Solved(Static(EXUDYN, (8, 1), "", 8), 8e-3, 60, (1.0,), ""),
        Solved(Static(EXUDYN, (16, 1), "", 1), np.inf, 50, (0.1,), "it diverged"),
    ]
    said = sentence(roll_up.PROBLEM, some)
    assert said.startswith("1 % error: shellmb 0.2 s (degree 2, 4x1), Exudyn 1 s (8x1, 5.0 times")
    assert "0.1 % error: shellmb 0.4 s (degree 3, 8x1), Exudyn not reached." in said
    lines = markdown(COLUMNS, some)
    assert "| shellmb | degree 2 | 4x1 | 1 | 0.5 % | 9 | 0.2 | 50 % |" in lines
    assert "it diverged" in lines[-1]


def test_our_strip_rolls_up():
    cases = [Static(OURS, (n, 1), "degree 2") for n in (4, 8)] + [Static(EXUDYN, (4, 1))]
    # nobody asked for the peer
    coarse, fine = compared(roll_up.PROBLEM, cases, (), 1)
    assert not coarse.failed and not fine.failed and len(fine.times) == 1
    # of second order at least; eight elements of 45 degrees each are not many
    assert fine.error < coarse.error / 4 and fine.error < 0.01


def test_our_hemisphere():
    (found,) = compared(hemisphere.PROBLEM, [Static(OURS, (4, 4), "degree 2")], (), 1)
    # coarse: shellmb study hemisphere has 1.4 % for the outward displacement, too
    assert not found.failed and 0.005 < found.error < 0.03


@pytest.mark.parametrize("code", list(PEERS))
@pytest.mark.parametrize("problem", [roll_up.PROBLEM, hemisphere.PROBLEM])
def test_without_the_peer(monkeypatch, code, problem):
    find = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == PEERS[code] else find(name)
    )
    with pytest.raises(SceneError, match=f"{PEERS[code]} is not installed; .*'peers'"):
        problem.solve[code](Static(code, (4, 4), "HHJ 2"))


@there(OPENSEES)
class TestOpenSees:
    def test_the_strip_is_a_polygon_that_closes(self):
        cases = [Static(OPENSEES, (n, 1), "ASD") for n in (8, 16)]
        found = compared(roll_up.PROBLEM, cases, (OPENSEES,), 1)
        # chords in place of arcs: of second order
        assert found[0].error == pytest.approx(4 * found[1].error, rel=0.05)
        poor = Static(OPENSEES, (8, 1), "NLDKGQ", 10)
        (failed,) = compared(roll_up.PROBLEM, [poor], (OPENSEES,), 1)
        assert failed.error == np.inf and "load step 1" in failed.failed

    def test_the_hemisphere_is_stiff(self):
        case = Static(OPENSEES, (4, 4), "ASD", 8)
        answer = hemisphere.PROBLEM.solve[OPENSEES](case)
        # flat elements, few of them: far from it, but on its load
        assert not answer.failed
        assert 2.0 < answer.moved[0, 0] < 4.0 and 3.0 < -answer.moved[1, 1] < 8.0


@there(KRATOS)
class TestKratos:
    def test_the_strip_is_a_polygon_that_closes(self):
        cases = [Static(KRATOS, (n, 1), "thin", 8) for n in (8, 16)]
        found = compared(roll_up.PROBLEM, cases, (KRATOS,), 1)
        # chords in place of arcs: of second order
        assert found[0].error == pytest.approx(4 * found[1].error, rel=0.05)
        (failed,) = compared(roll_up.PROBLEM, [Static(KRATOS, (8, 1), "thin")], (KRATOS,), 1)
        assert failed.error == np.inf and "load step 1" in failed.failed

    def test_the_hemisphere(self):
        (found,) = compared(hemisphere.PROBLEM, [Static(KRATOS, (8, 8), "thin", 10)], (KRATOS,), 1)
        assert not found.failed and 0.02 < found.error < 0.06


@there(NGSOLVE)
def test_ngsolve_rolls_the_strip_up():
    cases = [Static(NGSOLVE, (4, 1), "HHJ 2", steps) for steps in (1, 10)]
    failed, found = compared(roll_up.PROBLEM, cases, (NGSOLVE,), 1)
    assert failed.error == np.inf and "load step 1" in failed.failed
    assert not found.failed and found.error < 0.02


@there(EXUDYN)
class TestExudyn:
    def test_the_strip(self):
        cases = [Static(EXUDYN, (n, 1), "", 8) for n in (4, 8)]
        coarse, fine = compared(roll_up.PROBLEM, cases, (EXUDYN,), 1)
        assert not fine.failed and fine.error < coarse.error / 4 and fine.error < 0.01
        (failed,) = compared(roll_up.PROBLEM, [Static(EXUDYN, (8, 1))], (EXUDYN,), 1)
        assert failed.error == np.inf and failed.failed

    def test_the_hemisphere(self):
        answer = hemisphere.PROBLEM.solve[EXUDYN](Static(EXUDYN, (8, 8), "", 10))
        # Exudyn 1.13.6 as measured before this model was written
        assert answer.moved[0, 0] == pytest.approx(3.682, abs=2e-3)
        assert -answer.moved[1, 1] == pytest.approx(6.874, abs=2e-3)
