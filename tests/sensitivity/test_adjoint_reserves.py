"""Sweeps backwards of numbers that reserve factors enter, beside tangents.

Kind: what is read of a step, and not of a state: means over it, at places that change.
"""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import shellmb as sm
from tests.observers.test_held_plies import cooled
from tests.observers.test_reserves import CARBON, blade

TIGHT: dict[str, Any] = {"newton": "full", "newton_tolerance": 1e-11}
NAMES = ("r", "i", "w", "tip")
QUIET = [pytest.param(s, marks=pytest.mark.slow) for s in ("ed", "ep4", "ed3")]
PRONY = sm.Prony([(0.3, 1e-3)])


def make(
    scheme="ep", thickness=0.5e-3, push=1.0, E1=138e9, X=2e9, cool=0.0, relaxation=None, cell="quad"
) -> sm.Scene:
    """A blade that is hit; all of its strengths, plies and loads may be parameters."""
    reserves = [
        sm.Reserve("r", "hashin"),
        sm.Reserve("i", "interlaminar"),
        sm.Reserve("w", "tsai-wu", where=lambda x: x[0] > 0.1),
    ]
    scene = blade(scheme, reserves=reserves, probes=sm.Probe("tip", "right-top"))
    strength = replace(CARBON.strength, Xt=X)
    material = replace(CARBON, E1=E1, strength=strength, relaxation=relaxation)
    skin = sm.Laminate.from_stacking(material, thickness, "[30/-45/90]s")
    load = replace(scene.loads[0], force=tuple(push * f for f in scene.loads[0].force))
    natural = cooled(skin, by=cool) if cool else None
    shell = replace(scene.shells[0], section=skin, natural=natural, cell=cell)
    more: dict[str, Any] = {} if scheme == "static" else {"t_end": 1e-3}
    if scheme in ("ed", "ed3"):
        more["alpha"] = 1.0
    if natural and more:
        more["start"] = "equilibrium"
    return replace(scene, shells=shell, loads=load, **more)


def number(history: Any) -> float:
    r, i, w, tip = (history[name] for name in NAMES)
    return float(np.sum(r**2) + 30 * np.sum(i) + np.sum(w**3) + w[-1] + 100 * np.sum(tip**2))


def by_tangents(scene: Any, names: tuple[str, ...]) -> dict[str, float]:
    found = sm.sensitivities(scene, names, columns="probes", **TIGHT)
    r, i, w, tip = (found.run.history[name].to_numpy() for name in NAMES)
    slopes = 2 * r, 30 + 0 * i, 3 * w**2 + np.eye(len(w))[-1], 200 * tip
    pairs = [*zip(NAMES, slopes, strict=True)]
    return {
        name: sum(float(slope @ found.history[name][k].to_numpy()) for k, slope in pairs)
        for name in names
    }


def assert_as_tangents(scene: Any, *names: str, within: float = 1e-8) -> None:
    wanted = by_tangents(scene, names)
    found = sm.adjoint(scene, number, parameters=names, **TIGHT).parameters
    for name in names:
        assert found[name] == pytest.approx(wanted[name], rel=within), name
        assert wanted[name]


@pytest.mark.parametrize("scheme", ["static", "ep", *QUIET])
def test_reserves_backwards_are_their_tangents(scheme: str) -> None:
    def scene(thickness=0.5e-3, push=1.0, E1=138e9, X=2e9) -> sm.Scene:
        return make(scheme, thickness, push, E1, X)

    assert_as_tangents(scene, "thickness", "push", "E1", "X")


@pytest.mark.parametrize("scheme", ["static", pytest.param("ep", marks=pytest.mark.slow)])
def test_plies_with_natural_strains(scheme: str) -> None:
    """From an equilibrium, too, whose stresses depend on parameters."""

    def scene(cool=-100.0, thickness=0.5e-3) -> sm.Scene:
        return make(scheme, thickness, cool=cool)

    assert_as_tangents(scene, "cool", "thickness", within=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["ep", "ed3"])
def test_plies_that_relax(scheme: str) -> None:
    def scene(thickness=0.5e-3, E1=138e9) -> sm.Scene:
        return make(scheme, thickness, E1=E1, relaxation=PRONY, cell="tri")

    assert_as_tangents(scene, "thickness", "E1")


@pytest.mark.parametrize("scheme", ["static", pytest.param("ed3", marks=pytest.mark.slow)])
def test_fields_add_up_to_the_parameter(scheme: str) -> None:
    """Of thicknesses and angles, which plies have at nodes, too; steps are solved again."""

    def scene(thickness=0.5e-3, angle=-45.0) -> sm.Scene:
        given = make(scheme)
        plies = list(given.shells[0].section.plies)
        plies[0] = replace(plies[0], thickness=thickness)
        plies[1] = replace(plies[1], angle=angle)
        section = replace(given.shells[0].section, plies=plies)
        return replace(given, shells=replace(given.shells[0], section=section))

    fields = [("blade", "plies[0].thickness"), ("blade", "plies[1].angle")]
    found = sm.adjoint(scene, number, fields, states=3, **TIGHT).fields
    wanted = by_tangents(scene, ("thickness", "angle"))
    for field, name in zip(fields, wanted, strict=True):
        assert found[field].derivative.sum() == pytest.approx(wanted[name], rel=1e-7), name


@pytest.mark.mpi
def test_two_ranks_find_the_same(mpirun: Callable[..., str]) -> None:
    """Places are of one rank, and resultants around them of both."""
    root = str(Path(__file__).parents[2])
    code = (
        f"import sys; sys.path.insert(0, {root!r})\n"
        "import json\nfrom mpi4py import MPI\nimport shellmb as sm\n"
        "from tests.sensitivity import test_adjoint_reserves as t\n"
        "found = sm.adjoint(lambda E1=138e9: t.make('ep', E1=E1), t.number,\n"
        "    [('blade', 'plies[0].angle')], ('E1',), **t.TIGHT)\n"
        "table = found.fields['blade', 'plies[0].angle'].derivative.to_list()\n"
        "MPI.COMM_WORLD.rank or print(json.dumps([found.parameters['E1'], *table]))"
    )
    one, two = (np.array(json.loads(mpirun(n, "-c", code))) for n in (1, 2))
    np.testing.assert_allclose(two[0], one[0], rtol=1e-8)
    np.testing.assert_allclose(two[1:], one[1:], atol=1e-8 * np.abs(one[1:]).max())


def test_what_cannot_go_backwards_is_said() -> None:
    scene = make()
    modal = replace(scene, shells=replace(scene.shells[0], model=sm.Modal(modes=4)))
    bare = replace(scene, probes=(), reserves=())
    for given, says in (
        (modal, "reserve 'r' is of shell 'blade', which is reduced to modes; leave it out"),
        (bare, "scene 'blade' has no probe and no reserve; the objective is a function of these"),
    ):
        with pytest.raises(sm.SceneError, match=f"adjoint: {says}"):
            sm.adjoint(lambda given=given: given, number, [("blade", "plies[0].angle")])
