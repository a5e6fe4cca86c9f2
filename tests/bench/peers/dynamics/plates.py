"""The plate in each code: what is run."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

from tests.bench.peers import exudyn, kratos, ngsolve, opensees
from tests.bench.peers.codes import EXUDYN, KRATOS, NGSOLVE, OPENSEES, OURS
from tests.bench.peers.dynamics.exudyn_plate import ExudynPlate
from tests.bench.peers.dynamics.history import TipHistory
from tests.bench.peers.dynamics.motion import Motion, Runs, Study
from tests.bench.peers.dynamics.opensees_plate import OpenSeesPlate
from tests.bench.peers.dynamics.our_plate import OurPlate

# how a peer is called on the command line, and what it asks for being installed
# the last two in static problems only
PEERS = {"exudyn": EXUDYN, "opensees": OPENSEES, "kratos": KRATOS, "ngsolve": NGSOLVE}
REQUIRE = {
    EXUDYN: exudyn.require,
    OPENSEES: opensees.require,
    KRATOS: kratos.require,
    NGSOLVE: ngsolve.require,
}


# Newton's method of each code ends as early as it may: at the power of ten at which its answer is
# still within a tenth of the least error that is claimed, 0.1 %, of that with 1e-6. Relative to the
# tip's largest deflection that leaves 1e-7 (ours, 1e-2), 2e-5 to 1e-4 (Exudyn, 1e-3), 9e-6
# (OpenSees, 1e-3; with 1e-2 it is the same). Answers that are compared with have 1e-6
EXACT = 1e-6


def _ours() -> Runs:
    meshes = ((3, 1), (4, 1), (8, 1), (8, 2), (10, 2), (12, 2))
    steps = (2e-2, 1e-2, 7.8125e-3, 5e-3, 2.5e-3)
    schemes = (("ep", 0.0), ("ed", 1.0), ("ed", 0.0), ("ep4", 0.0), ("ed3", 0.5))
    return Runs(
        (
            OurPlate((24, 4), 1e-3, "ep4", 0.0, tolerance=EXACT),
            OurPlate((16, 4), 1e-3, "ed", 0.0, tolerance=EXACT),
        ),
        [OurPlate(m, dt, s, alpha) for m in meshes for dt in steps for s, alpha in schemes],
    )


def _exudyn() -> Runs:
    meshes = ((8, 1), (8, 2), (12, 2), (12, 4), (14, 4), (16, 4))
    steps = (2.5e-3, 1.25e-3, 1e-3)
    radii = (0.9, 1.0)
    return Runs(
        (
            ExudynPlate((24, 6), 1e-3, tolerance=EXACT),
            ExudynPlate((16, 4), 5e-4, tolerance=EXACT),
        ),
        [ExudynPlate(m, dt, spectral_radius=r) for m in meshes for dt in steps for r in radii],
    )


def _opensees() -> Runs:
    meshes = ((6, 1), (8, 1), (12, 1), (12, 2), (16, 2), (16, 4))
    steps = (1e-2, 5e-3, 3.125e-3, 2.5e-3)
    best = (("NLDKGQ", "Newmark"), ("NLDKGQ", "TRBDF2"), ("ASD", "HHT 0.9"))
    # those that lose much of the motion, or all of it, on every mesh: once each
    poor = (("NLDKGQ", "HHT 0.9"), ("ASD", "generalised alpha"), ("NLDKGQ", "generalised alpha"))
    return Runs(
        (
            OpenSeesPlate((24, 4), 1e-3, tolerance=EXACT),
            OpenSeesPlate((16, 4), 2e-3, tolerance=EXACT),
        ),
        [
            *(OpenSeesPlate(m, dt, *how) for m in meshes for dt in steps for how in best),
            *(OpenSeesPlate((8, 1), 5e-3, *how) for how in poor),
        ],
    )


STUDY = Study(
    "peer",
    "cantilever plate under a sudden load, 0.5 s: its tip",
    {OURS: _ours(), EXUDYN: _exudyn(), OPENSEES: _opensees()},
    {
        OURS: Runs(
            (OurPlate((3, 1), 1e-2, "ed", 0.0), OurPlate((2, 1), 1e-2)),
            [OurPlate((2, 1), 2e-2, s, alpha) for s, alpha in (("ep", 0.0), ("ed", 0.0))],
        ),
        EXUDYN: Runs(
            (ExudynPlate((4, 1), 2.5e-3), ExudynPlate((2, 1), 2.5e-3)),
            [ExudynPlate((2, 1), 2.5e-3, spectral_radius=r) for r in (0.9, 1.0)],
        ),
        OPENSEES: Runs(
            (OpenSeesPlate((4, 1), 1e-2), OpenSeesPlate((3, 1), 1e-2)),
            [OpenSeesPlate((2, 1), 2e-2, *how) for how in (("ASD", "HHT 0.9"), ("NLDKGQ",))],
        ),
    },
)


def large_load(
    peers: Collection[str], steps: Sequence[float] = (4e-3, 1e-3), t_end: float = 1.0
) -> list[tuple[Motion, TipHistory]]:
    """A plate, 12x2, under 40 N: who comes through, with which step.

    Args:
        peers: Codes beside ours.
        steps: Time steps, s.
        t_end: End, s.
    """
    mesh, force = (12, 2), 40.0
    plates: list[Motion] = []
    for dt in steps:
        done: dict[str, Any] = {"force": force, "t_end": t_end, "tolerance": EXACT}
        plates += [OurPlate(mesh, dt, s, **done) for s in ("ep", "ed")]
        if EXUDYN in peers:
            plates += [
                ExudynPlate(mesh, dt, radius, modified=modified, **done)
                for radius in (0.9, 1.0)
                for modified in (True, False)
            ]
        if OPENSEES in peers:
            plates += [
                OpenSeesPlate(mesh, dt, *how, **done)
                for how in (("NLDKGQ", "Newmark"), ("NLDKGQ", "TRBDF2"), ("ASD", "HHT 0.9"))
            ]
    return [(plate, plate.run()) for plate in plates]
