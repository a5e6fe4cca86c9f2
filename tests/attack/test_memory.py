"""Laws that keep their memory in place: each run of one scene object is the first one.

The kind: whatever a run may change in what a scene holds, as the state of a controller, an object
of the user's, what such an object was made a method or a part of, a default of an argument. What
cannot be copied is told.
"""

import functools
import warnings
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
from scipy.interpolate import Akima1DInterpolator, CubicSpline

from shellmb.errors import ShellmbWarning
from shellmb.running.execute import execute
from shellmb.scene import (
    Command,
    Controller,
    Gravity,
    Motor,
    Revolute,
    RigidBody,
    Scene,
    Sensor,
)
from shellmb.scene.fingerprint import differences, fingerprint

counted = [0]


def in_place(t, readings, state, dt):
    state[0] += 1.0
    return 5 * state[0], state


def by_default(t, readings, state, dt, memory=[0]):  # noqa: B006
    memory[0] += 1
    return 5.0 * memory[0], state


def by_part(memory, t, readings, state, dt):
    memory.append(t)
    return 5.0 * len(memory), state


def by_module(t, readings, state, dt):
    counted[0] += 1
    return 5.0 * counted[0], state


def by_closure():
    n = 0

    def law(t, readings, state, dt):
        nonlocal n
        n += 1
        return 5.0 * n, state

    return law


class Counting:
    """A law, and a function of time, with a memory."""

    def __init__(self) -> None:
        self.inner = {"n": [0]}

    def __call__(self, t, *others):
        self.inner["n"][0] += 1
        value = 5.0 * self.inner["n"][0]
        return (value, others[1]) if others else 1 + value

    def ask(self, *values):
        return self(*values)


class Uncopyable(Counting):
    """One that holds what Python cannot copy."""

    def __init__(self) -> None:
        super().__init__()
        self.values = (5.0 * n for n in range(1, 1000))

    def __call__(self, t, readings, state, dt):
        return next(self.values), state


def pendulum(law=in_place, state=None, time=1.0):
    return Scene(
        "pendulum",
        rigid_bodies=RigidBody("arm", 2.0, (0.01, 0.2, 0.2), com=(0.5, 0, 0)),
        joints=Revolute("pin", "ground", "arm", at=(0, 0, 0), axis=(0, 1, 0)),
        loads=Gravity((0, 0, -9.81), **({} if time == 1.0 else {"time": time})),
        controllers=Controller("c", Sensor("pin.rotation"), law, state=state),
        force_elements=Motor("m", "pin", command=Command("c")),
        scheme="ep",
        dt=1e-2,
        t_end=0.04,
    )


MEMORIES = {
    "an array": lambda: pendulum(state=np.zeros(1)),
    "a list": lambda: pendulum(state=[0.0]),
    "an object": lambda: pendulum(Counting()),
    "a method": lambda: pendulum(Counting().ask),
    "a part": lambda: pendulum(functools.partial(by_part, [])),
    "a default": lambda: pendulum(by_default),
    "a function of time": lambda: pendulum(state=[0.0], time=Counting()),
}
TOLD = {
    "a closure": (lambda: pendulum(by_closure()), "an earlier run has changed n, which"),
    "a module": (lambda: pendulum(by_module), "an earlier run has changed counted, which"),
    "a generator": (
        lambda: pendulum(Uncopyable()),
        r"controllers\[0\].law is or holds a Uncopyable that cannot be copied",
    ),
}


def angles(scene):
    return execute(scene).column("pin.rotation")


@pytest.mark.parametrize("memory", MEMORIES)
def test_two_runs_of_one_scene_are_the_same_bit_for_bit(memory) -> None:
    scene = MEMORIES[memory]()
    first = angles(scene)
    assert first[-1] != 0.0
    np.testing.assert_array_equal(angles(scene), first)


def swells(t, memory=[0.0]):  # noqa: B006
    memory[0] += 1.0
    return memory[0]


def test_checks_of_a_scene_are_no_part_of_a_memory() -> None:
    """They try a function at three times, and again with each option of a run."""
    counting = Counting()
    for time in (counting, counting.ask, functools.partial(counting), swells):
        pendulum(state=[0.0], time=time).with_options(dt=2e-3)
    assert counting.inner["n"] == [0] and swells.__defaults__ == ([0.0],)


@pytest.mark.parametrize("memory", TOLD)
def test_what_cannot_be_copied_is_told(memory) -> None:
    make, said = TOLD[memory]
    scene = make()
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always", ShellmbWarning)
        first, second = angles(scene), angles(scene)
    assert np.abs(first - second).max() > 1e-4, "else there were nothing to tell"
    with pytest.warns(ShellmbWarning, match=said):
        for warning in found:
            warnings.warn(warning.message, stacklevel=1)


def test_a_law_that_reads_variables_which_others_change_is_none_of_these() -> None:
    """The user's own loop over values is no memory of a law."""
    gain = 1.0

    def law(t, readings, state, dt):
        return gain, state

    scene = pendulum(law)
    angles(scene)
    gain = 2.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        angles(scene)


class Slotted:
    """A law without a dictionary of attributes."""

    __slots__ = ("rate",)

    def __init__(self, rate: float) -> None:
        self.rate = rate

    def __call__(self, t: float) -> float:
        return self.rate * t


class Ramp:
    """A law whose values are those of its class, which another one inherits."""

    rate = 1.0

    def __call__(self, t: float) -> float:
        return self.rate * t


class Steep(Ramp):
    """A law that is written in its base."""


def with_attribute(rate):
    def law(t):
        return law.rate * t

    law.rate = rate
    return law


def with_value(value):
    return lambda t: t * float(value)


def inherits(rate, monkeypatch):
    monkeypatch.setattr(Ramp, "rate", rate)
    return Steep()


TIMES = np.linspace(0.0, 1.0, 5)
LAWS = {
    "a spline": lambda rate, _: CubicSpline(TIMES, rate * TIMES),
    "an Akima spline": lambda rate, _: Akima1DInterpolator(TIMES, rate * TIMES),
    "slots": lambda rate, _: Slotted(rate),
    "its class": inherits,
    "an attribute": lambda rate, _: with_attribute(rate),
    "a fraction": lambda rate, _: with_value(Fraction(int(rate), 3)),
    "a decimal number": lambda rate, _: with_value(Decimal(int(rate))),
    "bytes": lambda rate, _: with_value(b"%d" % rate),
}


@pytest.mark.parametrize("law", LAWS)
def test_scenes_are_told_apart_by_what_their_laws_hold(law, monkeypatch) -> None:
    """Kind: values that no dictionary of attributes has: ranks and resumed runs compare them."""
    same, again, other = (
        fingerprint(pendulum(state=[0.0], time=LAWS[law](rate, monkeypatch)))
        for rate in (1.0, 1.0, 2.0)
    )
    assert not differences(same, again)
    ((path, _, _), *_) = differences(same, other)
    assert path.startswith("loads[0].time")


RANKS = """
import sys
from mpi4py import MPI
import numpy as np
import shellmb as sm
from shellmb.running.natural_modes.vibration import natural_modes
from shellmb.simulate.simulation import Simulation
rank = MPI.COMM_WORLD.rank
steel = sm.Isotropic(E=2e11, nu=0.3, thickness=0.01, density=7800)
def scene(size=1.0, dt=0.1, frames=3, law=lambda t: 1.0):
    shell = sm.Shell("plate", sm.Rectangle(size, 1.0), steel, mesh=(2, 2))
    return sm.Scene("s", shell, supports=sm.Clamped("left"), scheme="ep", dt=dt, t_end=1.0,
                    loads=sm.Gravity((0, 0, 1), time=law), output=sm.Output(frames=frames))
others = (lambda t: 1.0, lambda t: 2.0)
said = []
for made, build in (
    (scene(size=1.0 + 1e-6 * np.random.default_rng(rank).normal()), Simulation),
    (scene(dt=0.1 / (1 + rank)), Simulation),
    (scene(frames=3 + rank), Simulation),
    (scene(law=others[rank]), Simulation),
    (scene(size=1.0 + rank), natural_modes),
):
    try:
        build(made, MPI.COMM_WORLD)
        said.append("built")
    except sm.SceneError as error:
        said.append(str(error))
said = MPI.COMM_WORLD.gather(said)
if rank == 0:
    print(said[0] == said[1], *said[0], sep="\\n")
"""


@pytest.mark.mpi
def test_ranks_with_different_scenes_are_refused_on_all_of_them(mpirun) -> None:
    """The kind: whatever a scene says, also how it is shown, is of one rank and not of another."""
    same, *said = mpirun(2, "-c", RANKS).splitlines()
    assert same == "True"
    named = ("surface.", "dt is 0.1 on rank 0 and 0.05 on rank 1", "output.frames", "loads[0]")
    for text, name in zip(said, (*named, "surface."), strict=True):
        assert text.startswith("scene 's' differs from rank to rank: ") and name in text, text
