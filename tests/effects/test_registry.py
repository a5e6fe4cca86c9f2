"""Whether a scene has an effect and why, the scene without and with it, and what is impossible."""

import json

import pytest

from shellmb.demos.effects.catalogue.registry import EFFECTS, changed, find_effect
from shellmb.demos.effects.report import survey_json
from shellmb.demos.effects.survey import survey
from shellmb.errors import SceneError
from shellmb.scene import (
    Clamped,
    Fixed,
    Hyperelastic,
    InitialVelocity,
    StepControl,
    Weld,
)

SWITCHES = ("rotary_inertia", "stretching", "transverse_shear", "gravity")


def has(scene, name: str) -> bool:
    return EFFECTS[name].use(scene).used


def test_names_are_those_of_the_registry_and_reasons_are_given(plate, pendulum) -> None:
    assert len(EFFECTS) > 50
    for scene in (plate(), pendulum()):
        for name, effect in EFFECTS.items():
            assert effect.name == name
            assert effect.use(scene).why


def test_a_plate_has_what_its_scene_says(plate, eccentric, unsymmetric) -> None:
    scene = plate()
    found = {name for name in EFFECTS if has(scene, name)}
    assert found == {
        *("inertia", "rotary_inertia", "adaptivity", "flexibility", "bending", "stretching"),
        *("transverse_shear", "geometric_nonlinearity", "dead_load", "supports"),
        *("large_deformation", "all_modes"),
        *(f"observe_{name}" for name in ("energy", "constraints", "momentum", "probes", "history")),
        *("observe_frames", "observe_checkpoint"),
    }
    assert {name for name in EFFECTS if has(plate(section=eccentric), name)} - found == {
        "eccentric_inertia",
        "coupling",
    }
    assert {name for name in EFFECTS if has(plate(section=unsymmetric), name)} - found == {
        "coupling"
    }


def test_a_mechanism_has_what_its_scene_says(pendulum) -> None:
    scene = pendulum(scheme="ed")
    for name in ("revolute_joint", "joint_spring", "joint_damper", "joint_mass", "gravity"):
        assert has(scene, name)
    assert has(scene, "dissipation")
    for name in ("weld_joint", "supports", "driver", "lock", "drilling", "initial_velocity"):
        assert not has(scene, name)


@pytest.mark.parametrize("name", [*SWITCHES, "dissipation"])
def test_out_and_in_again_is_the_scene_itself(name, free, pendulum) -> None:
    for make in (free, pendulum):
        scene = make(scheme="ed") if name == "dissipation" else make()
        less = changed(scene, [name], [])
        assert has(scene, name) and not has(less, name)
        assert changed(less, [], [name]) == scene


def test_parts_are_changed_by_themselves(pendulum) -> None:
    scene = changed(pendulum(), ["flexibility:bar"], [])
    assert scene.beams[0].rigid
    assert not changed(scene, [], ["flexibility:bar"]).beams[0].rigid
    fewer = changed(pendulum(), ["joint_spring:spring"], [])
    assert [e.name for e in fewer.force_elements] == ["damper"]


def test_statics_and_back(plate) -> None:
    still = changed(plate(scheme="ed", dt=1e-3), ["inertia"], [])
    assert still.static and still.dt == pytest.approx(4e-4)
    moving = changed(still, [], ["inertia"])
    # the load parameter is time now, and the load grows as it did
    assert moving.scheme == "ep" and moving.loads[0].time(2e-3) == pytest.approx(0.5)
    linear = changed(still, ["geometric_nonlinearity"], [])
    assert linear.scheme == "linear-statics" and linear.dt == linear.t_end
    ringing = changed(plate(scheme="ed"), ["geometric_nonlinearity"], [])
    assert ringing.scheme == "linear-dynamics" and not ringing.static
    assert changed(ringing, [], ["geometric_nonlinearity"]).scheme == "ep"


@pytest.mark.parametrize(
    ("without", "with_", "message"),
    [
        ("inertia", "", "it must have none"),
        ("inertai", "", "there is no effect 'inertai'; it must be one of 'inertia', 'rotary"),
        ("", "drilling", "what must carry one is a beam"),
        ("", "inertia", "it is there already: scheme='ep'"),
        ("dissipation", "", "it is not there: scheme='ep' has none"),
        ("bending", "", "nothing holds the directors"),
        ("rotary_inertia:wing", "", "named 'wing'; it must be 'plate'"),
        ("inertia:plate", "", "the effect is one of the whole scene"),
        ("", "coupling", "a laminate that is not symmetric"),
        ("", "eccentric_inertia", "no section with a first moment"),
        ("", "nonlinear_material", "must be Hyperelastic"),
        ("", "material_damping", "how much must be given: stiffness_damping of a section"),
        ("", "weld_joint", "add Weld(...) to the scene's joints"),
        ("", "adaptivity", "it is there already"),
        ("observe_energy", "", "every run has it, for its summary"),
        ("", "flexibility", "it is there already"),
        ("", "flexibility:plate", "a RigidBody has no section"),
    ],
)
def test_what_is_impossible_explains_itself(without, with_, message, free) -> None:
    with pytest.raises(SceneError) as caught:
        changed(free(), [without] if without else [], [with_] if with_ else [])
    assert message in str(caught.value)
    # an option and its value begin the sentence, so that a user knows which of them it was
    name = without or with_
    if name.split(":")[0] in EFFECTS:
        option = "--without" if without else "--with"
        assert str(caught.value).startswith(f"{option} {name}: ")


def test_what_a_scene_needs_stays(plate, free, pendulum) -> None:
    flying = free(initial=())
    with pytest.raises(SceneError, match="nothing supports it, so it can move rigidly"):
        changed(flying, ["inertia"], [])
    still = plate(scheme="static", dt=None, t_end=None)
    with pytest.raises(SceneError, match="--without supports: shell 'plate': nothing supports it"):
        changed(still, ["supports"], [])
    with pytest.raises(SceneError, match="fix a rigid body by a joint to the ground"):
        changed(still, ["flexibility"], [])
    with pytest.raises(SceneError, match="no motion to damp"):
        changed(still, [], ["dissipation"])
    with pytest.raises(SceneError, match="cannot have it: scheme='static': no inertia"):
        changed(changed(plate(), ["rotary_inertia", "inertia"], []), [], ["rotary_inertia"])
    with pytest.raises(SceneError, match="no joint 'pin'"):
        # a spring acts on its coordinate
        changed(pendulum(), ["revolute_joint:pin"], [])
    held = pendulum(
        scheme="static", dt=None, t_end=None, force_elements=(), loads=(),
        joints=[
            Weld("foot", "ground", "arm", at=(0, 0, 0)),
            Weld("top", "arm", "bar", at=(1, 0, 0)),
        ],
    )  # fmt: skip
    with pytest.raises(SceneError, match="it can move rigidly"):
        changed(held, ["weld_joint:foot"], [])
    rigid = changed(pendulum(), ["flexibility"], [])
    with pytest.raises(SceneError, match="no shell or beam"):
        changed(rigid, ["rotary_inertia"], [])


def test_an_energy_of_all_strains_has_no_parts(plate) -> None:
    numbers = {"thickness": 0.01, "density": 1000.0, "stiffness": 1e4}
    rubber = Hyperelastic(lambda strains, p: p["mu"] * strains.eps[0] ** 2, {"mu": 1.0}, **numbers)
    scene = plate(section=rubber)
    assert has(scene, "nonlinear_material") and has(scene, "transverse_shear")
    for name in ("stretching", "transverse_shear"):
        with pytest.raises(SceneError, match="with a linear section"):
            changed(scene, [name], [])
        with pytest.raises(SceneError, match=f"{name} is False; it must be True with a hyperel"):
            plate(section=rubber, shell={name: False})
    with pytest.raises(SceneError, match="must be Isotropic, Orthotropic or a Laminate"):
        changed(scene, ["nonlinear_material"], [])


def test_adaptivity_is_by_failures_or_by_jumps(plate) -> None:
    fixed = changed(plate(), ["adaptivity"], [])
    assert fixed.step_control == StepControl(min_dt=1e-3, max_dt=1e-3)
    assert changed(fixed, [], ["adaptivity"]).step_control == StepControl()
    steered = changed(changed(plate(scheme="ed"), ["adaptivity"], []), [], ["adaptivity"])
    assert steered.step_control.jump_tolerance == 1e-2


def test_prescribed_motions_are_told_from_supports(plate) -> None:
    moved = Fixed("right", displacement=(None, None, lambda t: t))
    scene = plate(supports=[Clamped("left"), moved])
    assert find_effect("prescribed_motion").use(scene) == (True, "supports: fixed components")
    assert not has(plate(), "prescribed_motion")
    assert has(plate(initial=InitialVelocity()), "initial_velocity")


def test_a_quick_survey_builds_nothing(pendulum) -> None:
    found = survey(pendulum(), steps=0)
    assert {row.effect: row.used for row in found.rows} == {
        name: has(pendulum(), name) for name in EFFECTS
    }
    assert found.total is None
    content = json.loads(survey_json("pendulum", found))
    assert [row["effect"] for row in content["effects"]] == list(EFFECTS)
    assert content["effects"][0] == {
        "effect": "inertia",
        "group": "inertia and time",
        "title": "inertia: velocities and a time scheme",
        "used": True,
        "why": "scheme='ep'",
        **dict.fromkeys(("share", "needed", "unknowns", "stored", "integrals", "coefficients")),
        "kernels": None,
    }
