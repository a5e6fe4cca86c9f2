"""Former names of parameters: an error says the name of today. One table, and a page of it."""

from dataclasses import fields, is_dataclass
from pathlib import Path

import pytest

from shellmb import scene
from shellmb.errors import SceneError
from shellmb.running.request import Request
from shellmb.scene.fingerprint import differences
from shellmb.scene.values.models import model_of
from shellmb.scene.values.renamed import CHOICES, RENAMED, STILL_CHOSEN, STILL_READ, STORED

DESCRIBED = [c for name in scene.__all__ if is_dataclass(c := getattr(scene, name))]
PAGE = Path(__file__).parents[2] / "docs" / "reference" / "vocabulary.md"


def cases():
    for former, today in RENAMED.items():
        for cls in DESCRIBED:
            names = [f.name for f in fields(cls)]
            for name in today:
                if name in names and former not in names:
                    yield former, name, cls


def test_every_entry_is_of_some_class():
    assert {(former, name) for former, name, _ in cases()} == {
        (former, name) for former, today in RENAMED.items() for name in today
    }


@pytest.mark.parametrize("former", RENAMED)
def test_a_former_name_is_rejected_with_the_new_one(former):
    """Whatever else is missing or wrong."""
    for name, cls in [(name, cls) for given, name, cls in cases() if given == former]:
        with pytest.raises(SceneError) as refused:
            cls(**{former: "left"})
        assert str(refused.value).endswith(f": {former} is now called {name}; write {name}=...")


def test_a_run_that_is_older_than_a_name_is_read():
    """Its request by the names of today, its state as that of the same scene."""
    given = {
        "scene": "sudden_load",
        "parameters": {},
        "options": {"step_tolerance": 1e-3, "tolerance": 1e-8},
    }
    options = Request.from_dict(given).options
    assert (options.step_error, options.newton_tolerance) == (1e-3, 1e-8)
    now = {today: 1e-3 for today in STORED.values()}
    assert differences(dict.fromkeys(STORED, 1e-3), now) == []


SQUARE, SECTION = scene.Rectangle(1, 1), scene.Isotropic(1, 0, thickness=0.1)
GIVEN = {
    "model": [lambda choice: scene.Shell("s", SQUARE, SECTION, model=choice), model_of],
}


@pytest.mark.parametrize(("name", "former"), CHOICES)
def test_a_former_choice_is_rejected_with_the_new_one(name, former):
    for make in GIVEN[name]:
        with pytest.raises(SceneError, match=f"{former!r} is now called {CHOICES[name, former]!r}"):
            make(former)


def test_what_is_still_read_warns_with_the_new_name():
    shell = scene.Shell("s", SQUARE, SECTION)
    with pytest.warns(FutureWarning, match="scheme='linear' is now called scheme='linear-stat"):
        made = scene.Scene("s", shell, supports=scene.Clamped("left"), scheme="linear")
    assert made.scheme_name == "linear-statics"
    spring = scene.Spring("k", "s", "ground", at=(1, 1, 0), second_at=(1, 1, 1), stiffness=1.0)
    with pytest.warns(FutureWarning, match="scene: elements is now called force_elements"):
        made = scene.Scene("s", shell, supports=scene.Clamped("left"), elements=spring)
    assert made.force_elements == (spring,)
    # the number of a beam's elements is called so
    assert scene.Beam.__dataclass_fields__["elements"]


def test_the_page_has_them_all():
    text = PAGE.read_text()
    for (_, former), today in STILL_READ.items():
        assert f"| `{former}` | `{today}` |" in text
    for (_, name, former), today in STILL_CHOSEN.items():
        assert f'| `{name}="{former}"` | `{name}="{today}"` |' in text
    for (name, former), today in CHOICES.items():
        assert f'| `{name}="{former}"` | `{name}="{today}"` |' in text
    for former, today in RENAMED.items():
        assert any(f"| `{former}` | `{name}` |" in text for name in today), former


def test_few_parameters_go_without_names():
    assert {
        cls: [f.name for f in fields(cls) if not f.kw_only]
        for cls in (
            scene.Scene,
            scene.Revolute,
            scene.Isotropic,
            scene.RectangularSection,
            scene.Laminate,
        )
    } == {
        scene.Scene: ["name", "shells"],
        scene.Revolute: ["name", "first", "second"],
        scene.Isotropic: ["E", "nu", "thickness", "density"],
        scene.RectangularSection: ["E", "nu"],
        scene.Laminate: ["plies"],
    }
    with pytest.raises(SceneError) as refused:
        scene.Revolute("hinge", "ground", "arm", (0, 0, 0), axis=(0, 0, 1))
    assert str(refused.value) == (
        "revolute joint 'hinge': more than name, first, second are given without their names; the "
        "others must have theirs: at=, second_at=, mass=, active=, axis="
    )
    with pytest.raises(SceneError) as refused:
        scene.RectangularSection(0.02, 0.004, E=210e9, density=7850)
    assert str(refused.value) == (
        "rectangular section: E is given twice, with and without its name; the order of those "
        "without a name is E, nu"
    )
