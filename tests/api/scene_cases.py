"""A scene function that other processes can import, and what is measured of its runs."""

from shellmb.scene import Clamped, EdgeForce, Isotropic, Probe, Rectangle, Scene, Shell

LENGTH, WIDTH, THICKNESS, YOUNG = 1.0, 0.08, 2e-3, 210e9


def strip(force: float = 1.0, thickness: float = THICKNESS) -> Scene:
    steel = Isotropic(E=YOUNG, nu=0.0, thickness=thickness)
    return Scene(
        "strip",
        Shell("plate", Rectangle(LENGTH, WIDTH), steel, mesh=(6, 2)),
        supports=Clamped("left"),
        loads=EdgeForce("right", (0, 0, force / WIDTH)),
        probes=Probe("tip", "right-top"),
        scheme="linear-statics",
    )


def tip(run) -> dict[str, float]:
    return {"tip": float(run.history["tip"].iloc[-1])}


def sometimes(force: float = 1.0) -> Scene:
    return strip(force, THICKNESS * (force / force))


def over_tip(run) -> dict[str, float]:
    found = tip(run)["tip"]
    return {"tip": 1 / (1 / found)}
