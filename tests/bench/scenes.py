"""The plates that are measured: strips as in the demo `sudden_load`, and square ones."""

from __future__ import annotations

from dataclasses import replace

from shellmb.demos import sudden_load
from shellmb.scene import Clamped, EdgeForce, Probe, Rectangle, Scene, Solver
from tests.bench.record import Configuration

# a mesh with sides as equal as those of a square is one of a square plate
SQUARE = 0.5
# line load of the demo on the free edge, N/m
LINE_LOAD = 2.0 / sudden_load.WIDTH
DT = 1e-3
# steps of a dynamic one until its end
STEPS = 500


def plate(kind: str, scheme: str, mesh: tuple[int, int], how: Configuration) -> Scene:
    """A cantilever plate, loaded at once at its free edge.

    Strips of 1 m x 0.08 m; if the mesh is about as wide as long, a square of 1 m x 1 m of the
    same material, thickness and line load. Static plates take their load in one step.

    Args:
        kind: "dynamic", "triangles" (that one, of triangles) or "static".
        scheme: Time scheme of a dynamic one.
        mesh: Elements along and across.
        how: How to solve.
    """
    length = sudden_load.LENGTH
    width = length if mesh[1] > SQUARE * mesh[0] else sudden_load.WIDTH
    base = sudden_load.scene(dt=DT)
    shell = replace(base.shells[0], surface=Rectangle(length, width), mesh=mesh)
    if kind == "triangles":
        shell = replace(shell, cell="tri")
    times = {"dt": DT, "t_end": STEPS * DT} if kind != "static" else {"dt": 1.0, "t_end": 1.0}
    return replace(
        base,
        name=f"bench_{kind}",
        shells=(shell,),
        supports=(Clamped("left"),),
        loads=(EdgeForce("right", (0, 0, LINE_LOAD)),),
        probes=(Probe("tip_z", (length, width / 2, 0), component=2),),
        scheme=scheme,
        solver=Solver(solve=how.path, newton=how.newton),  # type: ignore[arg-type]
        **times,
    )
