"""Parts of scenes that a user derives from bundled ones act as these."""

from dataclasses import replace

import numpy as np

import shellmb as sm


class Held(sm.Clamped):
    """A support of a user's own."""


class Weight(sm.Gravity):
    """A load over a body."""


class Pull(sm.PointForce):
    """A load at a point."""


class Push(sm.EdgeForce):
    """A load at an edge."""


class Floor(sm.Plane):
    """An obstacle."""


PLATE = sm.Shell(
    "plate", sm.Rectangle(1.0, 0.5), sm.Isotropic(1e9, 0.3, 0.01, density=1e3), mesh=(2, 1)
)
BUNDLED = sm.Scene(
    "bundled",
    PLATE,
    supports=sm.Clamped("left"),
    loads=[
        sm.Gravity((0, 0, -9.81)),
        sm.PointForce("right-top", (0, 0, -5.0)),
        sm.EdgeForce("right", (0, 0, -5.0)),
    ],
    contacts=sm.Contact("floor", sm.Plane((0, 0, -1e-3), (0, 0, 1)), stiffness=1e5, body="plate"),
    probes=sm.Probe("tip", "right-top", component=2),
    scheme="ep",
    dt=5e-3,
    t_end=2e-2,
)


def test_derived_parts_act_as_what_they_derive_from() -> None:
    """Kind: tables by class, in which a class of a user's own does not stand."""
    contact = BUNDLED.contacts[0]
    derived = replace(
        BUNDLED,
        supports=Held("left"),
        loads=[
            Weight((0, 0, -9.81)),
            Pull("right-top", (0, 0, -5.0)),
            Push("right", (0, 0, -5.0)),
        ],
        contacts=replace(contact, obstacle=Floor((0, 0, -1e-3), (0, 0, 1))),
    )
    ours, theirs = (sm.run(scene, progress=False).history for scene in (BUNDLED, derived))
    assert np.array_equal(ours["tip"], theirs["tip"])
    assert ours["tip"].iloc[-1] < -1e-3
