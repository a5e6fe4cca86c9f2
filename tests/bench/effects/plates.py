"""Effects that the cantilever plate of `python -m tests.bench` has, or can have."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from shellmb.demos.effects.catalogue.registry import find_effect
from shellmb.demos.own_forms import air_drag, linear_membrane_strains
from shellmb.demos.sudden_load import LENGTH
from shellmb.scene import (
    AlongEdge,
    Beam,
    Clamped,
    Driven,
    EdgeForce,
    EnclosedVolume,
    FollowerEdgeForce,
    Gas,
    Glue,
    Gravity,
    Hyperelastic,
    InitialVelocity,
    Isotropic,
    Join,
    Line,
    NaturalStrain,
    Pressure,
    Rectangle,
    RectangularSection,
    Scene,
    Sphere,
    StepControl,
    SymmetryPlane,
)
from shellmb.scene.settings import PathFollowing
from tests.bench.effects.case import Case, Mesh
from tests.bench.record import AUTO
from tests.bench.scenes import LINE_LOAD, plate

# load step of the static ones
LOAD_STEP = 0.1
# by heat, more on one side than on the other
_HEAT = NaturalStrain((1e-4, 1e-4, 0.0), (1e-3, 1e-3, 0.0))
# largest jump of ED, relative to the plate: more than there are, so that the steps are the same
JUMP = 0.1


def _plate(scheme: str, mesh: Mesh) -> Scene:
    if scheme in ("static", "linear-statics"):
        return replace(plate("static", scheme, mesh, AUTO), dt=LOAD_STEP)
    return plate("dynamic", scheme, mesh, AUTO)


def _filled(scheme: str, mesh: Mesh) -> Scene:
    """An eighth of a sphere full of gas, between planes of symmetry."""
    base, planes = (
        _plate(scheme, mesh),
        (("left", (0, 1, 0)), ("right", (1, 0, 0)), ("top", (0, 0, 1))),
    )
    surface = Sphere(0.5, azimuth=(0.0, 90.0))
    given: dict[str, Any] = {
        # as many cells, and no slender ones at the pole
        "shells": replace(
            base.shells[0], surface=surface, mesh=(round(math.sqrt(mesh[0] * mesh[1])),) * 2
        ),
        "supports": [SymmetryPlane(edge, normal) for edge, normal in planes],
        "loads": Pressure(10.0),
        "probes": (),
        "volumes": EnclosedVolume("gas", gas=Gas(1e5)),
    }
    return replace(base, **given)


def _having(**changes: Any) -> Callable[[str, Mesh], Scene]:
    """The plate with fields of the scene changed."""
    return lambda scheme, mesh: replace(_plate(scheme, mesh), **changes)


def _made_of(change: Callable[[Isotropic], dict[str, Any]]) -> Callable[[str, Mesh], Scene]:
    """The plate with fields of its shell changed, which its section may tell."""

    def make(scheme: str, mesh: Mesh) -> Scene:
        scene = _plate(scheme, mesh)
        shell = scene.shells[0]
        assert isinstance(shell.section, Isotropic)
        return replace(scene, shells=(replace(shell, **change(shell.section)),))

    return make


def _eccentric(section: Isotropic) -> dict[str, Any]:
    return {"section": replace(section, offset=0.5 * section.thickness)}


def _quadratic(strains: Any, p: Mapping[str, Any]) -> Any:
    """The energy of an isotropic section, as a user would write it."""

    def plane(e: Any) -> Any:
        return e[0] ** 2 + e[1] ** 2 + 2 * p["nu"] * e[0] * e[1] + (1 - p["nu"]) / 2 * e[2] ** 2

    shear = strains.gam[0] ** 2 + strains.gam[1] ** 2
    return (p["A"] * plane(strains.eps) + p["D"] * plane(strains.kap) + p["G"] * shear) / 2


def _own_energy(section: Isotropic) -> dict[str, Any]:
    E, nu, h = section.E, section.nu, section.thickness
    A, G = E * h / (1 - nu**2), section.shear_correction * E * h / (2 * (1 + nu))
    values = {"nu": nu, "A": A, "D": A * h**2 / 12, "G": G}
    return {
        "section": Hyperelastic(
            _quadratic, values, thickness=h, density=section.density, stiffness=E * h
        )
    }


def _of_steel(scene: Scene) -> Scene:
    """A plate with the section whose energy it is."""
    steel = _plate("ep", (1, 1)).shells[0].section
    return replace(scene, shells=(replace(scene.shells[0], section=steel),))


def _at_rest(scene: Scene) -> Scene:
    return replace(find_effect("inertia").without(scene), dt=scene.dt)


def _held(scene: Scene) -> Scene:
    return replace(scene, supports=(Clamped("left"),))


def _shaken(t: float) -> tuple[float, float, float]:
    return 0.0, 0.0, 1e-3 * math.sin(50.0 * t)


def _joined(scheme: str, mesh: Mesh) -> Scene:
    """Two plates, one behind the other; without the join the second one falls."""
    scene = _plate(scheme, mesh)
    first = scene.shells[0]
    assert isinstance(first.surface, Rectangle)
    behind = replace(first.surface, origin=(LENGTH, 0.0, 0.0))
    return replace(
        scene,
        shells=(first, replace(first, name="second", surface=behind)),
        joins=(Join("plate", "second", "right", "left"),),
        supports=(Clamped("left", body="plate"),),
        loads=(Gravity(),),
        probes=(),
    )


def _stiffened(scheme: str, mesh: Mesh) -> Scene:
    """A beam along the edge."""
    scene = _plate(scheme, mesh)
    bar = RectangularSection(E=210e9, nu=0.25, width=2e-3, height=4e-3, density=7870.0)
    return replace(
        scene,
        beams=(Beam("bar", AlongEdge("plate", "bottom"), bar),),
        glues=(Glue("bar", "plate"),),
        supports=(Clamped("left", body="plate"),),
        loads=(Gravity(),),
        probes=(),
    )


def _loose(scene: Scene) -> Scene:
    """The beam at the same place, with nodes of its own."""
    bar, elements = scene.beams[0], scene.shells[0].mesh[0]
    line = Line((0, 0, 0), (LENGTH, 0, 0))
    return replace(scene, beams=(replace(bar, curve=line, elements=elements),), glues=())


_DEAD = EdgeForce("right", (0, 0, LINE_LOAD))
_FLIGHT = {
    "supports": (),
    "loads": Gravity(),
    "initial": InitialVelocity(linear=(1.0, 0.0, 0.0), spin=(0.0, 1.0, 0.0)),
}

CASES = (
    # as many load steps as there were time steps: what is compared are steps
    Case("inertia", _plate, instead=_at_rest),
    Case("rotary_inertia", _plate),
    Case("eccentric_inertia", _made_of(_eccentric)),
    Case("dissipation", _plate, scheme="ed"),
    Case("adaptivity", _having(step_control=StepControl(jump_tolerance=JUMP)), scheme="ed"),
    Case("path_following", _having(path=PathFollowing()), scheme="static"),
    Case("flexibility", _having(**_FLIGHT)),
    Case("large_deformation", _having(**_FLIGHT)),
    Case("all_modes", _having(**_FLIGHT)),
    Case("stretching", _plate),
    Case("enclosed_volume", _filled),
    Case("transverse_shear", _plate),
    Case("coupling", _made_of(_eccentric)),
    Case(
        "geometric_nonlinearity",
        _plate,
        scheme="static",
        # as many load steps: the registry takes one, which is all that a linear scene needs
        instead=lambda scene: replace(scene, scheme="linear-statics"),
    ),
    Case("nonlinear_material", _made_of(_own_energy), instead=_of_steel),
    Case("natural_strain", _made_of(lambda section: {"natural": _HEAT})),
    Case("own_strains", _made_of(lambda section: {"strains": linear_membrane_strains})),
    # another load stays: a plate at rest would need no iterations
    Case("gravity", _having(loads=(_DEAD, Gravity()))),
    Case("dead_load", _having(loads=(_DEAD, Gravity()))),
    Case(
        "follower_load", _having(loads=(FollowerEdgeForce("right", (0, 0, LINE_LOAD)), Gravity()))
    ),
    Case("prescribed_motion", _having(supports=Driven("left", translation=_shaken)), instead=_held),
    Case("added_terms", _made_of(lambda section: {"terms": (air_drag,)})),
    Case("material_damping", _made_of(lambda s: {"section": replace(s, stiffness_damping=1e-3)})),
    Case("mass_damping", _made_of(lambda s: {"section": replace(s, mass_damping=1.0)})),
    Case("supports", _plate),
    Case("joins", _joined),
    Case("glues", _stiffened, instead=_loose),
    *(
        Case(f"observe_{name}", _plate)
        for name in (
            *("energy", "constraints", "momentum", "probes", "history"),
            *("frames", "checkpoint"),
        )
    ),
)
