"""Cases of shells and beams: statics, motions, modes and paths."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal

import shellmb as sm
from shellmb.demos import loaded_plate
from shellmb.demos.references.plates import Plate, rectangle_uniform_deflection
from shellmb.scene import Beam, Isotropic, Scene, Shell
from tests.bench.errors.case import Case

STEEL = Isotropic(E=210e9, nu=0.25, thickness=2e-3, density=7870)
TIP = ("tip:l2", "tip:end")


def plate(
    scheme: str, load: str = "sudden", mesh: tuple[int, int] = (6, 2), **options: Any
) -> Scene:
    """Cantilever plate under a load at its edge, sudden or within 0.2 s."""
    body = Shell("plate", sm.Rectangle(1.0, 0.08), STEEL, mesh=mesh)
    time: Any = {} if load == "sudden" else {"time": sm.Ramp(0.2)}
    given: dict[str, Any] = {"dt": 5e-3, "t_end": 0.5} | options
    tip: Any = sm.Probe("tip", (1.0, 0.04, 0.0), component=2)
    force = sm.EdgeForce("right", (0, 0, 25.0), **time)
    return Scene(
        "plate",
        (body,),
        supports=(sm.Clamped("left"),),
        loads=(force,),
        probes=(tip,),
        scheme=scheme,
        **given,
    )


def square(
    mesh: tuple[int, int], pressure: float = 2e3, cell: Literal["quad", "tri"] = "quad"
) -> Scene:
    """Clamped square plate under pressure, with large deflections."""
    steel = Isotropic(E=210e9, nu=0.3, thickness=5e-3, density=7870)
    body = Shell("plate", sm.Rectangle(1.0, 1.0), steel, mesh=mesh, cell=cell)
    held = tuple(sm.Clamped(edge) for edge in ("left", "right", "bottom", "top"))
    middle = sm.Probe("middle", (0.5, 0.5, 0.0), component=2)
    return Scene(
        "square",
        (body,),
        supports=held,
        loads=(sm.Pressure(pressure),),
        probes=(middle,),
        scheme="static",
    )


def strip(mesh: tuple[int, int], force: float = 400.0) -> Scene:
    """Cantilever strip bent far by a force at its end."""
    body = Shell("strip", sm.Rectangle(1.0, 0.08), STEEL, mesh=mesh)
    end: Any = (1.0, 0.0, 0.0)
    tip: Any = (sm.Probe("tip_u", end, component=0), sm.Probe("tip_w", end, component=2))
    return Scene(
        "strip",
        (body,),
        supports=(sm.Clamped("left"),),
        loads=(sm.EdgeForce("right", (0, 0, force)),),
        probes=tip,
        scheme="static",
    )


def inflated(mesh: tuple[int, int]) -> Scene:
    """Cantilever strip that curls under pressure, which follows it."""
    body = Shell("strip", sm.Rectangle(0.6, 0.1), STEEL, mesh=mesh)
    tip = (sm.Probe("tip_u", (0.6, 0.05, 0.0), component=0), sm.Probe("tip_w", (0.6, 0.05, 0.0)))
    return Scene(
        "inflated",
        (body,),
        supports=(sm.Clamped("left"),),
        loads=(sm.Pressure(2e4),),
        probes=tip,
        scheme="static",
    )


def rod(elements: int, **options: Any) -> Scene:
    """Cantilever beam of steel, loaded across its end: at rest, or by a ramp."""
    line, section = (
        sm.Line((0, 0, 0), (1, 0, 0)),
        sm.RectangularSection(210e9, 0.3, width=0.02, height=0.01, density=7850),
    )
    given: dict[str, Any] = {"scheme": "static"} | options
    time: Any = {} if given["scheme"] == "static" else {"time": sm.Ramp(0.1)}
    tip: Any = sm.Probe("tip", "end", component=2)
    return Scene(
        "rod",
        beams=(Beam("rod", line, section, elements=elements),),
        supports=(sm.Clamped("start"),),
        loads=(sm.PointForce("end", (0, 0, 500.0), **time),),
        probes=(tip,),
        **given,
    )


def tube() -> Scene:
    """Thin tube, clamped at one end and pushed sideways at the other one."""
    skin = Isotropic(E=70e9, nu=0.3, thickness=2e-3, density=2700)
    top: Any = (
        sm.Probe("x", (0.1, 0.0, 0.5), component=0),
        sm.Probe("side", (0.0, 0.1, 0.5), component=1),
    )
    return Scene(
        "tube",
        (Shell("tube", sm.Cylinder(0.1, 0.5), skin, mesh=(8, 4)),),
        supports=(sm.Clamped("bottom"),),
        loads=(sm.EdgeForce("top", (2e4, 0, 0)),),
        probes=top,
        scheme="static",
    )


def vibrating(mesh: tuple[int, int]) -> Scene:
    """Cantilever plate without loads, for its modes."""
    return replace(plate("ep", mesh=mesh), loads=())


def triangular(scene: Scene) -> Scene:
    """A scene with triangles for its quadrilaterals."""
    return scene.with_options(cell="tri")


def demo(name: str, **parameters: Any) -> Scene:
    """A bundled scene."""
    return sm.load_scene(name, **parameters)


_NAVIER = rectangle_uniform_deflection(
    Plate(loaded_plate.E, loaded_plate.NU, loaded_plate.THICKNESS),
    loaded_plate.SIDE,
    loaded_plate.SIDE,
    loaded_plate.PRESSURE,
)

STATICS = (
    Case(
        "plate, Navier's series",
        "statics",
        lambda: demo("loaded_plate"),
        ("deflection",),
        {"deflection": _NAVIER},
    ),
    Case("clamped plate, 4x4", "statics", lambda: square((4, 4)), ("middle:end", "middle:l2")),
    Case("clamped plate, 8x8", "statics", lambda: square((8, 8)), ("middle:end",)),
    Case(
        "clamped plate, triangles", "statics", lambda: square((5, 5), cell="tri"), ("middle:max",)
    ),
    Case("bent strip, 4x1", "statics", lambda: strip((4, 1)), ("tip_u:end", "tip_w:end")),
    Case("bent strip, 8x2", "statics", lambda: strip((8, 2)), ("tip_u:end", "tip_w:l2")),
    Case("strip rolled up", "statics", lambda: demo("roll_up"), ("tip_u",), {"tip_u": -12.0}),
    Case(
        "hemisphere, 8x8",
        "statics",
        lambda: demo("hemisphere").with_options(mesh=(8, 8)),
        ("outward", "inward"),
    ),
    Case(
        "wing box",
        "statics",
        lambda: demo("wing_box", nx=8, ny=2, nz=2),
        ("front_2:end", "flow:end"),
    ),
    Case("strip under pressure", "statics", lambda: inflated((4, 1)), ("tip_u:end", "tip_w:l2")),
    Case("bent rod", "statics", lambda: rod(2), ("tip:end",)),
    Case("tube", "statics", tube, ("x:end", "side:end")),
    Case(
        "strip, follower load",
        "statics",
        lambda: replace(strip((4, 1)), loads=(sm.FollowerEdgeForce("right", (0, 0, 400.0)),)),
        ("tip_u:end", "tip_w:end"),
    ),
)

MOTIONS = (
    Case("plate, sudden, EP4", "motion", lambda: plate("ep4"), TIP),
    Case("plate, sudden, EP", "motion", lambda: plate("ep", dt=2.5e-3), TIP),
    Case("plate, sudden, ED3", "motion", lambda: plate("ed3", alpha=0.5), TIP),
    Case("plate, sudden, ED", "motion", lambda: plate("ed", alpha=0.5, dt=2.5e-3), TIP),
    Case(
        "plate, sudden, EP4, 12x3",
        "motion",
        lambda: plate("ep4", mesh=(12, 3), t_end=0.25),
        TIP,
        step=4,
    ),
    Case("plate, ramp, EP4", "motion", lambda: plate("ep4", "ramp", dt=1e-2), TIP),
    Case("plate, ramp, ED3", "motion", lambda: plate("ed3", "ramp", dt=1e-2, alpha=0.5), TIP),
    Case("plate, ramp, EP", "motion", lambda: plate("ep", "ramp", dt=5e-3), ("tip:l2", "tip:max")),
    Case("rod, ramp, EP4", "motion", lambda: rod(4, scheme="ep4", dt=1e-2, t_end=0.5), TIP),
    Case(
        "plate, ramp, triangles",
        "motion",
        lambda: triangular(plate("ep4", "ramp", dt=1e-2)),
        ("tip:l2", "tip:max"),
    ),
    Case("damped plate", "motion", lambda: demo("damped_plate"), ("tip:l2",)),
    Case(
        "right-angle frame",
        "motion",
        lambda: demo("right_angle_frame", t_end=10.0),
        ("tip_uz:l2", "elbow_uz:l2"),
    ),
    Case(
        "spun-up beam",
        "motion",
        lambda: demo("spin_up_beam", t_end=16.0),
        ("tip_ux:l2", "tip_uy:end"),
    ),
    Case(
        "tumbling plate",
        "motion",
        lambda: demo("tumbling_plate", steps=200),
        ("corner_x:l2", "corner_z:end"),
        step=4,
    ),
    Case(
        "bouncing plate",
        "motion",
        lambda: demo("bouncing_plate", t_end=0.2),
        ("corner_z:l2",),
        step=4,
    ),
)

OTHERS = (
    Case("modes of a cantilever", "modes", lambda: vibrating((6, 2)), ("f1", "f2", "f3")),
    Case(
        "modes of a free plate",
        "modes",
        lambda: demo("plate_modes").with_options(mesh=(4, 4)),
        ("f7", "f8"),
    ),
    Case(
        "hinged roof",
        "path",
        lambda: demo("hinged_roof").with_options(mesh=(4, 4)),
        ("limit_load_1",),
    ),
    Case(
        "heated arch",
        "path",
        lambda: demo("heated_arch", mesh=6),
        ("curvature_at_snap", "sinks_by"),
    ),
)
