"""Grids, chains of references, and what cannot be asked."""

from types import ModuleType

import pytest

from shellmb.accuracy.studies.choice import Base, Choice
from shellmb.accuracy.studies.quantity import parse_quantity
from shellmb.accuracy.studies.sweep import (
    Sweep,
    chain,
    make_grid,
    not_refined,
    sweep_of,
    usual_axes,
)
from shellmb.demos.studies.bundled import BUNDLED, find_bundled
from shellmb.errors import SceneError
from shellmb.running.loader import SceneModule
from shellmb.scene import Clamped, GmshFile, Isotropic, Scene, Shell

from .conftest import SMALL


def grid(**chosen):
    sweep = Sweep(Base(SMALL), **chosen)
    return sweep, make_grid(sweep)


def test_alpha_belongs_to_ed_only():
    _, found = grid(scheme=("ep", "ed"), alpha=(0.0, 1.0), dt=(1e-3, 5e-4))
    pairs = {(c.scheme, c.alpha) for c in found.choices}
    assert pairs == {("ep", None), ("ed", 0.0), ("ed", 1.0)}
    assert len(found.choices) == 6
    assert found.swept == ("scheme", "alpha", "dt")
    assert [c.label(("scheme", "dt")) for c in found.choices[:2]] == [
        "EP, dt = 0.001 s",
        "EP, dt = 0.0005 s",
    ]


def test_what_the_scene_chooses_is_known():
    _, found = grid()
    (only,) = found.choices
    assert only == Choice(
        scheme="ep",
        cell="quad",
        degree=2,
        solve="reduced",
        newton_tolerance=1e-9,
        mesh=(6, 2),
        dt=1e-3,
    )
    assert Choice.from_dict(only.to_dict()) == only
    # a record may be older than the name
    former = {**only.without("newton_tolerance").to_dict(), "tolerance": 1e-9}
    assert Choice.from_dict(former) == only


def test_impossible_combinations_are_left_out_with_their_reason():
    _, found = grid(cell=("quad", "tri"), degree=(2, 3))
    assert [(c.cell, c.degree) for c in found.choices] == [("quad", 2), ("tri", 2), ("quad", 3)]
    ((choice, reason),) = found.left_out
    assert (choice.cell, choice.degree) == ("tri", 3)
    assert "must be 2 on triangles" in reason


@pytest.mark.parametrize(
    ("chosen", "message"),
    [
        ({"degree": (2, 1)}, "degree is 1"),
        ({"alpha": (0.0, 2.0), "scheme": ("ed",)}, "alpha is 2"),
        ({"alpha": (0.0, 1.0)}, "where no scheme is 'ed'"),
        ({"mesh": ((0, 1), (2, 1))}, "mesh"),
        ({"repeat": 0}, "repeat is 0; it must be at least 1"),
        ({"refine": 1}, "refine is 1; it must be at least 2"),
        ({"exact": 1.0}, "exact is 1"),
        ({"exact": 1.0, "quantities": (parse_quantity("tip_z:l2"),)}, "must be a number"),
    ],
)
def test_impossible_values_are_errors(chosen, message):
    with pytest.raises(SceneError, match=message):
        grid(**chosen)


def test_the_reference_is_finer_in_all_that_is_swept():
    sweep, found = grid(
        scheme=("ep", "ed"), alpha=(0.5, 0.0), mesh=((4, 2), (8, 2)), dt=(1e-3, 5e-4)
    )
    fine, middle, coarse = chain(sweep, found)
    assert (fine.scheme, fine.alpha) == ("ed", 0.0)
    # the second count is the same in both meshes: no error of it is asked for
    assert [(c.mesh, c.dt) for c in (fine, middle, coarse)] == [
        ((16, 2), 2.5e-4),
        ((8, 2), 5e-4),
        ((4, 2), 1e-3),
    ]


def test_the_reference_of_other_sweeps():
    sweep, found = grid(mesh=((3, 1), (5, 2)))
    assert [c.mesh for c in chain(sweep, found)] == [(10, 4), (5, 2)], "5 cannot be halved"
    sweep, found = grid(solve=("full", "reduced"))
    assert [(c.dt, c.solve) for c in chain(sweep, found)] == [
        (5e-4, "reduced"),
        (1e-3, "reduced"),
        (2e-3, "reduced"),
    ]
    sweep, found = grid(scheme=("static",), degree=(2, 3))
    assert [(c.mesh, c.degree) for c in chain(sweep, found)] == [
        ((12, 4), 3),
        ((6, 2), 3),
        ((3, 1), 3),
    ]
    sweep, found = grid(scheme=("ep", "ed"), reference="ep")
    assert chain(sweep, found)[0].scheme == "ep"
    # the scheme of the highest order, where it is there
    sweep, found = grid(scheme=("ep", "ed", "ep4", "ed3"), alpha=(0.0, 1.0))
    assert chain(sweep, found)[0].scheme == "ep4"
    sweep, found = grid(scheme=("ep",), reference="ed")
    # or one that no other run has
    assert next((c.scheme, c.dt) for c in chain(sweep, found)) == ("ed", 5e-4)
    sweep, found = grid(scheme=("ep",), reference="rk4")
    with pytest.raises(SceneError, match="reference is 'rk4': scene 'small': scheme is 'rk4'"):
        chain(sweep, found)


def test_what_is_not_refined_is_named():
    def told(**axes):
        sweep, found = grid(**axes)
        return not_refined(sweep, found, () if sweep.known else chain(sweep, found))

    assert told(dt=(1e-3, 5e-4)) == ("the mesh (6x2 in all runs)",)
    assert told(mesh=((3, 1), (6, 2))) == ("the step (dt = 0.001 s in all runs)",)
    one = told(mesh=((3, 2), (6, 2)), dt=(1e-3, 5e-4))
    assert one == ("elements along the second side of the mesh (2 in all runs)",)
    assert told(mesh=((3, 1), (6, 2)), dt=(1e-3, 5e-4)) == ()
    assert told(divide=(1, 2), dt=(1e-3, 5e-4)) == ()
    assert told(divide=(2,), dt=(1e-3, 5e-4)) == ("the mesh (mesh divided by 2 in all runs)",)
    # load steps of statics are no error
    assert told(scheme=("static",), mesh=((3, 1), (6, 2))) == ()
    exact = {"exact": 1.0, "quantities": (parse_quantity("tip_z:end"),)}
    assert told(dt=(1e-3, 5e-4), **exact) == (), "an exact value knows of the mesh, too"


def test_single_bodies_can_be_refined():
    base = Base("lateral_buckling", body="plate")
    scene = base.build(Choice(mesh=(3, 1)))
    assert scene.shells[0].mesh == (3, 1)
    beam = Base("lateral_buckling", (("model", "beam"),), body="plate")
    assert beam.build(Choice(mesh=(2, 1))).beams[0].elements == 2
    with pytest.raises(SceneError, match="body is 'plat'; it must be one of the scene's shells"):
        Base("lateral_buckling", body="plat").build(Choice(degree=3))


@pytest.mark.parametrize("body", [None, "wing"])
def test_a_mesh_from_a_file_is_no_choice(body, tmp_path):
    file = tmp_path / "wing.msh"
    file.write_text("$MeshFormat")
    wing = Shell("wing", GmshFile(file), Isotropic(1.0, 0.3, thickness=0.01, density=1.0))
    source = ModuleType("wing")
    source.scene = lambda: Scene("wing", wing, supports=Clamped("root"))
    module = SceneModule("wing", source)
    base = Base(module, body=body)
    complete = base.complete(Choice(newton_tolerance=1e-6))
    assert (complete.mesh, complete.divide, complete.degree) == (None, 1, 2)
    assert base.build(Choice(divide=3)).shells[0].surface.refine == 3
    assert base.build(complete).solver.tolerance == 1e-6
    with pytest.raises(SceneError, match="mesh is read from a file"):
        base.build(Choice(mesh=(2, 2)))


@pytest.mark.parametrize("study", BUNDLED, ids=lambda b: b.name)
def test_bundled_studies_are_possible(study):
    assert find_bundled(study.name) == (study,)
    for part in study.parts:
        found = make_grid(part.sweep)
        assert len(found.swept) >= 2
        if part.sweep.exact is None:
            finer = chain(part.sweep, found)
            assert len(finer) == 3, "three runs tell how well the reference is known"
            for choice in finer:
                part.sweep.base.build(choice)


def test_unknown_bundled_study():
    assert find_bundled("all") == BUNDLED
    with pytest.raises(SceneError, match="bundled is 'statics'; it must be 'all' or one of"):
        find_bundled("statics")


def test_a_study_without_options_refines_mesh_and_step():
    """The kind: no offer leaves out an error that nobody has asked to leave out."""
    sweep = sweep_of(SMALL, {})
    found = make_grid(sweep)
    assert set(found.values("mesh")) == {(3, 1), (6, 2), (12, 4)}
    assert set(found.values("dt")) == {2e-3, 1e-3, 5e-4}
    finer = chain(sweep, found)
    assert (finer[0].mesh, finer[0].dt) == ((24, 8), 2.5e-4)
    assert not_refined(sweep, found, finer) == ()
    assert sweep.repeat == 1
    # rigid bodies have no mesh, statics have no step, a beam has one count
    assert set(usual_axes(Base("heavy_top"))) == {"repeat", "dt"}
    assert set(usual_axes(Base("loaded_plate"))) == {"repeat", "mesh"}
    assert usual_axes(Base("spin_up_beam"))["mesh"] == ((2, 1), (4, 1), (8, 1))
    # what is named is all that is swept
    assert make_grid(sweep_of(SMALL, {}, scheme=("ep", "ed"))).swept == (
        "scheme",
        "alpha",
    )
