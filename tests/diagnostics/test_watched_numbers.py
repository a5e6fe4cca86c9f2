"""Bounds and sums of watches, against sequences of numbers whose answer is known."""

from types import SimpleNamespace

from mpi4py import MPI

import numpy as np
import pytest

from shellmb.diagnostics.contacts import Contacts, Lifting, impacts


@pytest.mark.parametrize(("steps", "said"), [(2.5, True), (3.0, True), (4.5, False), (8, False)])
def test_impacts_of_a_linear_spring(steps: float, said: bool) -> None:
    """Half a sine of the penetration: too short if its energy comes in fewer than four steps."""
    found = []
    for phase in np.linspace(0, 1, 50, endpoint=False):
        times = (np.arange(12) + phase) / steps
        energies = [0.0, *np.where(times < 1, np.sin(np.pi * times) ** 2, 0.0)]
        rows = [{"t": float(k), "c.energy": energy} for k, energy in enumerate(energies)]
        watch = Contacts(SimpleNamespace(history=SimpleNamespace(rows=rows)))  # type: ignore[arg-type]
        found.append(len(list(impacts(watch, "body", "c", "contact 'c'"))))
    assert max(found) == (1 if said else 0)


@pytest.mark.parametrize(
    ("forces", "pull"),
    [
        # EP alternates about the right force: their mean presses
        ([3.0, -1.0, 3.0, -1.0], None),
        ([1.0, 1.0, -3.0, 1.0, -3.0], 1.0),
        ([2.0, -1.0, -1.0], 1.0),
    ],
)
def test_joints_that_pull_in_the_mean_of_two_steps(forces: list[float], pull: float | None) -> None:
    now = {"force": 0.0}
    nodes = SimpleNamespace(
        item=np.array([0]),
        mesh=SimpleNamespace(
            comm=MPI.COMM_SELF,
            topology=SimpleNamespace(
                index_map=lambda dim: SimpleNamespace(size_local=1, size_global=1)
            ),
        ),
    )
    group = SimpleNamespace(
        name="rolling",
        joints=[None],
        labels=["wheel"],
        nodes=nodes,
        sliding=lambda q, v: np.array([[0.0, 0.0, 0.0, 0.0, now["force"]]]),
    )
    joint = SimpleNamespace(joint=SimpleNamespace(second="cart", said="rolling joint 'wheel'"))
    level = SimpleNamespace(q=SimpleNamespace(x=SimpleNamespace(array=np.zeros(1))))
    simulation = SimpleNamespace(
        t=0.0,
        problem=SimpleNamespace(levels={"rolling": level}),
        model=SimpleNamespace(mechanism=SimpleNamespace(joints={"wheel": joint})),
    )
    watch = Lifting(None)  # type: ignore[arg-type]
    watch._groups = [group]  # type: ignore[list-item]
    for force in forces:
        now["force"] = force
        watch.accepted(simulation)  # type: ignore[arg-type]
    said = [caution.says for caution in watch.cautions(simulation)]  # type: ignore[arg-type]
    assert len(said) == (pull is not None)
    if pull is not None:
        assert f"by up to {pull:.3g} N" in said[0]
