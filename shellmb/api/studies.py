"""Studies: what accuracy costs in time, as a table."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import pandas as pd

from shellmb.api.runs import as_text, path_of
from shellmb.errors import SceneError
from shellmb.options.described import checks, options_of, takes
from shellmb.options.run import Options, StudyOptions
from shellmb.scene import Scene

if TYPE_CHECKING:
    from shellmb.accuracy.studies.report import Finding


@checks
@dataclass(frozen=True)
class Study:
    """Results of a study.

    Args:
        findings: One for each quantity.
    """

    findings: tuple[Finding, ...]

    @property
    def table(self) -> pd.DataFrame:
        """A row for each quantity and configuration: choices, error, time, steps, iterations."""
        names = {"error": "error", "below": "below_reference", "time_s": "time_s"}
        names |= {name: name for name in ("steps", "iterations", "failed")}
        return pd.DataFrame(
            {"quantity": str(f.judged.quantity), **p.choice.to_dict()}
            | {shown: getattr(p, name) for name, shown in names.items()}
            for f in self.findings
            for p in f.judged.points
        )

    @property
    def orders(self) -> pd.DataFrame:
        """Observed orders."""
        rows = ((str(f.judged.quantity), order) for f in self.findings for order in f.orders)
        return pd.DataFrame({"quantity": quantity, **asdict(order)} for quantity, order in rows)

    @property
    def advice(self) -> str:
        """The cheapest choice for each accuracy, as text."""
        return "\n".join(f.sentence for f in self.findings)

    def plot(self, file: Path | str) -> Path:
        """Draw error over time.

        Args:
            file: The picture.
        """
        from shellmb.accuracy.studies.picture import draw

        draw([(f.title, f.judged) for f in self.findings], Path(file))
        return Path(file)

    def __repr__(self) -> str:
        count = sum(len(f.judged.points) for f in self.findings)
        names = ", ".join(f.title for f in self.findings)
        return f"<Study {names}: {count} configurations>\n{self.advice}"

    def _repr_html_(self) -> str:
        table: str = self.table.to_html(index=False)
        return f"<p>{self.advice}</p>{table}"


@takes(*options_of(StudyOptions), *options_of(Options, "body", "t_end"))
def study(
    scene: Scene | Callable[..., Scene] | str,
    *,
    quantity: str | Sequence[str] = (),
    parameters: Mapping[str, Any] | None = None,
    repeat: int = 1,
    out: Path | str | None = None,
    clock: Literal["wall", "cpu"] = "wall",
    tell: Callable[[str], None] | None = None,
    **options: Any,
) -> Study:
    """Measure error against time for all combinations of options.

    Args:
        scene: A scene, a function that makes one from `parameters`, the name of a bundled scene, or
            the path of a Python file.
        quantity: Names of results, or "COLUMN:NORM" of the history with the norm end, max, min,
            mean, l2 or sup; none: the first probe.
        parameters: Values of the scene's parameters.
        repeat: Number of rounds over all runs, for the times.
        out: Directory of the records; a study in it continues. None: nothing is kept.
        clock: "wall" or "cpu".
        tell: Callback for progress messages.
        **options: Choices and references, as `shellmb study` has them.

    Raises:
        SceneError: If the scene, a value or a quantity is impossible.
        ConvergenceError: If the reference fails.
    """
    from shellmb.accuracy.studies.report import evaluate
    from shellmb.accuracy.studies.runner import measure
    from shellmb.accuracy.studies.sweep import sweep_of
    from shellmb.running.loader import SceneModule, given

    if not isinstance(scene, str | Scene) and not callable(scene):
        raise SceneError(
            f"study: scene is a {type(scene).__name__}; it must be a Scene, a function that makes "
            "one, the name of a bundled scene, or the path of a Python file"
        )
    source: str | SceneModule = scene if isinstance(scene, str) else given(scene, parameters or {})
    text = as_text(parameters or {}) if isinstance(scene, str) else {}
    quantities = [quantity] if isinstance(quantity, str) else quantity
    sweep = sweep_of(source, text, quantities, repeat=repeat, **options)
    folder = None if out is None else path_of(out)
    measured = measure(sweep, folder, tell or (lambda text: None))
    return Study(tuple(evaluate(measured, clock)))
