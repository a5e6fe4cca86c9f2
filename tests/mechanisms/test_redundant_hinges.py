"""Hinges of edges that hold what others hold, or of edges that are joined, are refused by name."""

from dataclasses import replace
from typing import Any

from mpi4py import MPI

import pytest

import shellmb as sm
from shellmb.errors import SceneError
from shellmb.preprocessing.checked_model import checked_model
from shellmb.scene import GROUND, EdgeHinge, Scene, Shell

from .test_edge_hinges import hinge, panels


def beside(**more: Any) -> Shell:
    """A third panel at the same edge, of one row of elements, in the plane of the second."""
    return replace(panels(**more)[1], name="c")


# of several panels at one edge what holds the same nodes twice, and what cannot turn; the kind: all
# ways in which places of an edge are together without the hinge, but not its corners alone
SAME = {
    "equal": [hinge(), replace(hinge(), name="more")],
    "turned over": [
        hinge(),
        EdgeHinge("more", "b", "a", at="left", second_at="right", rigid_angle=True),
    ],
    "around": [
        hinge(),
        EdgeHinge("next", "b", "c", at="left", second_at="left"),
        EdgeHinge("more", "a", "c", at="right", second_at="left"),
    ],
    "on the ground": [EdgeHinge(name, GROUND, "b", second_at="left") for name in ("hinge", "more")],
}
JOINED = {
    "smooth": [sm.Join("a", "b", "right", "left", kind="smooth")],
    "kink": [sm.Join("a", "b", "right", "left")],
    "by a third": [
        sm.Join("a", "c", "right", "left"),
        sm.Join("c", "b", "left", "left", kind="smooth"),
    ],
}


@pytest.mark.parametrize("rows", [1, 2])
@pytest.mark.parametrize("case", SAME)
def test_hinges_that_hold_the_same_are_redundant(case: str, rows: int) -> None:
    joints = SAME[case]
    names = {name for joint in joints for name in (joint.first, joint.second)}
    scene = Scene(
        "same",
        [shell for shell in (*panels(rows=rows), beside()) if shell.name in names],
        joints=joints,
        scheme="ep",
        dt=0.01,
        t_end=0.1,
    )
    with pytest.raises(SceneError, match=r"of joint 'more' \(implied by 'hinge'"):
        checked_model(scene, MPI.COMM_WORLD)
    checked_model(replace(scene, redundant="drop"), MPI.COMM_WORLD)


@pytest.mark.parametrize("case", JOINED)
def test_a_hinge_of_joined_edges_cannot_turn(case: str) -> None:
    scene = Scene(
        "joined",
        [*panels(kink=0.2), *([beside(kink=0.2)] if "third" in case else [])],
        joins=JOINED[case],
        joints=hinge(),
        scheme="ep",
        dt=0.01,
        t_end=0.1,
    )
    with pytest.raises(SceneError, match="hinge 'hinge' cannot turn: the edges of 'a' and 'b' are"):
        checked_model(scene, MPI.COMM_WORLD)
