"""What a state copies: kind: whatever JSON has no type for, and what later steps change."""

import json

import numpy as np

from shellmb.restart import Restartable


class Inner(Restartable):
    remembered = ("found",)

    def __init__(self) -> None:
        self.found: dict[str, tuple[float, float]] = {}


class Outer(Restartable):
    remembered = ("_vector", "_acting", "_inner", "_times", "_first", "_deep", "count")

    def __init__(self) -> None:
        self._vector, self._acting = np.zeros(3), np.array([True, False])
        self._inner, self._times, self.count = Inner(), [0.5], 0
        self._first: tuple[float, float] | None = None
        self._deep: dict[str, dict[str, tuple[float, ...]]] = {"a": {}}


def test_a_state_is_a_copy_that_comes_back_as_it_was() -> None:
    one, other = Outer(), Outer()
    one._vector[1], one._acting, one.count = 0.1, np.array([False, True]), 3
    one._first, one._deep["a"]["b"] = (1.0, 2.0), (3.0, 4.0)
    one._inner.found["x"] = (0.1, 1e-300)
    state = json.loads(json.dumps(one.state()))
    held = one.state()
    # later steps
    one._vector += 1
    one._times.append(1.0)
    one._deep["a"]["c"] = (5.0,)
    one._inner.found["y"] = (0.0, 0.0)
    assert json.loads(json.dumps(held)) == state
    inner = other._inner
    other.restore(state)
    assert json.loads(json.dumps(other.state())) == state
    np.testing.assert_array_equal(other._vector, [0.0, 0.1, 0.0])
    assert other._acting.dtype == bool
    assert (other._first, other._deep) == ((1.0, 2.0), {"a": {"b": (3.0, 4.0)}})
    assert other._inner is inner
    assert max(inner.found["x"], (0.0, 9.0)) == (0.1, 1e-300)
    other._times.append(2.0)
    assert state["times"] == [0.5]
    # an array in the place of what was None then
    other._first = np.ones(2)  # type: ignore[assignment]
    other.restore(state | {"first": None})
    assert other._first is None
