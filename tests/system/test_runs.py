"""Runs of entries: together they are the entries, and each place is set before it is added to."""

import numpy as np
import pytest

from shellmb.arrays import Bools, Int32s
from shellmb.system.condensation.elimination import Lists, find_runs

CELLS, SIZE, PLACES = 70, 12, 300


@pytest.fixture
def entries() -> tuple[Lists, Int32s, Bools]:
    """Cells with some of their entries, each run of which goes anywhere."""
    rng = np.random.default_rng(1)
    lists = Lists()
    found = rng.random((CELLS, SIZE)) < 0.8
    # some cells are alike, and one has nothing
    found[::7], found[3] = found[0], False
    lists.add(found)
    places = [
        rng.integers(0, PLACES - SIZE) + np.arange(SIZE)[row] // 5 * 9 + np.arange(SIZE)[row] % 5
        for row in found
    ]
    flat = np.minimum(np.concatenate(places), PLACES - 1).astype(np.int32)
    first = np.zeros(len(flat), dtype=bool)
    first[np.unique(flat, return_index=True)[1]] = True
    return lists, flat, first


def test_runs_do_what_single_entries_do(
    entries: tuple[Lists, Int32s, Bools],
) -> None:
    lists, places, first = entries
    runs, offsets = find_runs(lists, places, first)
    values = np.random.default_rng(2).random((CELLS, SIZE))
    expected = np.zeros(PLACES)
    every = [values[c][lists.entries[k]] for c, k in enumerate(lists.of_cell)]
    np.add.at(expected, places, np.concatenate(every))
    # what is there before does not matter
    found = np.where(expected > 0, 1e30, 0.0)
    for cell in range(CELLS):
        for part, begin in enumerate(offsets[2 * cell : 2 * cell + 2]):
            for source, to, length in runs[begin : offsets[2 * cell + part + 1]]:
                here = values[cell, source : source + length]
                found[to : to + length] = here + (found[to : to + length] if part else 0.0)
    assert found == pytest.approx(expected, rel=1e-14)
    assert len(runs) < len(places)


def test_cells_without_entries_have_no_runs() -> None:
    lists = Lists()
    lists.add(np.zeros((2, 4), dtype=bool))
    runs, offsets = find_runs(lists, np.zeros(0, np.int32), np.zeros(0, bool))
    assert runs.shape == (0, 3)
    assert offsets.tolist() == [0] * 5
