"""Element-wise unknowns of a cell: which are eliminated together."""

from typing import Any

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import numpy as np
import pytest

from shellmb.native.library import CArrays
from shellmb.scene import (
    Beam,
    Clamped,
    Hyperelastic,
    Isotropic,
    Line,
    Rectangle,
    RectangularSection,
    Scene,
    Shell,
)
from shellmb.simulate.simulation import Simulation
from shellmb.system.assembly import loops
from shellmb.system.condensation.elimination import EliminationBlocks, elimination
from shellmb.system.condensation.meshreduction import MeshReduction
from tests.scenes import plate

RUBBER = Isotropic(E=1e7, nu=0.3, thickness=0.01, density=1e3)


def part(scheme: str, **body: Shell | Beam) -> MeshReduction:
    """Reduction of the mesh with element-wise unknowns."""
    end = "left" if "shells" in body else "start"
    times = {} if scheme == "static" else {"dt": 0.1, "t_end": 1.0}
    scene = Scene("one", supports=Clamped(end), scheme=scheme, **times, **body)
    return next(p for p in Simulation(scene).problem.iteration.linear.parts if p.chunks.widths)


@pytest.mark.parametrize(("scheme", "stages"), [("ep", 1), ("ed", 2)])
def test_membrane_and_shear_forces_of_a_plate_are_apart(scheme, stages) -> None:
    """Five of either shear; thirteen without and three with a mean; of both stages."""
    assert sorted(part(scheme, shells=plate(RUBBER)).chunks.widths) == stages * [10] + stages * [16]


def test_forces_of_a_beam() -> None:
    section = RectangularSection(E=1e7, nu=0.3, width=0.1, height=0.1, density=1e3)
    beam = Beam("beam", Line((0, 0, 0), (1, 0, 0)), section, elements=2, up=(0, 0, 1))
    found = part("ep", beams=beam)
    assert sum(found.chunks.widths) == found.cells.size - found.cells.shared > 0


@pytest.mark.parametrize(("kinds", "widths"), [(3, [10, 16, 26]), (2, [10, 10, 32])])
def test_what_an_energy_leaves_out_is_eliminated_with_its_forces(
    kinds: int, widths: list[int]
) -> None:
    """Without stiffness of one kind of strain the matrix of strains alone is singular."""

    def energy(strains: Any, p: Any) -> Any:
        return p["mu"] * sum(x * x for part in strains for x in list(part)[:kinds])

    law = Hyperelastic(energy, {"mu": 1e4}, thickness=0.01, density=1e3, stiffness=1e4)
    assert sorted(part("static", shells=plate(law)).chunks.widths) == widths


def test_the_unit_decides_no_entry() -> None:
    """In Gm one was zero in round-off at the state that tells, and so was left out for good."""

    def entries(metre: float) -> float:
        section = Isotropic(7e10 / metre, 0.3, thickness=2e-3 * metre, density=2700 / metre**3)
        surface = Rectangle(metre, 0.5 * metre)
        scene = Scene(
            "plate",
            Shell("plate", surface, section, mesh=(4, 2)),
            supports=Clamped("left"),
            scheme="ep",
            dt=0.1,
            t_end=1.0,
        )
        return Simulation(scene).problem.iteration.linear.A.getInfo()["nz_used"]

    assert entries(1e9) == entries(1.0) == entries(1e-9)


def test_elimination_by_runs_is_that_of_the_whole() -> None:
    """What is kept of a cell, put together by hand, against the dense Schur complement."""
    random = np.random.default_rng(3)
    # two chunks behind five others; the second is seen by the first, the last of the five by none
    pattern = np.zeros((10, 10), dtype=bool)
    pattern[5:7, [0, 1, 5, 6, 7, 8, 9]] = True
    pattern[[0, 1, 7, 8, 9], 5:7] = True
    pattern[7:, [2, 3, 7, 8, 9]] = True
    pattern[[2, 3], 7:] = True
    pattern[:5, :5] = True
    K = np.where(pattern, random.normal(size=(10, 10)), 0.0) + 5 * np.eye(10)
    wanted = K[:5, :5] - K[:5, 5:] @ np.linalg.inv(K[5:, 5:]) @ K[5:, :5]
    pointer = CArrays()
    members, _ = elimination(EliminationBlocks(np.arange(10), [2, 3], pattern), pointer)
    for s in range(members["chunks"]):
        E = members["chunk_start"][s] + np.arange(members["chunk_width"][s])
        sides = {}
        for side in ("left", "right"):
            runs = members[side]
            here = range(runs["first"][s], runs["first"][s + 1])
            pieces = [runs["start"][r] + np.arange(runs["width"][r]) for r in here]
            sides[side] = np.concatenate(pieces)
        x, y = np.ix_(sides["left"], E), np.ix_(E, sides["right"])
        K[np.ix_(sides["left"], sides["right"])] -= K[x] @ np.linalg.inv(K[np.ix_(E, E)]) @ K[y]
    assert np.allclose(K[:5, :5], wanted, rtol=1e-12, atol=1e-12)
    # what nothing of the first chunk sees is in none of its runs
    runs = members["right"]
    first = range(runs["first"][0], runs["first"][1])
    assert {runs["start"][r] for r in first} == {0, 7}


def test_what_is_found_anew_is_what_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """Programs of many cells keep nothing; bit for bit matrices and residuals stay."""

    def values(most: int) -> np.ndarray:
        monkeypatch.setattr(loops, "MOST_KEPT", most)
        scene = Scene(
            "one", plate(RUBBER), supports=Clamped("left"), scheme="ep", dt=0.1, t_end=1.0
        )
        linear = Simulation(scene).problem.iteration.linear
        system = linear.system
        for loop in (linear.parts[0].loop, *system.residuals.loops):
            stores = [loop.kernels[k].store for k in range(loop.count)]
            assert any(stores) == (most > 0)
        # the second time with what is kept
        for _ in range(2):
            linear._assemble()
            system.residual(system.x, system.b)
        return np.concatenate([linear.A.getValuesCSR()[2], system.b.array_r])

    np.testing.assert_array_equal(values(0), values(1000))


@pytest.mark.parametrize("scheme", ["ep", "ed"])
def test_inverses_of_cells_are_kept_once(scheme: str) -> None:
    """Those of a linear section are found once, and read where solutions look for them."""
    scene = Scene("one", plate(RUBBER), supports=Clamped("left"), scheme=scheme, dt=0.1, t_end=1.0)
    linear = Simulation(scene).problem.iteration.linear
    found = linear.parts[0]
    assert len(found._blocks) == found.cells.count * sum(w * w for w in found.chunks.widths)
    values = []
    for _ in range(2):
        linear._assemble()
        values.append(np.array(linear.A.getValuesCSR()[2]))
        # the second time they are found anew
        found._blocks[:] = np.nan
    np.testing.assert_array_equal(*values)
