"""Any value for any field of what a scene is made of: accepted, or refused with a sentence."""

from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest

import shellmb as sm

STEEL = sm.Isotropic(E=2e11, nu=0.3, thickness=0.01, density=7800)
BAR = sm.RectangularSection(2e11, 0.3, width=0.1, height=0.1, density=7800)
SHELL = sm.Shell("p", sm.Rectangle(1, 1), STEEL, mesh=(2, 2))
HALF = {"thickness": 1, "density": 0, "stiffness": 1}
PARTS = {
    "section": STEEL,
    "beam section": BAR,
    "energy": sm.Hyperelastic(lambda s, p: s.eps[0] ** 2, {}, **HALF),
    "shell": SHELL,
    "beam": sm.Beam("b", sm.Line((0, 0, 0), (1, 0, 0)), BAR, elements=2),
    "rigid body": sm.RigidBody("r", 1.0, (1, 1, 1)),
    "joint": sm.Revolute("h", sm.GROUND, "b", at=(0, 0, 0), axis=(0, 1, 0)),
    "edge hinge": sm.EdgeHinge("h", "p", "q", at="left", second_at="right"),
    "spring": sm.Spring("s", sm.GROUND, "b", at=(0, 0, 0), second_at=(1, 0, 0), stiffness=1.0),
    "motor": sm.Motor("m", "h", law=lambda q, v, t: 0),
    "driver": sm.Driver("d", "h", rotation=lambda t: t),
    "PID": sm.PID("c", sm.Sensor("h.rotation"), 0.0, 1.0, 0.0, 0.0),
    "event": sm.Event("e", sm.Sensor("a") >= 1),
    "contact": sm.Contact("c", sm.Plane((0, 0, -1)), 1e4, "p"),
    "faces": sm.Faces("p", thickness=0.01),
    "volume": sm.EnclosedVolume("v", ("p",), gas=sm.Gas(1e5)),
    "natural": sm.NaturalStrain(curvature=(0.1, 0, 0)),
    "beam's natural": sm.BeamNaturalStrain(curvature=(0.1, 0, 0)),
    "path": sm.PathFollowing(),
    "from a mode": sm.FromMode(1, 0.1),
    "from a run": sm.FromRun("runs/x"),
    "modal": sm.Modal(modes=3),
    "probe": sm.Probe("a", (0, 0, 0)),
    "solver": sm.Solver(),
    "step control": sm.StepControl(),
    "output": sm.Output(),
    "scene": sm.Scene("s", SHELL, supports=sm.Clamped("left"), scheme="ep", dt=0.1, t_end=1.0),
}
ROUND: list[Any] = []
ROUND.append(ROUND)
VALUES = {
    "nothing": None,
    "text": "x" * 300,
    "truth": True,
    "a small number": -1,
    "no number": float("nan"),
    "a number without end": 10**400,
    "a complex one": 1j,
    "a list of too few": (1,),
    "a table": np.zeros((2, 2)),
    "of many kinds": (1, "a", None, [2]),
    "a list in itself": ROUND,
    "a mapping": {"a": 1},
    "a class": int,
    "bytes": b"x\0",
}


@pytest.mark.parametrize("part", PARTS)
def test_values_of_any_kind_end_in_a_sentence(part) -> None:
    """Kind: whatever a field may be given by mistake, no error is that of a library."""
    good = PARTS[part]
    assert fields(good)
    for f in fields(good):
        for name, value in VALUES.items():
            try:
                replace(good, **{f.name: value})
            except sm.SceneError as error:
                assert len(str(error)) < 900, (f.name, name)
            except Exception as error:
                pytest.fail(f"{f.name}, {name}: {type(error).__name__}: {error}")


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: sm.Modal(modes=10**400), "modes is 1000.*; it must be at most 1e"),
        (lambda: replace(PARTS["beam"], elements=10**10), "elements is 10000000000; it must be at"),
        (lambda: 1 / sm.Sensor("j.rotation"), "formula of a sensor and 1: a sensor can be"),
        (lambda: sm.Sensor("j.rotation") ** 2, "formula of a sensor and 2: a sensor can be"),
        (
            lambda: sm.Controller("c", sm.Sensor("a"), lambda *a: a, state=(i for i in "a")),
            "controller 'c': state is .*, which cannot be copied",
        ),
        (lambda: sm.thermal_strain(STEEL, 1e-5, None), "temperature is None; it must be a finite"),
        (lambda: sm.Gas(ROUND), "gas: pressure is a list that holds itself"),
        (lambda: sm.RigidBody("r", 1.0, 10**400), "inertia is .*"),
        (lambda: sm.MeshFile("a" * 300), "there is no such file"),
        (lambda: sm.MeshFile("a\0.stl"), "there is no such file"),
        (lambda: replace(PARTS["rigid body"], shape="a" * 300 + ".stl"), "there is no such file"),
    ],
)
def test_numbers_and_names_without_end(make, said) -> None:
    with pytest.raises(sm.SceneError, match=said):
        make()
