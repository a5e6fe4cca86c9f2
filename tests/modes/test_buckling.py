"""Linear buckling beside closed forms, other loads and meshes, and the path of equilibria."""

import math
from dataclasses import replace
from typing import Any

from mpi4py import MPI

import numpy as np
import pytest

import shellmb as sm
from shellmb.demos.verification.problems.linear_shells import compressed_plate
from shellmb.errors import ConvergenceError, SceneError
from shellmb.show.space.display import why_not
from shellmb.simulate.buckling import linear_buckling

E, SIDE = 70e9, 0.01


def column(force: Any, **more: Any) -> sm.Scene:
    """A clamped column of a square section, pushed at its end."""
    section = sm.RectangularSection(E=E, nu=0.3, width=2 * SIDE, height=SIDE)
    beam = sm.Beam("column", sm.Line((0, 0, 0), (1, 0, 0)), section, elements=3)
    return sm.Scene(
        "column",
        beams=beam,
        supports=sm.Clamped("start"),
        loads=sm.PointForce("end", force),
        **more,
    )


EULER = math.pi**2 / 4 * E * 2 * SIDE**4 / 12


@pytest.mark.parametrize("size", [1e-3, 1.0, -1.0])
def test_factors_scale_with_the_load(size: float) -> None:
    """A force of half the size has twice the factor; pulled, it buckles under the opposite load."""
    load = size * EULER
    if size < 0:
        with pytest.raises(ConvergenceError, match="0 of 1 positive load factors"):
            linear_buckling(column((-load, 0, 0)), MPI.COMM_WORLD, 1)
        return
    found = linear_buckling(column((-load, 0, 0)), MPI.COMM_WORLD, 2)
    # shear and stretching before it buckles: a few SIDE^2
    np.testing.assert_allclose(found.factors * size, [1.0, 4.0], rtol=1e-3)


def test_a_path_bifurcates_at_the_factor() -> None:
    """A plate whose displacements before buckling are small, by path following."""
    scene, _ = compressed_plate("quad", 100.0, 4)
    factor = linear_buckling(scene, MPI.COMM_WORLD, 1).factors[0]
    path = sm.PathFollowing(branches="detect", load_end=1.1 * factor)
    run = sm.run(replace(scene, scheme="static", path=path, dt=1.0, t_end=100.0))
    (point,) = run.summary["path"]
    # strains before buckling are (h/a)^2
    assert point["load_factor"] == pytest.approx(factor, rel=1e-3)


def test_a_plate_in_shear_buckles_under_either_sign() -> None:
    """By symmetry the negative factor nearest to zero is the first positive one; others follow."""
    edges = (("left", (0, -1, 0)), ("right", (0, 1, 0)), ("bottom", (-1, 0, 0)), ("top", (1, 0, 0)))
    metal = sm.Isotropic(E=E, nu=0.3, thickness=0.01)
    scene = sm.Scene(
        "shear",
        sm.Shell("plate", sm.Rectangle(1.0, 1.0), metal, mesh=(4, 4)),
        supports=[
            *(sm.Fixed(edge, displacement=(None, None, 0.0)) for edge, _ in edges),
            sm.Fixed((0.0, 0.0, 0.0), displacement=(0.0, 0.0, None)),
            sm.Fixed((1.0, 0.0, 0.0), displacement=(None, 0.0, None)),
        ],
        loads=[sm.EdgeForce(edge, force) for edge, force in edges],
    )
    found = sm.modes(scene, count=2, buckling=True, pictures=False)
    # pairs of both signs, farther and farther from zero
    assert found.load_factors[1] > 1.05 * found.load_factors[0]
    negative = found.summary["negative_load_factor"]
    assert negative == pytest.approx(-found.load_factors[0], rel=1e-6)
    # Timoshenko and Gere, Theory of Elastic Stability (1961), table 9-10: 9.34 pi^2 D/b^2
    exact = 9.34 * math.pi**2 * E * 0.01**3 / (12 * (1 - 0.3**2))
    assert found.load_factors[0] == pytest.approx(exact, rel=0.05)


def test_buckling_is_written_drawn_and_read_back(tmp_path) -> None:  # type: ignore[no-untyped-def]
    """Directories of modes of any kind are drawn as such: these were taken for those of runs."""
    found = sm.modes(column((-EULER, 0, 0)), tmp_path / "b", 2, buckling=True)
    assert (tmp_path / "b" / "modes.png").is_file() == (why_not() is None)
    again = sm.load(tmp_path / "b")
    assert isinstance(again, sm.ModeShapes)
    assert found.load_factors == again.load_factors and len(found.load_factors) == 2
    assert again.captions[0].startswith("load factor 1") and "buckling modes" in repr(again)
    shape = again.fields["column"]["displacement"].sel(mode=1).values
    # its largest displacement is one, at the end, to the weak side
    assert np.max(np.abs(shape)) == pytest.approx(1.0) and abs(shape[:, 2]).max() == 1.0


def pinned(end: sm.scene.Joint, **more: Any) -> sm.Scene:
    """A column on a joint at its start, which is guided along itself at its end."""
    guided = sm.Fixed("end", displacement=(None, 0.0, 0.0))
    scene = column((-EULER, 0, 0), joints=end, **more)
    return replace(scene, supports=guided)


@pytest.mark.parametrize("weak", [False, True])
def test_columns_with_pins_buckle_as_euler_says(weak: bool) -> None:
    """Free motions are named, and what the error says of them works: joints, or weak springs."""
    free = sm.Spherical("pin", sm.GROUND, "column", at=(0, 0, 0))
    with pytest.raises(SceneError, match=r"'column' can turn about x .*; hold them .*Universal"):
        linear_buckling(pinned(free), MPI.COMM_WORLD, 1)
    axes = {"axis": (0, 1, 0), "second_axis": (0, 0, 1)}
    pin: Any = sm.Universal("pin", sm.GROUND, "column", at=(0, 0, 0), **axes)
    exact, scene = 4.0, pinned(pin)
    if weak:
        # a link that hardly anything holds falls at `k/L`
        pin = sm.Revolute("pin", sm.GROUND, "column", at=(0, 0, 0), axis=(0, 1, 0))
        spring, exact = sm.JointSpring("spring", "pin", stiffness=1e-3), 1e-3 / EULER
        scene = column((-EULER, 0, 0), joints=pin, force_elements=spring)
        scene = replace(scene, supports=())
    found = linear_buckling(scene, MPI.COMM_WORLD, 1)
    # three elements to a half wave
    np.testing.assert_allclose(found.factors, exact, rtol=4e-3)


def test_bad_input_gets_a_sentence() -> None:
    free = replace(column((1.0, 0, 0)), loads=())
    with pytest.raises(SceneError, match="the scene has no load"):
        linear_buckling(free, MPI.COMM_WORLD, 1)
    with pytest.raises(SceneError, match="count is 0"):
        linear_buckling(column((1.0, 0, 0)), MPI.COMM_WORLD, 0)
    with pytest.raises(SceneError, match="buckling is about the reference; loaded"):
        sm.modes(column((1.0, 0, 0)), buckling=True, loaded=True)
    dome = sm.Shell("dome", sm.Sphere(1.0), sm.Isotropic(E=1e3, nu=0.3, thickness=0.02))
    volume = sm.EnclosedVolume("oil", change=lambda t: -t)
    filled = sm.Scene("dome", dome, supports=sm.Clamped("top"), volumes=volume)
    with pytest.raises(
        SceneError, match=r"buckling: .* cannot have; follow its path .*volume 'oil'"
    ):
        sm.modes(filled, buckling=True)
    # of load factors none are estimated
    with pytest.raises(SceneError, match="errors are estimated of natural modes at rest only"):
        sm.modes(column((1.0, 0, 0)), buckling=True, errors=True)
