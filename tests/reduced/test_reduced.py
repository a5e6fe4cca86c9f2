"""Bodies in modes against the full ones: frequencies, free flight, joints, and what they refuse."""

from dataclasses import replace
from functools import cache, partial
from typing import Any

from mpi4py import MPI

import numpy as np
import pytest

from shellmb.errors import SceneError
from shellmb.preprocessing.modal.reduce import reduce_bodies
from shellmb.running.execute import execute
from shellmb.running.natural_modes.vibration import natural_modes
from shellmb.scene import (
    AlongEdge,
    Beam,
    Clamped,
    Glue,
    Gravity,
    InitialVelocity,
    Isotropic,
    Join,
    Line,
    Modal,
    PointForce,
    Probe,
    Rectangle,
    RectangularSection,
    Scene,
    Shell,
    Weld,
)
from tests import scenes
from tests.reduced.conftest import Kept, kept

PLATE = Isotropic(E=70e9, nu=0.3, thickness=5e-3, density=2700.0)
BAR = RectangularSection(E=70e9, nu=0.3, width=0.01, height=0.02, density=2700.0)
CORNER = (1.0, 0.4, 0.0)
# kernels depend on the number of modes. Both have seven: to the eight come six of the pushed
# corner, less six of the body, less the one about the director, which nothing resists
MODAL, FREE = Modal(modes=8), Modal(modes=7)
SLOW = pytest.mark.slow
SCHEMES = [
    ("ep", 0.0),
    *(pytest.param(*pair, marks=SLOW) for pair in (("ed", 1.0), ("ep4", 0.0), ("ed3", 0.5))),
]


plate = partial(scenes.plate, PLATE, (1.0, 0.4), mesh=(4, 2), model=MODAL)


def thrown(t: float) -> float:
    """A push at a corner, over after 0.05 s."""
    return float(np.sin(np.pi * t / 0.05) ** 2) if t < 0.05 else 0.0


@cache
def tumbling(model: Any, scheme: str = "ep4", alpha: float = 0.0) -> Kept:
    """A plate in flight that is pushed at a corner as it spins."""
    probes = [Probe(f"{q}_{k}", CORNER, q, k) for q in ("position", "velocity") for k in range(3)]
    spin = InitialVelocity((1.0, 0.0, 0.0), (3.0, 1.0, 2.0), (0.5, 0.2, 0.0))
    push = PointForce(CORNER, (0.0, 0.0, 20.0), time=thrown)
    motion = {"initial": spin, "loads": (push, Gravity()), "probes": probes}
    times = {"scheme": scheme, "alpha": alpha, "dt": 5e-3, "t_end": 0.1}
    return kept(Scene("tumbling", plate(model=model), **motion, **times))


@pytest.mark.parametrize("held", [False, pytest.param(True, marks=SLOW)])
def test_modes_are_those_of_the_full_body(held) -> None:
    """A body in all of the modes that are asked for has them exactly: round-off of eigenvalues."""
    more = (
        {"joints": Weld("bolts", "ground", "plate", at=(0, 0.2, 0), second_at="left")}
        if held
        else {}
    )
    found = [
        natural_modes(
            Scene("modes", plate(model=model), scheme="ep", dt=1, t_end=1, **more),
            count=7 if held else 13,
        )
        for model in ("exact", FREE)
    ]
    assert found[0].rigid == found[1].rigid == (0 if held else 6)
    elastic = slice(found[0].rigid, None)
    assert np.allclose(found[1].omega[elastic], found[0].omega[elastic], rtol=1e-6, atol=0)
    if not held:
        # shapes at the nodes, which are rebuilt from frame and amplitudes, up to a sign
        one, other = (modes.shapes[7]["plate"] for modes in found)
        assert min(np.abs(one - other).max(), np.abs(one + other).max()) < 1e-5


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_every_scheme_keeps_its_laws(scheme, alpha) -> None:
    summary = tumbling(MODAL, scheme, alpha).summary
    assert summary["energy_balance_error"] < 1e-12
    assert summary["constraint_max"] < 1e-12
    assert summary["linear_momentum_drift"] < 1e-12
    # EP keeps it; ED, EP4 and ED3 to their order, with 0.02 rad in a step
    bound = {"ep": 1e-12, "ed": 1e-3, "ep4": 1e-6, "ed3": 1e-5}[scheme]
    assert summary["angular_momentum_drift"] < bound


@SLOW
def test_moves_as_the_full_body_does() -> None:
    """It bends by 6 mm, 1 % of its size: the square of that, and what eight modes leave out."""
    exact, modal = (tumbling(model).history for model in ("exact", MODAL))
    rigid = tumbling("rigid").history
    for quantity, bound in (("position", 2e-4), ("velocity", 2e-2)):
        names = [f"{quantity}_{k}" for k in range(3)]
        apart, bends = (
            np.abs(other[names] - exact[names]).to_numpy().max() for other in (modal, rigid)
        )
        assert apart < bound
        # flexibility matters, and all but a few per cent of it is there
        assert bends > 10 * apart


@SLOW
def test_shells_and_beams_that_share_edges_are_one_body() -> None:
    """Frequencies of a plate with a flange and a stiffener, the one word given twice."""

    def scene(model: Any) -> Scene:
        flange = Shell(
            "flange",
            Rectangle(1.0, 0.2, (0, 0.4, 0), axis2=(0, 0, 1)),
            PLATE,
            mesh=(4, 1),
            model=model,
        )
        rib = Beam("rib", AlongEdge("plate", "bottom"), BAR)
        joined = Join("plate", "flange", "top", "bottom")
        glued = Glue("rib", "plate")
        return Scene(
            "stiffened",
            (plate(model=model), flange),
            beams=rib,
            joins=joined,
            glues=glued,
            scheme="ep",
            dt=1,
            t_end=1,
        )

    exact, modal = (natural_modes(scene(m), count=10).omega for m in ("exact", Modal(modes=6)))
    assert np.allclose(modal[6:], exact[6:], rtol=1e-6, atol=0)


def test_probes_of_shells_that_are_reduced_together() -> None:
    """The scene of the model has the first of them alone: the second falls as fast."""
    other = plate("other", surface=Rectangle(1.0, 0.4, (1.0, 0.0, 0.0)))
    corners = {"plate": (0.0, 0.4, 0.0), "other": (2.0, 0.4, 0.0)}
    scene = Scene(
        "falling",
        (plate(), other),
        joins=Join("plate", "other", "right", "left"),
        loads=Gravity(),
        probes=[Probe(name, at, "position", 2, body=name) for name, at in corners.items()],
        scheme="ep",
        dt=0.01,
        t_end=0.02,
    )
    fallen = kept(scene).history[[*corners]].iloc[-1]
    assert fallen.to_numpy() == pytest.approx(-9.81 * 0.02**2 / 2, rel=1e-8)


@SLOW
def test_torsion_of_a_straight_beam_moves_no_point_of_it() -> None:
    """And is a mode nevertheless: a cantilever with a place for a load at its tip."""

    def scene(model: Any) -> Scene:
        beam = Beam("bar", Line((0, 0, 0), (1, 0, 0)), BAR, elements=6, model=model)
        root = Weld("root", "ground", "bar", at=(0, 0, 0))
        tip = PointForce((1, 0, 0), (0, 0, 1.0))
        return Scene("bar", beams=beam, joints=root, loads=tip, scheme="ep", dt=1, t_end=1)

    exact, modal = (natural_modes(scene(m), count=6).omega for m in ("exact", Modal(modes=6)))
    # modes with the tip held converge with the fourth power of their number
    assert np.allclose(modal, exact, rtol=2e-3, atol=0)
    # what the watch compares spins with is a frequency of the cantilever
    (data,) = natural_modes(scene(Modal(modes=6)), count=1).model.modal
    assert data.clamped == pytest.approx(exact[0], rel=1e-4)


@SLOW
def test_statics_knows_modes_too() -> None:
    """A cantilever under a force at its tip: the attachment's static modes make it exact."""

    def tip(model: Any) -> float:
        scene = Scene(
            "cantilever",
            plate(model=model),
            joints=Weld("bolts", "ground", "plate", at=(0, 0.2, 0), second_at="left"),
            loads=PointForce(CORNER, (0, 0, 0.05)),
            probes=Probe("tip", CORNER),
            scheme="static",
            dt=1.0,
        )
        return float(execute(scene).history["tip"].iloc[-1])

    # 1 mm: the square of the slope is 1e-6
    assert tip(Modal(modes=3)) == pytest.approx(tip("exact"), rel=1e-4)


BAD = {
    "join of 'plate' and 'other': their models are Modal(8) and 'exact'; what is reduced to modes "
    "and shares an edge is one body: both must have the same Modal(...), or be connected by "
    "joints": {
        "shells": (plate(), replace(plate(model="exact"), name="other")),
        "joins": Join("plate", "other", "left", "left"),
    },
    "shell 'plate' is reduced to modes and has no mass, by which these are found, in statics too; "
    "give its section a density": {
        "shells": replace(plate(), section=replace(PLATE, density=0.0)),
        "supports": Clamped("left"),
        "scheme": "static",
    },
}


@pytest.mark.parametrize("message", BAD)
def test_what_it_cannot_have_is_refused(message) -> None:
    given = {"shells": plate(), "scheme": "ep", "dt": 1.0, "t_end": 1.0} | BAD[message]
    with pytest.raises(SceneError) as caught:
        Scene("bad", **given)
    assert str(caught.value) == message


def test_places_that_share_nodes_move_together_or_are_refused() -> None:
    """A corner of a clamped edge is held with it; two welded ones with one in common cannot be."""
    load = PointForce((0.0, 0.4, 0.0), (0, 0, 1.0))
    scene = Scene("held", plate(), supports=Clamped("left"), loads=load, scheme="ep", dt=1, t_end=1)
    (data,) = natural_modes(scene, count=1).model.modal
    assert len(data.interfaces) == 1
    with pytest.raises(SceneError) as caught:
        welds = [
            Weld(at, "ground", "plate", at=(0, 0, 0), second_at=at) for at in ("left", "bottom")
        ]
        natural_modes(replace(scene, supports=(), joints=welds), count=1)
    assert str(caught.value) == (
        "weld 'bottom': shell 'plate' is reduced to modes, and 'bottom' shares nodes with 'left', "
        "where something is attached, too; both move as one rigid frame: attach to one of them, "
        "or the model must be 'exact'"
    )


def test_what_is_off_is_not_there() -> None:
    """No unknown and no form of damping, loads and contacts that nobody asked for."""
    scene = Scene("free", plate(model=FREE), scheme="ep", dt=1, t_end=1)
    model = natural_modes(scene, count=1).model
    names = {body.name for body in model.bodies}
    assert names == {"rigid bodies", "modes of plate", "inertia of plate"}
    assert all(body.damping is None for body in model.bodies)
    (data,) = model.modal
    assert data.count == 7


def test_a_frame_that_turns_alone_is_no_mode() -> None:
    """About the director of a single node; its round-off was one, with more modes beside it."""

    def clamped(count: int) -> float:
        load = PointForce((0.0, 0.2, 0.0), (0, 0, 1.0))
        shell = replace(plate(model=Modal(modes=count)), mesh=(4, 4))
        scene = Scene("hung", shell, loads=load, scheme="ep", dt=1, t_end=1)
        _, (data,) = reduce_bodies(scene, MPI.COMM_WORLD)
        # five static modes of the frame, less six rigid motions: that about the director is one of
        # the modes with the frame held
        assert data.count == count - 1
        return data.clamped

    assert clamped(20) == pytest.approx(clamped(6), rel=0.05)
