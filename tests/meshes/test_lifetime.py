"""Meshes that nobody uses are freed in time: MPI ends a program whose communicators run out."""

import gc

from mpi4py import MPI

import pytest

from shellmb.errors import RunError
from shellmb.meshes.lifetime import _MESHES, MORE, MOST, count_holder, make_room, room_for
from shellmb.meshes.nodes import node_mesh


@pytest.fixture
def _no_garbage_by_itself():
    gc.collect()
    gc.disable()
    _MESHES.most = MOST
    yield
    gc.enable()


@pytest.mark.usefixtures("_no_garbage_by_itself")
def test_many_meshes_one_after_the_other() -> None:
    """Four communicators each: without room being made the process ends before the last one."""
    for _ in range(600):
        make_room(MPI.COMM_WORLD)
        node_mesh(MPI.COMM_WORLD, 3)
    assert len(_MESHES) < _MESHES.most + 1


@pytest.mark.usefixtures("_no_garbage_by_itself")
def test_those_in_use_stay() -> None:
    used = [node_mesh(MPI.COMM_WORLD, 3) for _ in range(MOST)]
    make_room(MPI.COMM_WORLD)
    assert len(_MESHES) >= len(used)
    assert _MESHES.most > len(used)


class Kept:
    """A result that holds a mesh."""

    def __init__(self) -> None:
        self.mesh: object = node_mesh(MPI.COMM_WORLD, 3)
        count_holder(self)

    def release(self) -> None:
        self.mesh = None


@pytest.mark.usefixtures("_no_garbage_by_itself")
def test_old_results_let_go_of_theirs() -> None:
    """Without, the process ends before the last one: a list of runs is what users keep."""
    results = []
    for _ in range(600):
        make_room(MPI.COMM_WORLD)
        results.append(Kept())
    released = [each.mesh is None for each in results]
    assert sorted(released, reverse=True) == released
    assert 10 < released.count(False) < MOST + MORE


@pytest.mark.usefixtures("_no_garbage_by_itself")
def test_what_is_in_use_and_leaves_no_room_is_said() -> None:
    used = [node_mesh(MPI.COMM_WORLD, 3) for _ in range(MOST)]
    with pytest.raises(RunError, match="meshes are in use: too few are left for one of 1000"):
        make_room(MPI.COMM_WORLD, bodies=1000)
    assert len(used) == MOST


def test_communicators_that_are_left() -> None:
    """Asking takes none of them."""
    assert room_for(MPI.COMM_WORLD, 10)
    assert not room_for(MPI.COMM_WORLD, 10_000)
    assert all(room_for(MPI.COMM_WORLD, 500) for _ in range(5))
