"""A small strip for tests: two elements, five steps."""

from shellmb.scene import Clamped, EdgeForce, Isotropic, Output, Probe, Rectangle, Scene, Shell


def scene(force: float = 2.0, steps: int = 5, sides: tuple[int, int] = (6, 2), held: bool = True):
    steel = Isotropic(E=210e9, nu=0.25, thickness=2e-3, density=7870.0)
    return Scene(
        "small",
        Shell("plate", Rectangle(1.0, 0.08), steel, mesh=sides),
        supports=Clamped("left") if held else (),
        loads=EdgeForce("right", (0, 0, force / 0.08)),
        probes=(
            Probe("tip_z", "right-top", component=2),
            Probe("tip_speed", "right-top", "velocity", "norm"),
        ),
        scheme="ep",
        dt=1e-3,
        t_end=steps * 1e-3,
        output=Output(frames=3),
    )


def results(run):
    return {"tip": float(run.history["tip_z"].iloc[-1])}


def check(results):
    assert results["tip"] > 0, "the tip goes down"
