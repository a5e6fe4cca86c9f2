"""Studies: what accuracy costs in time, as a table."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from shellmb.api.asked import as_text
from shellmb.errors import SceneError
from shellmb.scene import Scene

if TYPE_CHECKING:
    import pandas as pd

    from shellmb.studies.report import Finding


@dataclass(frozen=True)
class Study:
    """What a study found.

    Args:
        findings: One for each quantity.
    """

    findings: tuple[Finding, ...]

    @property
    def table(self) -> pd.DataFrame:
        """A row for each quantity and configuration: choices, error, time, steps, iterations."""
        import pandas as pd

        rows = []
        for finding in self.findings:
            for p in finding.judged.points:
                row: dict[str, Any] = {"quantity": str(finding.judged.quantity)}
                row |= p.choice.to_dict()
                row |= {"error": p.error, "below_reference": p.below, "time_s": p.time_s}
                row |= {"steps": p.steps, "iterations": p.iterations, "failed": p.failed}
                rows.append(row)
        return pd.DataFrame(rows)

    @property
    def orders(self) -> pd.DataFrame:
        """Observed orders."""
        from dataclasses import asdict

        import pandas as pd

        rows = [
            {"quantity": str(f.judged.quantity), **asdict(o)}
            for f in self.findings
            for o in f.orders
        ]
        return pd.DataFrame(rows)

    @property
    def advice(self) -> str:
        """What to take for which accuracy, in words."""
        return "\n".join(f.sentence for f in self.findings)

    def plot(self, file: Path | str) -> Path:
        """Draw error over time.

        Args:
            file: The picture.
        """
        from shellmb.studies.picture import draw

        draw([(f.title, f.judged) for f in self.findings], Path(file))
        return Path(file)

    def __repr__(self) -> str:
        count = sum(len(f.judged.points) for f in self.findings)
        names = ", ".join(f.title for f in self.findings)
        return f"<Study {names}: {count} configurations>\n{self.advice}"

    def _repr_html_(self) -> str:
        table: str = self.table.to_html(index=False)
        return f"<p>{self.advice}</p>{table}"


def study(
    scene: Scene | Callable[..., Scene] | str,
    *,
    quantity: str | Sequence[str] = (),
    parameters: Mapping[str, Any] | None = None,
    scheme: Sequence[str] = (),
    alpha: Sequence[float] = (),
    dt: Sequence[float] = (),
    mesh: Sequence[tuple[int, int] | str] = (),
    degree: Sequence[int] = (),
    cell: Sequence[str] = (),
    model: Sequence[str] = (),
    solve: Sequence[str] = (),
    tolerance: Sequence[float] = (),
    exact: float | None = None,
    reference: str | None = None,
    refine: int = 2,
    repeat: int = 1,
    body: str | None = None,
    t_end: float | None = None,
    out: Path | str | None = None,
    clock: str = "wall",
    tell: Callable[[str], None] | None = None,
) -> Study:
    """Error against time of all combinations of what is named, by a finer run or an exact value.

    Args:
        scene: A scene, a function that makes one from `parameters`, the name of a bundled scene, or
            the path of a Python file.
        quantity: Names of results, or "COLUMN:NORM" of the history with the norm end, max, min,
            mean, l2 or sup; none: the first probe.
        parameters: Values of the scene's parameters.
        scheme: Schemes to compare; as all that follow, none keeps the scene's.
        alpha: Dissipations.
        dt: Time or load steps.
        mesh: Counts of elements of shells, as (8, 4) or "8x4".
        degree: Degrees.
        cell: Cell types.
        model: How bodies deform: "exact", "linear", "modal:10", "rigid".
        solve: Unknowns of linear systems.
        tolerance: Tolerances of Newton's method.
        exact: The exact value; None: a finer run is the reference.
        reference: Scheme of the finer run.
        refine: How much finer it is than the finest run.
        repeat: Rounds of all, for the times.
        body: The only body that gets mesh, degree, cell.
        t_end: Time at the end.
        out: Directory of the records; a study in it goes on. None: nothing is kept.
        clock: "wall" or "cpu".
        tell: Is told what is going on.

    Raises:
        SceneError: If the scene, a value or a quantity is impossible.
        ConvergenceError: If the reference fails.
    """
    from shellmb.running.loader import SceneModule, given
    from shellmb.running.request import parse_mesh
    from shellmb.studies.choice import Base
    from shellmb.studies.quantity import parse_quantity
    from shellmb.studies.report import evaluate
    from shellmb.studies.runner import measure
    from shellmb.studies.sweep import Sweep

    if clock not in ("wall", "cpu"):
        raise SceneError(f"study: clock is '{clock}'; it must be 'wall' or 'cpu'")
    if not isinstance(scene, str | Scene) and not callable(scene):
        raise SceneError(
            f"study: scene is a {type(scene).__name__}; it must be a Scene, a function that makes "
            "one, the name of a bundled scene, or the path of a Python file"
        )
    source: str | SceneModule
    if isinstance(scene, str):
        source, text = scene, tuple(as_text(parameters or {}).items())
    else:
        source, text = given(scene, parameters or {}), ()
    quantities = [quantity] if isinstance(quantity, str) else quantity
    sweep = Sweep(
        Base(source, text, t_end, body),
        tuple(parse_quantity(q) for q in quantities),
        scheme=tuple(scheme),
        alpha=tuple(alpha),
        cell=tuple(cell),
        model=tuple(model),
        degree=tuple(degree),
        solve=tuple(solve),
        tolerance=tuple(tolerance),
        mesh=tuple(parse_mesh(m) if isinstance(m, str) else (m[0], m[1]) for m in mesh),
        dt=tuple(dt),
        exact=exact,
        reference=reference,
        refine=refine,
        repeat=repeat,
    )
    folder = None if out is None else Path(out)
    measured = measure(sweep, folder, tell or (lambda text: None))
    return Study(tuple(evaluate(measured, clock)))
