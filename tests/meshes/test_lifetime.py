"""Meshes that nobody uses are freed in time: MPI ends a program whose communicators run out."""

import gc

from mpi4py import MPI

import pytest

from shellmb.meshes.lifetime import _MESHES, MOST, make_room, room_for
from shellmb.meshes.nodes import node_mesh


@pytest.fixture
def _no_garbage_by_itself():
    gc.disable()
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


def test_communicators_that_are_left() -> None:
    """Asking takes none of them."""
    assert room_for(MPI.COMM_WORLD, 10)
    assert not room_for(MPI.COMM_WORLD, 10_000)
    assert all(room_for(MPI.COMM_WORLD, 500) for _ in range(5))
