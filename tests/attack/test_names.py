"""Names that become files and columns are refused before anything is built."""

import itertools
import re
from dataclasses import replace
from functools import partial

import pytest

from shellmb.errors import SceneError
from shellmb.scene import (
    Beam,
    Clamped,
    Isotropic,
    Line,
    Probe,
    Rectangle,
    RectangularSection,
    RigidBody,
    Scene,
    Shell,
    Spring,
)
from tests.sentences import refusal

STEEL = Isotropic(E=2e11, nu=0.3, thickness=0.01, density=7800.0)
BAR = RectangularSection(7e10, 0.3, width=0.02, height=0.01, density=2700.0)


def shell(name: str) -> Scene:
    return Scene("s", Shell(name, Rectangle(2, 1), STEEL), supports=Clamped("left", body=name))


def probe(name: str) -> Scene:
    plate = Shell("plate", Rectangle(2, 1), STEEL)
    return Scene("s", plate, supports=Clamped("left"), probes=Probe(name, "right-top"))


def beam(name: str) -> Scene:
    return Scene("s", beams=Beam(name, Line((0, 0, 0), (1, 0, 0)), BAR), supports=Clamped("start"))


def body(name: str) -> Scene:
    return Scene("s", rigid_bodies=RigidBody(name, 1.0, (1, 1, 1)), scheme="ep", dt=1, t_end=2)


def spring(name: str) -> Scene:
    arm = RigidBody("arm", 1.0, (1, 1, 1))
    pull = Spring(name, "ground", "arm", (0, 0, 1), (0, 0, 0), stiffness=1.0)
    return Scene("s", rigid_bodies=arm, force_elements=pull, scheme="ep", dt=1, t_end=2)


def scene(name: str) -> Scene:
    return replace(body("arm"), name=name)


MADE = {
    "scene": scene,
    "shell": shell,
    "probe": probe,
    "beam": beam,
    "rigid body": body,
    "spring": spring,
}
BAD = {
    "../../evil": "with / in it",
    "a\\b": r"with \\ in it",
    "tip, z": "with , in it",
    'say "z"': 'with " in it',
    "two\nlines": "cannot be printed",
    " z": "with a space at its end",
    "  ": "of spaces only",
    ".hidden": "with a dot at its beginning",
    "x" * 300: "of 300 bytes",
}


def test_bad_names_are_refused() -> None:
    found = {}
    for (kind, make), (name, why) in itertools.product(MADE.items(), BAD.items()):
        said = refusal(partial(make, name))
        if not re.match(rf"{kind}: name is .*{why}", said):
            found[kind, name] = said
    assert not found


def test_good_names_are_not() -> None:
    good = ("plate", "upper flange", "δ-2 (left)", "a.b", "B+1")
    found = {
        said for make in MADE.values() for name in good if (said := refusal(partial(make, name)))
    }
    assert not found


@pytest.mark.parametrize("name", ["rigid bodies", "rigid_bodies", "joints"])
def test_files_of_the_run_are_reserved(name: str) -> None:
    with pytest.raises(SceneError, match="its files would be called"):
        shell(name)


def test_two_bodies_do_not_share_files() -> None:
    plates = [Shell(name, Rectangle(2, 1), STEEL) for name in ("a b", "a_b")]
    with pytest.raises(SceneError, match=r"shell 'a_b'.* called 'a_b', as that of 'a b'"):
        Scene("s", plates, supports=[Clamped("left", body=p.name) for p in plates])


@pytest.mark.parametrize("name", ["t", "step", "wall_s"])
def test_columns_of_the_run_are_reserved(name: str) -> None:
    with pytest.raises(SceneError, match=f"every history has a column '{name}'"):
        probe(name)
