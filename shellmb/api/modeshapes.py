"""Natural modes, just found or read back: frequencies, shapes, pictures."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from shellmb.api.asked import ask
from shellmb.observers.files.described import Described, read_described
from shellmb.scene import Scene
from shellmb.show.fields import Fields

if TYPE_CHECKING:
    from mpi4py import MPI

    import pandas as pd
    import pyvista as pv

    from shellmb.modes import Modes

TABLE = "modes.csv"


class ModeShapes:
    """Natural modes in their directory, lowest first.

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

    def __init__(self, directory: Path | str, computed: Modes | None = None) -> None:
        self.directory, self.computed = Path(directory), computed
        self.described: Described = read_described(self.directory)

    @cached_property
    def summary(self) -> dict[str, Any]:
        """What is in `summary.json`."""
        found: dict[str, Any] = json.loads((self.directory / "summary.json").read_text())
        return found

    @property
    def frequencies(self) -> list[float]:
        """Frequencies in periods per unit of time; an unstable mode has a negative one."""
        return list(self.summary["frequencies_hz"])

    @property
    def rigid(self) -> int:
        """How many of them, the first ones, are rigid-body motions."""
        return int(self.summary["rigid_modes"])

    @property
    def results(self) -> dict[str, float]:
        """What the scene measures of its modes."""
        return dict(self.summary["results"])

    @cached_property
    def table(self) -> pd.DataFrame:
        """Number, frequency and angular frequency of each mode."""
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

        return modes_image(self.fields, self.described, self.frequencies, self.rigid)

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
        count, first = len(self.frequencies), next(iter(self.frequencies[self.rigid :]), None)
        lowest = "" if first is None else f", lowest {first:.6g} Hz"
        return (
            f"<ModeShapes of '{self.described.name}': {count} modes, {self.rigid} rigid{lowest}, "
            f"{self.directory}>"
        )

    def _repr_html_(self) -> str:
        from shellmb.show.report import modes_card

        return modes_card(self)


def modes(
    scene: Scene | str,
    out: Path | str | None = None,
    count: int = 6,
    loaded: bool = False,
    *,
    parameters: Mapping[str, Any] | None = None,
    mesh: tuple[int, int] | str | None = None,
    degree: Literal[2, 3] | None = None,
    cell: Literal["quad", "tri"] | None = None,
    pictures: bool | None = None,
    comm: MPI.Comm | None = None,
) -> ModeShapes:
    """Natural frequencies and modes of a scene, rigid-body modes included.

    Args:
        scene: A scene, the name of a bundled one, or the path of a Python file.
        out: Directory to write, new or empty; None: a temporary one.
        count: Number of modes.
        loaded: Whether about the static equilibrium under the scene's loads.
        parameters: Values of the parameters of a scene that is named.
        mesh: Counts of elements of every shell, as (8, 4) or "8x4"; of beams the first one.
        degree: Degree of every shell and beam.
        cell: Cell type of every shell.
        pictures: Whether the modes are drawn; None: where `out` is given.
        comm: Communicator; None: all ranks.

    Raises:
        SceneError: If a body has no mass, or the scene is impossible.
        ConvergenceError: If the static state or the modes do not converge.
    """
    from mpi4py import MPI

    from shellmb.api.folders import gone_with, place
    from shellmb.run.modes import find_modes

    asked = ask(scene, parameters, mesh=mesh, degree=degree, cell=cell)
    world = MPI.COMM_WORLD if comm is None else comm
    directory, temporary = place(out, world)
    found, _ = find_modes(
        asked.scene,
        directory,
        count,
        loaded,
        results=asked.module.mode_results if asked.module is not None else None,
        comm=world,
        pictures=out is not None if pictures is None else pictures,
    )
    world.Barrier()
    made = ModeShapes(directory, found)
    if temporary:
        gone_with(made, directory, world.rank)
    return made


def is_modes(directory: Path) -> bool:
    """Whether a directory holds modes."""
    return (directory / TABLE).is_file()
