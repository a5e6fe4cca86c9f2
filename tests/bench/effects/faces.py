"""Cost of contact with faces of shells: search and forces of a step by the number of pairs.

`python -m tests.bench.effects.faces`. Two square plates that cover one another touch everywhere;
each is refined. Processor time of what a step does, the shortest of several rounds in turn, and the
exponent with which it grows with the number of pairs.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any

from mpi4py import MPI

import numpy as np

from shellmb.model.model import Model
from shellmb.scene import Contact, Faces, Isotropic, Rectangle, Scene, Shell
from shellmb.schemes.registry import make_scheme
from shellmb.simulate.couplings.faces import FacesCoupling
from shellmb.simulate.problem import Problem

# elements along each side of both plates
MESHES = (4, 8, 16, 32)
ROUNDS = 3
# exponent that is asked for
MOST = 1.1
# what a step does
PARTS = ("search", "forces", "derivatives")
THICKNESS, DEPTH, SIDE = 5e-3, 1e-4, 0.2


def touching(count: int, rubs: bool) -> FacesCoupling:
    """Contact of two plates of as many elements along a side, in the middle of an impact.

    Args:
        count: Elements along a side.
        rubs: Whether there is friction.
    """
    section = Isotropic(70e9, 0.3, thickness=THICKNESS, density=2700.0)
    places = {"low": (0.0, 0.0, 0.0), "up": (1e-3, 2e-3, THICKNESS)}
    shells = [
        Shell(name, Rectangle(SIDE, SIDE, origin=at), section, mesh=(count, count))
        for name, at in places.items()
    ]
    law: dict[str, Any] = {"friction": 0.3, "slip_speed": 1e-2} if rubs else {}
    # they begin to touch when they are nearer than at the start
    faces = Faces("low", 2 * (THICKNESS - DEPTH))
    contact = Contact("touch", faces, 1e8, "up", smoothing=2e-5, **law)
    scene = Scene("touching", tuple(shells), contacts=(contact,), scheme="ep", dt=1e-4, t_end=1e-3)
    model = Model(scene, MPI.COMM_SELF)
    problem = Problem(model, make_scheme(scene.scheme, scene.dissipation))
    levels = problem.levels["up"]
    dofs = model.shells["up"].mixed.dofs["u"].reshape(-1, 3)
    for function in (levels.q, *levels.unknown.values()):
        function.x.array[dofs[:, 2]] = -2 * DEPTH
    (coupling,) = problem.couplings
    coupling.look(1e-4)
    return coupling


def seconds(work: Callable[[], object]) -> float:
    """Processor time of something, the shortest of several rounds, s."""
    found = []
    for _ in range(ROUNDS):
        begin = time.process_time()
        work()
        found.append(time.process_time() - begin)
    return min(found)


def exponent(sizes: list[int], times: list[float]) -> float:
    """Exponent with which times grow with sizes, by least squares."""
    return float(np.polyfit(np.log(sizes), np.log(times), 1)[0])


def main() -> None:
    """Print a line for each mesh, and the exponents.

    Raises:
        SystemExit: If a part grows faster than is asked.
    """
    failed = False
    for rubs in (False, True):
        print("friction" if rubs else "smooth")
        print("mesh     pairs  " + "  ".join(f"{part + ' [ms]':>17}" for part in PARTS))
        sizes, times = [], []
        for count in MESHES:
            coupling = touching(count, rubs)
            search = partial(coupling.contact.candidates, *coupling.start())
            work = search, coupling.residual, coupling.jacobian
            sizes.append(len(coupling.candidates.point))
            times.append([seconds(part) for part in work])
            row = "  ".join(f"{1e3 * t:17.2f}" for t in times[-1])
            print(f"{count}x{count:<4} {sizes[-1]:7} {row}", flush=True)
        found = [exponent(sizes, [row[k] for row in times]) for k in range(len(PARTS))]
        print(f"{'exponent':14} " + "  ".join(f"{one:17.2f}" for one in found), flush=True)
        failed |= max(found) > MOST
    if failed:
        raise SystemExit(f"a part grows with an exponent of more than {MOST:g}")


if __name__ == "__main__":
    main()
