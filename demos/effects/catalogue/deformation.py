"""Effects of deformation: what shells and beams resist with, and how large it may be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from shellmb.demos.effects.catalogue.parts import (
    Flexible,
    chosen,
    flexible,
    replaced,
    switches,
    use_of_field,
)
from shellmb.demos.effects.effect import Effect, Use, fixed, names, refuse, whole
from shellmb.errors import SceneError
from shellmb.scene import Beam, Hyperelastic, LinearSection, Modal, RigidBody, Scene, Wrinkling
from shellmb.scene.lookup import said
from shellmb.scene.values.validate import show

_GROUP = "deformation"
_NO_BODY = "no shell or beam is flexible"
# couplings smaller than this, relative to stiffness and size, are round-off
NOTHING = 1e-14


def _separable(body: Flexible) -> bool:
    """Decide whether the energy falls into parts of which one may be left out."""
    return not body.rigid and (isinstance(body, Beam) or isinstance(body.section, LinearSection))


def _couples(body: Flexible) -> bool:
    """Decide whether the section couples bending and stretching, which there must be."""
    if not _separable(body) or not body.stretching:
        return False
    if isinstance(body, Beam):
        C = np.asarray(body.section.stiffness, dtype=float)
        H = np.linalg.solve(C[:3, :3], C[:3, 3:])
        return bool(np.abs(H).max() > NOTHING * body.section.size)
    assert isinstance(body.section, LinearSection)
    return body.section.coupled


def _flexibility(scene: Scene) -> Use:
    soft = flexible(scene)
    if not soft:
        rigid = [b for b in scene.bodies if isinstance(b, RigidBody) or b.rigid]
        return Use(False, f"all bodies are rigid: {names(rigid)}")
    return Use(True, f"{names(soft)} not rigid")


def _rigid(scene: Scene, part: str | None) -> Scene:
    bodies = chosen(flexible(scene), part, "shell or beam that is flexible")
    for body in bodies:
        held = [s for s in scene.supports if body in scene.bodies_of(s)]
        if held:
            raise SceneError(
                f"{said(body)} is fixed by a {held[0].label}; fix a rigid body by a joint to the "
                "ground"
            )
    return replaced(scene, bodies, model="rigid")


def _exact(scene: Scene) -> Use:
    exact = [b for b in scene.meshed if b.exact]
    if exact:
        return Use(True, f"model='exact' of {names(exact)}")
    return Use(False, "no shell or beam has model='exact'")


def _linear_strains(scene: Scene, part: str | None) -> Scene:
    able = [b for b in scene.meshed if b.exact]
    bodies = chosen(able, part, "shell or beam with model='exact'")
    return replaced(scene, bodies, model="floating-frame")


def _exact_strains(scene: Scene, part: str | None) -> Scene:
    able = [b for b in scene.meshed if b.linear or isinstance(b.model, Modal)]
    what = "shell or beam with linear strains, or in modes"
    return replaced(scene, chosen(able, part, what), model="exact")


def _of_mesh(scene: Scene) -> Use:
    whole = [b for b in scene.meshed if b.nodal]
    if whole:
        words = " and ".join(dict.fromkeys(f"model={b.model!r}" for b in whole))
        return Use(True, f"{words} of {names(whole)}")
    return Use(False, "no shell or beam has its nodes for unknowns")


def _in_modes(scene: Scene, part: str | None) -> Scene:
    able = [b for b in scene.meshed if b.nodal]
    bodies = chosen(able, part, "shell or beam with model='exact' or 'floating-frame'")
    return replaced(scene, bodies, model=Modal())


def _not_in_modes(scene: Scene, part: str | None) -> Scene:
    able = [b for b in scene.meshed if isinstance(b.model, Modal)]
    return replaced(scene, chosen(able, part, "shell or beam in modes"), model="floating-frame")


def _soft(scene: Scene, part: str | None) -> Scene:
    able = [b for b in scene.meshed if b.rigid]
    what = "shell or beam with model='rigid' (a RigidBody has no section to be flexible with)"
    return replaced(scene, chosen(able, part, what), model="exact")


def _nonlinearity(scene: Scene) -> Use:
    why = f"scheme={show(scene.scheme_name)}"
    if scene.linear:
        return Use(False, f"{why}: small displacements, one factorisation")
    return Use(True, f"{why}: strains quadratic in displacement and director")


def _linear(scene: Scene) -> Scene:
    if scene.static:
        return replace(scene, scheme="linear-statics", dt=None)
    return replace(scene, scheme="linear-dynamics", alpha=None)


def _nonlinear(scene: Scene) -> Scene:
    if scene.static:
        return replace(scene, scheme="static", dt=None)
    return replace(scene, scheme="ep")


def _nonlinear_material(scene: Scene) -> Use:
    for kind in (Hyperelastic, Wrinkling):
        found = [b for b in flexible(scene) if isinstance(b.section, kind)]
        if found:
            return Use(True, f"{kind.__name__} section of {names(found)}")
    return Use(False, "every section is linear")


def _own_strains(scene: Scene) -> Use:
    found = [s for s in scene.shells if s.strains is not None and not s.rigid]
    return Use(bool(found), f"strains of {names(found)}" if found else "strains=None: eq. 9")


def _usual_strains(scene: Scene) -> Scene:
    return replace(scene, shells=tuple(replace(s, strains=None) for s in scene.shells))


def _natural(scene: Scene) -> Use:
    found = [b for b in scene.meshed if b.natural is not None]
    return Use(bool(found), f"natural of {names(found)}" if found else "natural=None")


def _without_natural(scene: Scene) -> Scene:
    return replace(
        scene,
        shells=tuple(replace(s, natural=None) for s in scene.shells),
        beams=tuple(replace(b, natural=None) for b in scene.beams),
    )


_SEPARABLE = "flexible shell or beam with a linear section"

EFFECTS = (
    Effect(
        "flexibility",
        _GROUP,
        "deformation of shells and beams; rigid ones have six freedoms",
        _flexibility,
        _rigid,
        _soft,
    ),
    Effect(
        "large_deformation",
        _GROUP,
        "large strains and rotations within a body; without them small ones about a frame",
        _exact,
        _linear_strains,
        _exact_strains,
    ),
    Effect(
        "all_modes",
        _GROUP,
        "all modes that a mesh has; without them ten about a frame",
        _of_mesh,
        _in_modes,
        _not_in_modes,
    ),
    Effect(
        "bending",
        _GROUP,
        "bending stiffness, D of eq. 11",
        lambda scene: Use(
            bool(flexible(scene)),
            f"sections of {names(flexible(scene))}" if flexible(scene) else _NO_BODY,
        ),
        refuse(
            "without bending stiffness nothing holds the directors; a section must have one: make "
            "it small by a thin section"
        ),
        refuse(f"{_NO_BODY}; it must have a shell or a beam that is not rigid"),
    ),
    Effect(
        "stretching",
        _GROUP,
        "stretching in the surface or along the line; without it inextensible",
        use_of_field("stretching", lambda body: True, _NO_BODY),
        *switches("stretching", _separable, _SEPARABLE),
    ),
    Effect(
        "transverse_shear",
        _GROUP,
        "shear across the thickness; without it Kirchhoff's and Bernoulli's limit",
        use_of_field("transverse_shear", lambda body: True, _NO_BODY),
        *switches("transverse_shear", _separable, _SEPARABLE),
    ),
    Effect(
        "coupling",
        _GROUP,
        "coupling of bending and stretching, B",
        use_of_field("coupling", _couples, "every section is symmetric about its reference: B = 0"),
        *switches(
            "coupling",
            _couples,
            "section with bending-stretching coupling",
            "section that couples (an offset, or a laminate that is not symmetric)",
        ),
    ),
    Effect(
        "drilling",
        _GROUP,
        "stiffness against rotation about the director",
        fixed(False, "a director has no rotation about itself: five freedoms per node"),
        refuse("no shell has it"),
        refuse(
            "the shells of eq. 9 have no moment about the director; what must carry one is a beam, "
            "or a Glue or ShellRevolute joint to one"
        ),
    ),
    Effect(
        "geometric_nonlinearity",
        _GROUP,
        "large displacements and rotations",
        _nonlinearity,
        whole(_linear),
        whole(_nonlinear),
    ),
    Effect(
        "nonlinear_material",
        _GROUP,
        "a strain energy that is not quadratic, with assumed strains S",
        _nonlinear_material,
        refuse(
            "an energy of the user's has no linear counterpart that would be known; the section "
            "must be Isotropic, Orthotropic or a Laminate"
        ),
        refuse("there is no energy to take; a shell's section must be Hyperelastic or Wrinkling"),
    ),
    Effect(
        "own_strains",
        _GROUP,
        "a strain measure of the user's",
        _own_strains,
        whole(_usual_strains),
        refuse("there is no measure to take; a shell must have strains"),
    ),
    Effect(
        "natural_strain",
        _GROUP,
        "strains without stress: heat, swelling, prestress",
        _natural,
        whole(_without_natural),
        refuse("there is no strain to take; a shell or a beam must have natural"),
    ),
)
