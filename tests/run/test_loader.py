"""Scenes by name and by file, parameters as text, and requests that survive storage."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from shellmb.errors import SceneError
from shellmb.options.described import parse_mesh
from shellmb.options.run import Options
from shellmb.running.loader import KINDS, SceneModule, demos, kinds, load
from shellmb.running.request import Request, parse_parameters

SMALL = str(Path(__file__).with_name("scene_small.py"))


def test_demos_have_descriptions():
    known = demos()
    assert sorted(n for names in kinds().values() for n in names) == sorted(known)
    assert list(kinds()) == list(KINDS), "each demo says its kind, and none another one"
    assert {"sudden_load", "tumbling_plate"} <= known.keys()
    assert not {"weak_form_by_hand", "mechanism_by_hand"} & set(known), "programs without a scene"
    assert all(len(text) > 10 and "\n" not in text for text in known.values())


def test_every_demo_makes_a_scene():
    modules = {name: load(name) for name in sorted(demos())}
    assert modules and all(module.build().name for module in modules.values())
    unchecked = [name for name, module in modules.items() if module.check is None]
    assert not unchecked, "every demo asserts its numbers"
    bare = [n for n, m in modules.items() if m.results is None and m.mode_results is None]
    assert not bare


def test_parameters_are_converted_by_their_annotations():
    small = load(SMALL)
    scene = small.build({"steps": "3", "force": "1e1", "sides": "2, 1", "held": "false"})
    assert scene.t_end == pytest.approx(3e-3)
    assert scene.shells[0].mesh == (2, 1)
    assert scene.supports == ()
    assert scene.loads[0].force[2] == pytest.approx(125)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"stepz": "3"}, "no parameter 'stepz'; its parameters are 'force', 'steps'"),
        ({"steps": "3.5"}, "steps is '3.5'; it must be a whole number"),
        ({"force": "strong"}, "force is 'strong'; it must be a number"),
        ({"sides": "2"}, "sides is '2'; it must be of type"),
        ({"held": "perhaps"}, "held is 'perhaps'; it must be true or false"),
        ({"force": "nan"}, "force"),
    ],
)
def test_bad_parameters(values, message):
    with pytest.raises(SceneError, match=message.replace("(", r"\(")):
        load(SMALL).build(values)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"model": "plank"}, "model is 'plank'; it must be 'shell' or 'beam'"),
        ({"model": "beam", "arches": "0"}, "arches is 0; it must be odd"),
    ],
)
def test_bad_parameters_of_a_demo(values, message):
    with pytest.raises(SceneError, match=message):
        load("snap_through").build(values)


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("x = (", "broken.py, line 1"),
        (
            "import nosuchmodule",
            "broken.py, line 1: ModuleNotFoundError: No module named 'nosuchmodule'",
        ),
        ("y = 1", "defines no function scene"),
        ("def scene():\n    return 3", "returns int; it must return a Scene"),
    ],
)
def test_bad_files(tmp_path, source, message):
    path = tmp_path / "broken.py"
    path.write_text(source)
    with pytest.raises(SceneError, match=message):
        load(str(path)).build()


def test_missing_scenes():
    with pytest.raises(SceneError, match=r"no scene 'nosuch'; `shellmb list` has all"):
        load("nosuch")
    with pytest.raises(SceneError, match="there is no file"):
        load("nosuch.py")


def test_request_survives_storage():
    options = Options(scheme="ed", alpha=0.5, mesh=(4, 1), solve="full", backend="snes")
    request = Request(SMALL, {"steps": "2"}, options)
    assert Request.from_dict(request.to_dict()) == request
    scene, module = request.build()
    assert (scene.scheme, scene.alpha) == ("ed", 0.5)
    assert (scene.solver.solve, scene.solver.newton, scene.solver.backend) == (
        "full",
        "auto",
        "snes",
    )
    assert module.name == "scene_small"


def test_static_option_takes_load_steps_not_time_steps():
    scene, _ = Request(SMALL, options=Options(scheme="static")).build()
    assert scene.dt == pytest.approx(scene.t_end / 10)
    scene, _ = Request(SMALL, options=Options(scheme="static", dt=1e-3)).build()
    assert scene.dt == 1e-3


def test_texts_of_options():
    assert parse_mesh("8x4") == (8, 4)
    assert parse_parameters(["a=1", "b = x=y"]) == {"a": "1", "b": "x=y"}
    with pytest.raises(SceneError, match="mesh is '8'; it must be two counts as in 8x4"):
        parse_mesh("8")
    with pytest.raises(SceneError, match="--set is 'a'; it must be of the form name=value"):
        parse_parameters(["a"])
    with pytest.raises(SceneError, match="--set gives a twice, 1 and 2; one of them must be left"):
        parse_parameters(["a=1", "b=3", "a=2"])


class Thing:
    """A type that no text is made of."""


def test_types_that_no_text_is_made_of_are_named():
    def scene(thing: Thing | None = None, plan: dict[str, float] | None = None):
        raise AssertionError("not reached")

    module = SceneModule("own", SimpleNamespace(scene=scene))
    with pytest.raises(SceneError, match="thing is '1', and no text can be of type"):
        module.build({"thing": "1"})
    with pytest.raises(SceneError, match="plan is '1'; it must be of type"):
        module.build({"plan": "1"})
