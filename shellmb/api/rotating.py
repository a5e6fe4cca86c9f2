"""Modes over the rate of a steady rotation, just found or read back: a Campbell diagram."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

from shellmb.api.modeshapes import ModeShapes, Stability
from shellmb.errors import SceneError

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt
    import pandas as pd
    from matplotlib.figure import Figure


TABLE = "campbell.csv"


class RotatingModes(Stability):
    """Modes at several rates of rotation in their directory.

    Args:
        directory: The directory.
        computed: What was found in this process.

    Attributes:
        directory: The directory.
        computed: Eigenvalues, shapes and model of modes that were just found; None of those that
            were read back.
    """

    @property
    def rates(self) -> list[float]:
        """The rates, rad/s."""
        return list(self.summary["rates_rad_per_s"])

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about unreliable results; empty if there are none."""
        return tuple(self.summary.get("warnings", ()))

    @cached_property
    def table(self) -> pd.DataFrame:
        """All modes: frequency, growth, damping ratio, whirl, by rate and branch."""
        import pandas as pd

        read = pd.read_csv(self.directory / TABLE, keep_default_na=False)
        return read.set_index(["rate_rad_per_s", "branch"])

    @cached_property
    def frequencies(self) -> npt.NDArray[np.float64]:
        """Damped frequencies, Hz, shape (rates, branches); NaN where a branch has no mode."""
        import numpy as np

        wide = self.table["frequency_hz"].unstack("branch").sort_index()
        return np.asarray(wide.to_numpy(dtype=float))

    def at(self, rate: float) -> ModeShapes:
        """Shapes at one of the rates, with their pictures and animations.

        Args:
            rate: The rate, rad/s.

        Raises:
            SceneError: If it is none of them.
        """
        for number, own in enumerate(self.rates, start=1):
            if abs(own - rate) <= 1e-9 * max(abs(own), 1.0):
                return ModeShapes(self.directory / f"rate_{number}")
        listed = ", ".join(f"{own:g}" for own in self.rates)
        raise SceneError(f"rate is {rate:g}; it must be one of {listed}")

    def plot(self) -> Figure:
        """The Campbell diagram, a matplotlib figure."""
        from shellmb.show.campbell import campbell_figure

        return campbell_figure(self.directory / TABLE)

    def __repr__(self) -> str:
        return (
            f"<RotatingModes of '{self.summary['scene']}': {len(self.rates)} rates from "
            f"{self.rates[0]:g} to {self.rates[-1]:g} rad/s, {self.verdict}, {self.directory}>"
        )

    def _repr_html_(self) -> str:
        from shellmb.show.report import campbell_card

        return campbell_card(self, self.plot())


class StateModes(ModeShapes, Stability):
    """Modes about a state of a run in their directory, as seen from a frame that turns along.

    `frequencies` are damped ones; `table` has growth, damping ratio and whirl of each mode.
    """

    @property
    def rate(self) -> float:
        """Rate of the frame, rad/s."""
        return float(self.summary["rate_rad_per_s"])

    @property
    def damping(self) -> list[float]:
        """Damping ratios `-Re s/|s|`, those of rigid modes zero."""
        return list(self.summary["damping_ratios"])

    @property
    def drift(self) -> float:
        """Distance that the state moves during one radian of its slowest mode, in lengths."""
        return float(self.summary["drift"])

    def __repr__(self) -> str:
        return f"<StateModes of '{self.described.name}' {self.verdict}, {self.directory}>"
