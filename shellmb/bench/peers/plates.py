"""The plate in each code: what is run, how, and what it is called."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from shellmb.bench.peers import exudyn_plate, opensees, opensees_plate, our_plate
from shellmb.bench.peers.exudyn_plate import ExudynPlate
from shellmb.bench.peers.history import TipHistory
from shellmb.bench.peers.opensees_plate import OpenSeesPlate
from shellmb.bench.peers.our_plate import OurPlate

type Plate = OurPlate | ExudynPlate | OpenSeesPlate

OURS, EXUDYN, OPENSEES = "shellmb", "Exudyn", "OpenSees"
# how a peer is called on the command line, and what it asks for being installed
PEERS = {"exudyn": EXUDYN, "opensees": OPENSEES}
REQUIRE = {EXUDYN: exudyn_plate.require, OPENSEES: opensees.require}


@dataclass(frozen=True)
class Runs:
    """What is run in one code.

    Args:
        fine: Converged answers, the finest first; the others check it.
        plates: Runs of the study.
    """

    fine: Sequence[Plate]
    plates: Sequence[Plate]


def _ours() -> Runs:
    meshes, steps = ((3, 1), (8, 1), (8, 2), (12, 2)), (2e-2, 1e-2, 5e-3, 2.5e-3)
    schemes = (("ep", 1.0), ("ed", 1.0), ("ed", 0.0))
    return Runs(
        (OurPlate((16, 4), 1e-3, "ed", 0.0), OurPlate((12, 4), 2e-3, "ed", 0.0)),
        [OurPlate(m, dt, s, alpha) for m in meshes for dt in steps for s, alpha in schemes],
    )


def _exudyn() -> Runs:
    meshes, steps = ((8, 1), (8, 2), (12, 2), (12, 4), (16, 4)), (2.5e-3, 1e-3)
    radii = (0.9, 1.0)
    return Runs(
        (ExudynPlate((24, 6), 1e-3), ExudynPlate((16, 4), 5e-4)),
        [ExudynPlate(m, dt, spectral_radius=r) for m in meshes for dt in steps for r in radii],
    )


def _opensees() -> Runs:
    meshes, steps = ((6, 1), (8, 1), (12, 1), (16, 2), (16, 4)), (1e-2, 5e-3, 2.5e-3)
    best = (("NLDKGQ", "Newmark"), ("NLDKGQ", "TRBDF2"), ("ASD", "HHT 0.9"))
    # those that lose much of the motion, or all of it, on every mesh: once each
    poor = (("NLDKGQ", "HHT 0.9"), ("ASD", "generalised alpha"), ("NLDKGQ", "generalised alpha"))
    return Runs(
        (OpenSeesPlate((24, 4), 1e-3), OpenSeesPlate((16, 4), 2e-3)),
        [
            *(OpenSeesPlate(m, dt, *how) for m in meshes for dt in steps for how in best),
            *(OpenSeesPlate((8, 1), 5e-3, *how) for how in poor),
        ],
    )


def every_run(peers: Collection[str]) -> dict[str, Runs]:
    """The study, by code, ours first.

    Args:
        peers: Codes beside ours.
    """
    makers = {OURS: _ours, EXUDYN: _exudyn, OPENSEES: _opensees}
    return {code: make() for code, make in makers.items() if code == OURS or code in peers}


def quick_runs(peers: Collection[str]) -> dict[str, Runs]:
    """What a test can wait for; otherwise as `every_run`."""
    few = {
        OURS: Runs(
            (OurPlate((3, 1), 1e-2, "ed", 0.0), OurPlate((2, 1), 1e-2)),
            [OurPlate((2, 1), 2e-2, s, alpha) for s, alpha in (("ep", 1.0), ("ed", 0.0))],
        ),
        EXUDYN: Runs(
            (ExudynPlate((4, 1), 2.5e-3), ExudynPlate((2, 1), 2.5e-3)),
            [ExudynPlate((2, 1), 2.5e-3, spectral_radius=r) for r in (0.9, 1.0)],
        ),
        OPENSEES: Runs(
            (OpenSeesPlate((4, 1), 1e-2), OpenSeesPlate((3, 1), 1e-2)),
            [OpenSeesPlate((2, 1), 2e-2, *how) for how in (("ASD", "HHT 0.9"), ("NLDKGQ",))],
        ),
    }
    return {code: runs for code, runs in few.items() if code == OURS or code in peers}


def run(plate: Plate) -> TipHistory:
    """Run it in its code."""
    if isinstance(plate, ExudynPlate):
        return exudyn_plate.run(plate)
    if isinstance(plate, OpenSeesPlate):
        return opensees_plate.run(plate)
    return our_plate.run(plate)


def code_of(plate: Plate) -> str:
    """The code that runs it."""
    if isinstance(plate, ExudynPlate):
        return EXUDYN
    return OPENSEES if isinstance(plate, OpenSeesPlate) else OURS


def scheme_of(plate: Plate) -> str:
    """Its time scheme in words, and its element where there are several."""
    if isinstance(plate, ExudynPlate):
        newton = "" if plate.modified else ", full Newton"
        return f"rho={plate.spectral_radius:g}{newton}"
    if isinstance(plate, OpenSeesPlate):
        return f"{plate.element}, {plate.integrator}"
    return "EP" if plate.scheme == "ep" else f"ED alpha={plate.alpha:g}"


def title(plate: Plate) -> str:
    """Mesh, step and scheme."""
    return f"{plate.mesh[0]}x{plate.mesh[1]}, dt = {plate.dt:g} s, {scheme_of(plate)}"


def large_load(
    peers: Collection[str], steps: Sequence[float] = (4e-3, 1e-3), t_end: float = 1.0
) -> list[tuple[Plate, TipHistory]]:
    """The same plate, 12x2, under 40 N: who comes through, with which step.

    Args:
        peers: Codes beside ours.
        steps: Time steps, s.
        t_end: End, s.
    """
    mesh, force = (12, 2), 40.0
    plates: list[Plate] = []
    for dt in steps:
        plates += [OurPlate(mesh, dt, s, force=force, t_end=t_end) for s in ("ep", "ed")]
        if EXUDYN in peers:
            plates += [
                ExudynPlate(mesh, dt, force, t_end, radius, modified=modified)
                for radius in (0.9, 1.0)
                for modified in (True, False)
            ]
        if OPENSEES in peers:
            plates += [
                OpenSeesPlate(mesh, dt, *how, force, t_end)
                for how in (("NLDKGQ", "Newmark"), ("NLDKGQ", "TRBDF2"), ("ASD", "HHT 0.9"))
            ]
    return [(plate, run(plate)) for plate in plates]
