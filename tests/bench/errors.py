"""Are stated errors true? Runs with errors beside finer ones: `python -m tests.bench.errors`.

Each scene is run as it is, with errors, and once more with elements of degree 3 on twice the mesh
and a quarter of the step. For every quantity the table has the stated error over the true one, and
at its end coverage (true <= stated) and the median of that ratio.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from statistics import median
from typing import Any

import shellmb as sm
from shellmb.accuracy.errors import Found, estimate_errors
from shellmb.running.execute import RunResult, execute
from shellmb.scene import Beam, Scene
from shellmb.studies.quantity import Quantity, parse_quantity

# a reference is known to a tenth of what it is compared with; below this part of the size of the
# quantity errors are round-off of Newton's method
ROUND_OFF = 1e-9
FINER_STEP = 4


@dataclass(frozen=True)
class Row:
    """A quantity with its stated and its true error.

    Args:
        scene: Name of the scene.
        quantity: Name of the quantity.
        value: Its value.
        stated: The stated error; None: not known.
        true: The true one.
    """

    scene: str
    quantity: str
    value: float
    stated: float | None
    true: float

    @property
    def ratio(self) -> float | None:
        """Stated over true error; None where either is not known or round-off."""
        if self.stated is None or self.true <= ROUND_OFF * max(abs(self.value), 1e-12):
            return None
        return self.stated / self.true


def plate(
    scheme: str, load: str = "sudden", mesh: tuple[int, int] = (6, 2), **options: Any
) -> Scene:
    """Cantilever plate under a load at its edge, sudden or within 0.2 s."""
    steel = sm.Isotropic(E=210e9, nu=0.25, thickness=2e-3, density=7870)
    body = sm.Shell("plate", sm.Rectangle(1.0, 0.08), steel, mesh=mesh)
    time_: Any = {} if load == "sudden" else {"time": sm.Ramp(0.2)}
    force = sm.EdgeForce("right", (0, 0, 25.0), **time_)
    tip = sm.Probe("tip", (1.0, 0.04, 0.0), component=2)
    times = {"dt": 5e-3, "t_end": 0.5} | options
    name = f"plate, {load}, {scheme}, {mesh[0]}x{mesh[1]}"
    return sm.Scene(
        name,
        (body,),
        supports=(sm.Clamped("left"),),
        loads=(force,),
        probes=(tip,),
        scheme=scheme,
        **times,
    )


def static_plate(mesh: tuple[int, int], pressure: float = 2e3) -> Scene:
    """Clamped square plate under pressure, with large deflections."""
    steel = sm.Isotropic(E=210e9, nu=0.3, thickness=5e-3, density=7870)
    body = sm.Shell("plate", sm.Rectangle(1.0, 1.0), steel, mesh=mesh)
    middle = sm.Probe("middle", (0.5, 0.5, 0.0), component=2)
    held = tuple(sm.Clamped(edge) for edge in ("left", "right", "bottom", "top"))
    load = sm.Pressure(pressure)
    name = f"clamped plate, {mesh[0]}x{mesh[1]}"
    return sm.Scene(name, (body,), supports=held, loads=(load,), probes=(middle,), scheme="static")


def pendulum(scheme: str, links: int = 2, dt: float = 0.01) -> Scene:
    """Chain of rigid links that falls from the horizontal."""
    bodies = tuple(
        sm.RigidBody(f"link{k}", mass=1.0, inertia=(1e-3, 4e-3, 4e-3), com=(0.1 + 0.2 * k, 0, 0))
        for k in range(links)
    )
    joints = tuple(
        sm.Revolute(
            f"hinge{k}",
            sm.GROUND if k == 0 else f"link{k - 1}",
            f"link{k}",
            at=(0.2 * k, 0.0, 0.0),
            axis=(0.0, 1.0, 0.0),
        )
        for k in range(links)
    )
    tips: Any = tuple(
        sm.Probe(f"tip_{a}", (0.2 * links, 0, 0), component=k, body=f"link{links - 1}")  # type: ignore[arg-type]
        for k, a in ((0, "x"), (2, "z"))
    )
    return sm.Scene(
        f"chain of {links}, {scheme}",
        rigid_bodies=bodies,
        joints=joints,
        loads=(sm.Gravity((0, 0, -9.81)),),
        probes=tips,
        scheme=scheme,
        dt=dt,
        t_end=0.6,
    )


def demo(name: str, label: str, **parameters: Any) -> Scene:
    """A bundled scene."""
    return replace(sm.load_scene(name, **parameters), name=label)


SCENES: tuple[Callable[[], Scene], ...] = (
    lambda: plate("ep4"),
    lambda: plate("ep", dt=2.5e-3),
    lambda: plate("ed3", alpha=0.5),
    lambda: plate("ed", alpha=0.5),
    lambda: plate("ep4", mesh=(12, 3)),
    lambda: plate("ep4", "ramp", dt=1e-2),
    lambda: plate("ed3", "ramp", dt=1e-2, alpha=0.5),
    lambda: plate("ep", "ramp", dt=1e-2),
    lambda: static_plate((4, 4)),
    lambda: static_plate((8, 8)),
    lambda: pendulum("ep4", dt=0.02),
    lambda: pendulum("ep", dt=5e-3),
    lambda: pendulum("ed3", dt=0.02),
    lambda: demo("spin_up_beam", "spun-up beam, ep", t_end=16.0),
    lambda: demo("right_angle_frame", "right angle frame", t_end=10.0),
    lambda: demo("heavy_top", "heavy top", dt=2e-3),
    lambda: demo("slider_crank", "slider-crank, flexible", flexible=True, t_end=0.1),
)


def finer(scene: Scene) -> Scene:
    """The reference of a scene.

    Args:
        scene: The scene.
    """
    shells = tuple(replace(s, mesh=(2 * s.mesh[0], 2 * s.mesh[1]), degree=3) for s in scene.shells)
    beams = tuple(
        replace(b, elements=2 * b.elements, degree=3) if isinstance(b, Beam) else b
        for b in scene.beams
    )
    scene = replace(scene, shells=shells, beams=beams)
    return scene if scene.static else scene.with_options(dt=(scene.dt or 0.0) / FINER_STEP)


def _true(run: RunResult, reference: RunResult, quantity: Quantity, size: float) -> float:
    mine = quantity.take(run.results, run.history)
    right = quantity.take(reference.results, reference.history)
    scale = size if quantity.is_curve else abs(right["value"])
    return quantity.difference(mine, right) * (scale or 1.0)


def compare(scene: Scene) -> Iterator[Row]:
    """Rows of a scene.

    Args:
        scene: The scene.
    """
    clock = time.process_time()
    run = execute(scene, pictures=False)
    bare, clock = time.process_time() - clock, time.process_time()
    errors = estimate_errors(run)
    print(f"{scene.name}: {bare:.2f} s, errors {time.process_time() - clock:.2f} s", flush=True)
    for remark in errors.remarks:
        print(f"  {remark}")
    reference = execute(finer(scene), pictures=False)
    found: dict[Quantity, Found] = {Quantity(k): f for k, f in errors.results.items()}
    found |= {parse_quantity(k): f for k, f in errors.probes.items()}
    for quantity, f in found.items():
        true = _true(run, reference, quantity, f.value)
        stated = f.to_dict()["error"]
        yield Row(scene.name, str(quantity), f.value, stated, true)


def main(names: list[str]) -> None:
    """Print the table.

    Args:
        names: Parts of names of scenes; none: all.
    """
    rows: list[Row] = []
    for make in SCENES:
        scene = make()
        if names and not any(n in scene.name for n in names):
            continue
        for row in compare(scene):
            rows.append(row)
            ratio = "-" if row.ratio is None else f"{row.ratio:.2f}"
            stated = "-" if row.stated is None else f"{row.stated:.2e}"
            print(
                f"| {row.scene} | {row.quantity} | {row.value:.6g} | {stated} | {row.true:.2e} | "
                f"{ratio} |",
                flush=True,
            )
    ratios = [r.ratio for r in rows if r.ratio is not None]
    covered = sum(r >= 1 for r in ratios) / len(ratios)
    print(
        f"{len(ratios)} quantities: true <= stated in {100 * covered:.0f} %, median of stated over "
        f"true {median(ratios):.2f}, largest {max(ratios):.1f}, least {min(ratios):.2f}"
    )


if __name__ == "__main__":
    main(sys.argv[1:])
