"""Stated beside true errors of a case."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from mpi4py import MPI

from shellmb.accuracy.errors import add_errors
from shellmb.accuracy.modes import frequencies, mode_errors
from shellmb.accuracy.run_record import RunRecord, keep
from shellmb.accuracy.studies.quantity import Quantity, parse_quantity
from shellmb.meshes.lifetime import free
from shellmb.running.execute import execute
from shellmb.running.loader import demos, load
from shellmb.running.natural_modes.vibration import natural_modes
from shellmb.running.results import Results
from shellmb.scene import Scene
from tests.bench.errors.case import Case

# below this part of the size of the quantity errors are of Newton's method and of round-off
ROUND_OFF = 1e-8


@dataclass(frozen=True)
class Row:
    """A quantity with its stated and its true error.

    Args:
        case: Name of the case.
        kind: Its kind.
        quantity: Name of the quantity.
        value: Its value.
        stated: The stated error; None: not known.
        mesh: The part of the mesh.
        step: The part of the step.
        true: The true one.
        said: Whether the run says in words that errors are doubtful or not known.
    """

    case: str
    kind: str
    quantity: str
    value: float
    stated: float | None
    mesh: float | None
    step: float | None
    true: float
    said: bool

    @property
    def ratio(self) -> float | None:
        """Stated over true error; None where it is not known, or both are round-off."""
        if self.stated is None:
            return None
        least = ROUND_OFF * max(abs(self.value), 1e-300)
        return None if max(self.stated, self.true) <= least else self.stated / max(self.true, least)


@dataclass(frozen=True)
class Compared:
    """Result of a case.

    Args:
        rows: Its quantities.
        bare_s: Processor time of the run without errors [s], everything compiled.
        errors_s: Processor time of the run with errors [s].
        remarks: What the run says of its errors.
    """

    rows: tuple[Row, ...]
    bare_s: float
    errors_s: float
    remarks: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """For machines."""
        return asdict(self) | {"rows": [asdict(row) for row in self.rows]}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Compared:
        """Read what `to_dict` wrote."""
        rows = tuple(Row(**row) for row in values["rows"])
        return cls(rows, values["bare_s"], values["errors_s"], tuple(values["remarks"]))


def compare(case: Case) -> Compared:
    """Run a case with errors, and its reference.

    Args:
        case: The case.
    """
    scene = case.make()
    if case.kind == "modes":
        return _compare_modes(case, scene)
    results = _results_of(scene)
    # kernels are compiled, libraries loaded
    add_errors(execute(scene, pictures=False, results=results))
    free()
    clock = time.process_time()
    execute(scene, pictures=False, results=results)
    bare = time.process_time() - clock
    free()
    clock = time.process_time()
    run = add_errors(execute(scene, pictures=False, results=results))
    with_errors = time.process_time() - clock
    mine, found = keep(run), run.summary["errors"]
    stated = {**run.summary["results"], **found["probes"]}
    said = tuple(found["remarks"])
    free()
    fine: RunRecord | None = None
    if set(case.quantities) - set(case.exact):
        fine = keep(execute(case.finer(scene), pictures=False, results=results))
    rows = []
    for name in case.quantities:
        quantity = Quantity(name) if name in mine.results else parse_quantity(name)
        true = _true(mine, fine, quantity, case.exact.get(name))
        rows.append(_row(case, name, stated[name], true, bool(said)))
    return Compared(tuple(rows), bare, with_errors, said)


def _results_of(scene: Scene) -> Results | None:
    """The results of a scene, also of a bundled one, which its module gives."""
    return load(scene.name).results if scene.name in demos() else scene.results


def _true(
    mine: RunRecord, fine: RunRecord | None, quantity: Quantity, exact: float | None
) -> float:
    if exact is not None:
        return abs(mine.size(quantity) - exact)
    assert fine is not None
    taken = fine.take(quantity)
    size = abs(fine.size(quantity)) or 1.0
    return quantity.difference(mine.take(quantity), taken) * size


def _row(case: Case, name: str, found: Mapping[str, Any], true: float, said: bool) -> Row:
    parts = {k: found[f"error_{k}"] for k in ("mesh", "step")}
    return Row(
        case.name, case.kind, name, found["value"], found["error"], **parts, true=true, said=said
    )


def _compare_modes(case: Case, scene: Scene) -> Compared:
    count = max(int(name.removeprefix("f")) for name in case.quantities)
    mode_errors(scene, natural_modes(scene, MPI.COMM_WORLD, count), {}, False, None)
    free()
    clock = time.process_time()
    modes = natural_modes(scene, MPI.COMM_WORLD, count)
    bare = time.process_time() - clock
    clock = time.process_time()
    errors = mode_errors(scene, modes, {}, False, None)
    cost = bare + time.process_time() - clock
    fine = frequencies(natural_modes(case.finer(scene), MPI.COMM_WORLD, count))
    rows = []
    for name in case.quantities:
        right, estimate = case.exact.get(name, fine[name]), errors.others[name]
        true = math.fabs(estimate.value - right)
        rows.append(_row(case, name, estimate.to_dict(), true, bool(errors.remarks)))
    return Compared(tuple(rows), bare, cost, errors.remarks)
