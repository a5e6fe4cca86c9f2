"""What bends is stretched where its edges cannot follow: said by as much as its results are off."""

from typing import Any

import pytest

from shellmb.running.execute import execute
from shellmb.scene import (
    GROUND,
    Beam,
    Clamped,
    GeneralSection,
    Isotropic,
    JointSpring,
    Line,
    Modal,
    Prismatic,
    Probe,
    Rectangle,
    RigidBody,
    Scene,
    Shell,
    SurfaceForce,
    Weld,
)

# deflections of the exact body and what the warning says are means of different kinds
ABOUT = 0.15
SKIN = Isotropic(E=70e9, nu=0.3, thickness=5e-3, density=2700.0)
LEFT, RIGHT, MIDDLE = (-0.1, 0.2, 0.0), (1.1, 0.2, 0.0), (0.5, 0.2, 0.0)
# a post of 0.1 m has 3 EI/L^3 = 1e8 N/m at its top
POST = GeneralSection((1e9, 1e9, 1e9, 1e5, 1e8 * 1e-3 / 3, 1e8 * 1e-3 / 3), mass_per_length=1.0)
GUIDE = Prismatic("guide", GROUND, "second", at=RIGHT, axis=(1, 0, 0))
# what holds the block at the right end of a plate between two blocks
HOLDS: dict[str, dict[str, Any]] = {
    "a weld": {"joints": [Weld("foot", GROUND, "second", at=RIGHT)]},
    "a spring": {"joints": [GUIDE], "force_elements": JointSpring("s", "guide", stiffness=1e7)},
    "a beam": {
        "joints": [GUIDE, Weld("top", "second", "post", at=RIGHT)],
        "beams": Beam("post", Line((1.1, 0.2, -0.1), RIGHT), POST, elements=2),
        "supports": Clamped("start", body="post"),
    },
    "nothing": {"joints": [GUIDE]},
}


def between(model: Any, hold: str) -> Any:
    """A plate of 1 m between a block on the ground and another one, deflected by a thickness."""
    held = dict(HOLDS[hold])
    joints = [
        Weld("root", GROUND, "first", at=LEFT),
        Weld("left", "first", "plate", second_at="left"),
        Weld("right", "second", "plate", second_at="right"),
        *held.pop("joints"),
    ]
    blocks = [RigidBody(n, 1.0, (0.01,) * 3, at) for n, at in (("first", LEFT), ("second", RIGHT))]
    return execute(
        Scene(
            "between",
            Shell("plate", Rectangle(1.0, 0.4), SKIN, mesh=(8, 4), model=model),
            rigid_bodies=blocks,
            joints=joints,
            loads=SurfaceForce((0, 0, 1500.0), body="plate"),
            probes=Probe("w", MIDDLE, component=2, body="plate"),
            redundant="drop",
            scheme="static",
            dt=1.0,
            **held,
        )
    )


@pytest.mark.parametrize("hold", HOLDS)
def test_between_bodies_by_how_far_they_give_way(hold: str) -> None:
    models = (Modal(modes=8), "floating-frame") if hold == "a spring" else (Modal(modes=8),)
    exact, *reduced = (between(model, hold) for model in ("exact", *models))
    for run in reduced:
        off = run.history["w"].iloc[-1] / exact.history["w"].iloc[-1] - 1
        said = [item.value for item in run.warnings]
        if hold == "nothing":
            assert off < 1e-3
            assert said == []
        else:
            assert off > 0.02
            assert said == [pytest.approx(off, rel=ABOUT)]


@pytest.mark.slow
@pytest.mark.parametrize("mass", [1.0, 500.0])
def test_what_only_mass_holds_gives_way(mass: float) -> None:
    """Two blocks that nothing else holds, even those of a hundred times the plate's mass."""
    blocks = [RigidBody(n, mass, (mass,) * 3, at) for n, at in (("a", LEFT), ("b", RIGHT))]
    welds = [Weld(n, n, "plate", second_at=at) for n, at in (("a", "left"), ("b", "right"))]
    peaks = []
    for model in ("exact", Modal(modes=8)):
        run = execute(
            Scene(
                "free",
                Shell("plate", Rectangle(1.0, 0.4), SKIN, mesh=(8, 4), model=model),
                rigid_bodies=blocks,
                joints=welds,
                loads=SurfaceForce((0, 0, 300.0)),
                probes=Probe("w", MIDDLE, component=2, body="plate"),
                scheme="ep",
                dt=5e-4,
                t_end=0.02,
            )
        )
        peaks.append(run.history["w"].abs().max())
        assert run.warnings == ()
    assert peaks[1] == pytest.approx(peaks[0], rel=3e-3)
