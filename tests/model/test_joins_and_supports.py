"""What the model refuses, and what an effect that is off leaves out."""

from dataclasses import replace
from typing import Any

from mpi4py import MPI

import numpy as np
import pytest

from shellmb.errors import SceneError
from shellmb.model.body import kinetic_energy
from shellmb.model.model import Model
from shellmb.scene import (
    Clamped,
    EdgeForce,
    Isotropic,
    Join,
    PointForce,
    Rectangle,
    Scene,
    Shell,
    SymmetryPlane,
)

SECTION = Isotropic(E=1.0, nu=0.3, thickness=0.1, density=1.0)
FIRST = Shell("first", Rectangle(1.0, 0.5), SECTION, mesh=(2, 2))
SECOND = Shell("second", Rectangle(1.0, 0.5, origin=(1.0, 0, 0)), SECTION, mesh=(2, 2))


def joined(second: Shell, **more: Any) -> Scene:
    join = Join("first", "second", "right", "left", **more)
    return Scene("s", (FIRST, second), supports=Clamped("left", body="first"), joins=join)


def test_edges_with_different_meshes_cannot_be_joined() -> None:
    with pytest.raises(SceneError, match="have 5 and 7 nodes"):
        Model(joined(replace(SECOND, mesh=(2, 3))), MPI.COMM_WORLD)


def test_edges_that_are_apart_cannot_be_joined() -> None:
    away = replace(SECOND, surface=Rectangle(1.0, 0.5, origin=(1.1, 0, 0)))
    with pytest.raises(SceneError, match=r"'first' and 'second': .* 0\.1 apart"):
        Model(joined(away), MPI.COMM_WORLD)


def test_opposite_normals_cannot_be_joined() -> None:
    surface = Rectangle(1.0, 0.5, origin=(1.0, 0.5, 0), axis1=(1, 0, 0), axis2=(0, -1, 0))
    with pytest.raises(SceneError, match="opposite sides"):
        Model(joined(replace(SECOND, surface=surface)), MPI.COMM_WORLD)


def test_a_smooth_join_shares_directors_and_a_kink_does_not() -> None:
    smooth = Model(joined(SECOND), MPI.COMM_WORLD)
    assert [b.name for b in smooth.bodies] == ["first", "second"]
    # five nodes with displacement, director and its multiplier
    assert sum(len(link.dofs) for link in smooth.shells["second"].links) == 5 * 7
    upright = Rectangle(1.0, 0.5, origin=(1.0, 0, 0), axis1=(0, 0, 1))
    kinked = Model(joined(replace(SECOND, surface=upright)), MPI.COMM_WORLD)
    assert sum(len(link.dofs) for link in kinked.shells["second"].links) == 5 * 3
    # one multiplier per node keeps the angle
    assert len(kinked.bodies[2].mixed.dofs["mu"]) == 5


def test_a_place_that_is_not_on_the_mesh_is_named() -> None:
    held = {"shells": FIRST, "supports": Clamped("left")}
    scene = Scene("s", loads=PointForce((0.3, 0.1, 0.0), (0, 0, 1)), **held)
    with pytest.raises(SceneError, match=r"no node at \(0\.3, 0\.1, 0\); the nearest one is at"):
        Model(scene, MPI.COMM_WORLD)
    with pytest.raises(SceneError, match="front"):
        Model(Scene("s", loads=EdgeForce("front", (0, 0, 1)), **held), MPI.COMM_WORLD)


def test_a_dof_is_held_once_where_supports_meet() -> None:
    scene = Scene("s", FIRST, supports=(Clamped("left"), SymmetryPlane("bottom", (0, 1, 0))))
    body = Model(scene, MPI.COMM_WORLD).shells["first"]
    dofs = np.concatenate([f.dofs for f in body.fixed])
    u_and_w = np.concatenate([body.mixed.dofs["u"], body.mixed.dofs["w"]])
    held = dofs[np.isin(dofs, u_and_w)]
    assert len(held) == len(np.unique(held))
    # five nodes clamped, four more held across the plane
    assert len(held) == 2 * (5 * 3 + 4)


def test_a_plane_that_is_not_axis_parallel_has_multipliers_instead() -> None:
    scene = Scene("s", FIRST, supports=(Clamped("left"), SymmetryPlane("bottom", (0, 1, 1))))
    model = Model(scene, MPI.COMM_WORLD)
    planes = [b for b in model.bodies if "mu" in b.mixed.dofs]
    assert [len(b.mixed.dofs["mu"]) for b in planes] == [4, 4]


@pytest.mark.parametrize(
    ("section", "rotary", "terms"),
    [
        (SECTION, True, (False, False, True)),
        (SECTION, False, (False, False, False)),
        (replace(SECTION, offset=0.02), True, (True, True, True)),
    ],
)
def test_an_effect_that_is_off_costs_nothing(
    section: Isotropic, rotary: bool, terms: tuple[bool, bool, bool]
) -> None:
    """No coupling, no first moment, no rotary inertia: no Constant for them in any form."""
    shell = replace(FIRST, section=section, rotary_inertia=rotary)
    scene = Scene("s", shell, scheme="ep", dt=0.1, t_end=1.0)
    body = Model(scene, MPI.COMM_WORLD).shells["first"]
    assert body.mass is not None
    found = (body.section.formulation.B, body.mass.s, body.mass.I)
    assert tuple(item is not None for item in found) == terms


def test_statics_has_no_mass() -> None:
    body = Model(Scene("s", FIRST, supports=Clamped("left")), MPI.COMM_WORLD).shells["first"]
    assert body.mass is None
    assert kinetic_energy(body, body.director) is None
