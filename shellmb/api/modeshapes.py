"""Modes of vibration, buckling or rotations, just found or read back: numbers, shapes, pictures."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from shellmb.api.record import StoredResult
from shellmb.errors import SceneError
from shellmb.observers.files.described import Described, read_described
from shellmb.options.described import checks
from shellmb.show.fields import Fields

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt
    import pandas as pd
    import pyvista as pv
    from matplotlib.figure import Figure

    from shellmb.running.natural_modes.run import BucklingModes
    from shellmb.running.natural_modes.vibration import Modes
    from shellmb.running.rotating.state import StateModes as AboutState

TABLE, CAMPBELL = "modes.csv", "campbell.csv"


class Stability(StoredResult):
    """Modes that tell whether what they are about is stable."""

    @property
    def stable(self) -> bool:
        """Decide whether no mode grows."""
        return bool(self.summary["stable"])

    @property
    def verdict(self) -> str:
        """The stability as a sentence, which names the first mode that grows."""
        return str(self.summary["verdict"])


@checks
class ModeShapes(StoredResult):
    """Modes of vibration or of linear buckling in their directory, lowest first.

    Args:
        directory: The directory.
        computed: What was found in this process.

    Attributes:
        directory: The directory.
        computed: Frequencies, shapes and model of modes that were just found; None of those that
            were read back.

    Raises:
        SceneError: If the directory holds no modes.
    """

    def __init__(
        self, directory: Path | str, computed: Modes | AboutState | BucklingModes | None = None
    ) -> None:
        super().__init__(directory, computed)
        self.described: Described = read_described(self.directory)

    @property
    def frequencies(self) -> list[float]:
        """Frequencies in periods per unit of time.

        A mode that grows without swinging has a negative one: its rate of growth over 2 pi.
        """
        return list(self.summary.get("frequencies_hz", []))

    @property
    def load_factors(self) -> list[float]:
        """Load factors of linear buckling, ascending; of vibrations there are none."""
        return list(self.summary.get("load_factors", []))

    @property
    def captions(self) -> list[str]:
        """Caption of each mode: its frequency or its load factor."""
        from shellmb.show.modes import captions

        return captions(self.described, self.summary)

    @property
    def warnings(self) -> list[str]:
        """Warnings about unstable states and unreliable eigenvalues, a sentence each."""
        return list(self.summary.get("warnings", []))

    @property
    def rigid(self) -> int:
        """Number of rigid-body motions, which are the first modes."""
        return int(self.summary.get("rigid_modes", 0))

    @cached_property
    def table(self) -> pd.DataFrame:
        """Number, frequency, angular frequency and growth of each mode."""
        import pandas as pd

        return pd.read_csv(self.directory / TABLE).set_index("mode")

    @cached_property
    def fields(self) -> Fields:
        """Shapes by the names of the bodies; the dimension "mode" counts from 1."""
        described = self.described
        return Fields(self.directory / "fields", described.bodies, described.labels, "mode")

    def frame(self, mode: int = 1) -> pv.MultiBlock:
        """All bodies in a mode, as pyvista has them.

        Args:
            mode: Its number, from 1.
        """
        return self.fields.frame(mode)

    def picture(self) -> Any:
        """All modes in one image (PIL)."""
        from shellmb.show.modes import modes_image

        return modes_image(self.fields, self.described, self.summary)

    def animate(self, mode: int, file: Path | str | None = None) -> Path:
        """One period of a mode as an animation.

        Args:
            mode: Its number, from 1.
            file: A GIF, or an MP4 file; None: `mode_N.gif` in the directory.
        """
        from shellmb.show.modes import animate_mode

        target = Path(file) if file is not None else self.directory / f"mode_{mode}.gif"
        return animate_mode(self.fields, self.described, mode, target)

    def __repr__(self) -> str:
        if self.load_factors:
            return (
                f"<ModeShapes of '{self.described.name}': {len(self.load_factors)} buckling modes, "
                f"lowest load factor {self.load_factors[0]:.6g}, {self.directory}>"
            )
        count, first = len(self.frequencies), next(iter(self.frequencies[self.rigid :]), None)
        lowest = "" if first is None else f", lowest {first:.6g} Hz"
        return (
            f"<ModeShapes of '{self.described.name}': {count} modes, {self.rigid} rigid{lowest}, "
            f"{self.directory}>"
        )

    def _repr_html_(self) -> str:
        from shellmb.show.report import modes_card

        return modes_card(self)


@checks
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

        read = pd.read_csv(self.directory / CAMPBELL, keep_default_na=False)
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
            if abs(own - rate) <= 1e-9 * max(self.rates):
                return ModeShapes(self.directory / f"rate_{number}")
        listed = ", ".join(f"{own:g}" for own in self.rates)
        raise SceneError(f"rate is {rate:g}; it must be one of {listed}")

    def plot(self) -> Figure:
        """The Campbell diagram, a matplotlib figure."""
        from shellmb.show.campbell import campbell_figure

        return campbell_figure(self.directory / CAMPBELL)

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
