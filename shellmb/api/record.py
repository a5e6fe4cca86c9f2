"""One run, just computed or read back: history, summary, fields, pictures."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypedDict

from pydantic import TypeAdapter

from shellmb.errors import SceneError
from shellmb.files.reading import read_json, undamaged
from shellmb.observers.files.described import Described, read_described
from shellmb.options.described import takes
from shellmb.options.run import ACCURACY
from shellmb.running.results import plain_results
from shellmb.scene import Scene
from shellmb.show.fields import Fields

if TYPE_CHECKING:
    import matplotlib.figure
    import pandas as pd
    import pyvista as pv

    from shellmb.running.execute import RunResult
    from shellmb.show.space.scenery import Showing


class _Said(TypedDict):
    says: str


class _Summary(TypedDict):
    """Part of a summary that is read; the file has more."""

    scheme: str
    steps: int
    t: float | None
    failed: str | None
    warnings: list[_Said]
    results: dict[str, float | dict[str, float | None] | None]
    versions: dict[str, str]


_SUMMARY = TypeAdapter(_Summary)


class StoredResult:
    """Results of a command in their directory, which is read when it is used.

    Args:
        directory: The directory.
        computed: What was found in this process; None of what is read back. Of many results the
            oldest ones let go of it, before MPI has no communicators for another simulation.
    """

    def __init__(self, directory: Path | str, computed: Any = None) -> None:
        self.directory, self.computed = Path(directory), computed
        if computed is not None:
            from shellmb.meshes.lifetime import count_holder

            count_holder(self)

    def release(self) -> None:
        """Let go of the simulation: all else is read from the directory."""
        self.computed = None

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Content of `summary.json`."""
        return read_json(self.directory / "summary.json")

    @property
    def results(self) -> dict[str, float]:
        """Results of the scene."""
        return plain_results(self.summary)

    @property
    def accuracy(self) -> pd.DataFrame:
        """Costs of accuracy: a row for each level of a request with ``accuracy``, and predictions.

        Columns: label (mesh, step, scheme), error, error_mesh and error_step, all relative,
        seconds (processor time of the run), predicted; empty without ``accuracy``.
        """
        import pandas as pd

        file = self.directory / ACCURACY
        found = read_json(file) if file.is_file() else {}
        size, rows = found.get("size") or 1.0, []
        for level in found.get("levels", []):
            parts = {"error": "error", "error_mesh": "mesh", "error_step": "step"}
            errors = {k: None if level[v] is None else level[v] / size for k, v in parts.items()}
            named = {"label": level["label"], "seconds": level["seconds"], "predicted": False}
            rows.append(named | errors)
        rows += [offer for offer in found.get("offers", []) if offer["predicted"]]
        columns = ["label", "error", "error_mesh", "error_step", "seconds", "predicted"]
        return pd.DataFrame(rows, columns=columns)

    @property
    def errors(self) -> pd.DataFrame:
        """Estimated errors, a row for each result and each probe's history in a norm, or frequency.

        Columns: value, error, error_mesh, error_step, order_mesh, order_step, and errors of other
        parts where these are on; empty without ``errors=True``. What the errors leave out is in
        ``summary["errors"]["remarks"]``.
        """
        import pandas as pd

        found = self.summary.get("results", {}), *self.summary.get("errors", {}).values()
        every = {k: v for part in found if isinstance(part, dict) for k, v in part.items()}
        rows = {k: v for k, v in every.items() if isinstance(v, dict)}
        return pd.DataFrame.from_dict(rows, orient="index")


class Run(StoredResult):
    """A run in its directory, which is read when it is used.

    Args:
        directory: The run directory.
        computed: What computed it, in this process.

    Attributes:
        directory: The run directory.
        computed: Scene, simulation and observers of a run that was just computed; None of one that
            was read back, and of old ones where MPI has no communicators for more of them.

    Raises:
        SceneError: If the directory holds no run.
    """

    computed: RunResult | None

    def __init__(self, directory: Path | str, computed: RunResult | None = None) -> None:
        super().__init__(directory, computed)
        self._scene = computed.scene if computed is not None else None
        self.described: Described = read_described(self.directory)
        if not (self.directory / "history.csv").is_file():
            raise SceneError(
                f"{self.directory} holds no history.csv: the run was stopped before its first "
                f"state; `shellmb resume {self.directory}` begins again"
            )

    @property
    def name(self) -> str:
        """Name of the scene."""
        return self.described.name

    @property
    def scene(self) -> Scene:
        """The scene.

        Raises:
            SceneError: If it was not made in this process, and is no bundled one.
        """
        if self._scene is not None:
            return self._scene
        from shellmb.running.request import read_request

        return read_request(self.directory).trusted(None, False).build()[0]

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The numbers that say whether to trust the run, and its results (`summary.json`).

        A run that is still going on, or was killed, has none: {}.
        """
        file = self.directory / "summary.json"
        if not file.exists():
            return {}
        found = read_json(file)
        with undamaged(file):
            _SUMMARY.validate_python(found)
        return found

    @property
    def reserves(self) -> pd.DataFrame:
        """Least reserve factors against failure over the run, a row for each `Reserve`.

        Columns: factor, its error (with ``errors=True``), step, t, criterion, body, the reference
        place x, y, z, ply (1 is the lowest), side, mode of failure.
        """
        import pandas as pd

        probes, rows = self.summary.get("errors", {}).get("probes", {}), {}
        for name, found in self.summary.get("reserves", {}).items():
            place = dict(found)
            u = place.pop("utilisation")
            error = (probes.get(f"{name}:max") or {}).get("error")
            off = float("nan") if error is None or not u else error / u**2
            rows[name] = {"factor": 1 / u if u else float("inf"), "error": off, **place}
        return pd.DataFrame.from_dict(rows, orient="index")

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings of the run, a sentence each."""
        return tuple(w["says"] for w in self.summary.get("warnings", ()))

    @cached_property
    def history(self) -> pd.DataFrame:
        """All columns of all steps, one row per step and one before the first."""
        from shellmb.observers.history import read_history
        from shellmb.show.columns import Columns

        return Columns(read_history(self.directory / "history.csv"))

    @cached_property
    def fields(self) -> Fields:
        """Fields over time by the names of the bodies, each an xarray Dataset, read lazily."""
        described = self.described
        return Fields(self.directory / "fields", described.bodies, described.labels)

    def frame(self, t: float | None = None) -> pv.MultiBlock:
        """All bodies in the stored state nearest to a time, deformed, with all their fields.

        Args:
            t: The time; None: the last state.
        """
        return self.fields.frame(t)

    def plies(
        self,
        body: str | None = None,
        *,
        at: tuple[float, float, float],
        t: float | None = None,
        axes: Literal["ply", "shell"] = "ply",
    ) -> pd.DataFrame:
        """Stresses and strains of each ply at its bottom, middle and top at one place of a shell.

        The scene needs ``Output(fields=("N", "M", "interlaminar"))``.

        Args:
            body: Name of the shell; None: the only one.
            at: The place on the shell at rest [m].
            t: The time, of which the nearest stored state is taken; None: the last state.
            axes: Along the fibres of each "ply", or along the material axes of the "shell".

        Returns:
            Rows by ply (1 is the lowest) and side; columns z, "stress 11" to "stress 23", and
            "strain 11" to "strain 23" with engineering shears.

        Raises:
            SceneError: If the place is not on the shell, or the run lacks the fields.
        """
        from shellmb.show.plies import plies

        return plies(self.scene, self.fields, body, at, t, axes)

    @takes()
    def plot(self, columns: str | Sequence[str] | None = None) -> matplotlib.figure.Figure:
        """Histories over time.

        Args:
            columns: Columns of the history; None: the probes, or the energies without any.

        Raises:
            SceneError: If there is no such column.
        """
        from shellmb.show.account import bands
        from shellmb.show.plots import plot_history

        history: Any = self.history
        return plot_history(history, self.described, columns, bands(self.summary))

    def picture(
        self,
        t: float | None = None,
        field: str | None = None,
        component: str | int | None = None,
        **appearance: Any,
    ) -> Any:
        """The deformed shape as an image (PIL).

        Args:
            t: Time; None: the last state.
            field: What the colours show; None: the displacement, of mechanisms with resultants
                among their fields those.
            component: Name or number of its component; None: its magnitude.
            appearance: ``camera=(elevation, azimuth)`` [degrees], ``width`` [pixels], ``theme``
                ("light" or "dark"), ``enlarge`` (factor of displacements), ``axes=True`` (a box
                with numbers and units).

        Raises:
            SceneError: If there is no such field, component or appearance.
        """
        from shellmb.show.space.scenery import images

        return next(images(self._showing(t, field, component, appearance)))

    def _showing(
        self, t: float | None, field: str | None, component: Any, appearance: dict[str, Any]
    ) -> Showing:
        from shellmb.show.space.scenery import showing
        from shellmb.show.space.views import Appearance

        look = Appearance(**appearance)
        return showing(self.fields, self.described, [t], field, component, appearance=look)

    def animate(
        self,
        file: Path | str | None = None,
        field: str | None = None,
        component: str | int | None = None,
        **appearance: Any,
    ) -> Path:
        """All states as an animation.

        Args:
            file: A GIF, or an MP4 file; None: `animation.gif` in the run directory.
            field: As in `picture`.
            component: As in `picture`.
            appearance: As in `picture`.
        """
        from shellmb.show.space.animation import animate
        from shellmb.show.space.views import Appearance

        look = Appearance(**appearance)
        target = Path(file) if file is not None else self.directory / "animation.gif"
        return animate(
            self.fields, self.described, target, field=field, component=component, appearance=look
        )

    def view(
        self,
        t: float | None = None,
        field: str | None = None,
        component: str | int | None = None,
        **appearance: Any,
    ) -> Any:
        """Show the deformed shape in a view that can be turned: a window, or in a notebook.

        Args:
            t: As in `picture`.
            field: As in `picture`.
            component: As in `picture`.
            appearance: As in `picture`; windows have no width.

        Returns:
            In a notebook the view of `report`, which it displays; None elsewhere.

        Raises:
            RunError: If there is no display.
        """
        from shellmb.observers.progress import in_notebook
        from shellmb.show.space.scenery import show

        what = self._showing(t, field, component, appearance)
        if in_notebook():
            from shellmb.show.space.web import in_cell

            return in_cell(what)
        return show(what)

    def draw(
        self, folder: Path | str | None = None, curves: str = "png", **appearance: Any
    ) -> list[Path]:
        """Draw all pictures of the run again (`shellmb plot`).

        Args:
            folder: Where; None: in the run directory.
            curves: Format of pictures of curves: "png", "svg" or "pdf".
            appearance: As in `picture`.
        """
        from shellmb.show.pictures import draw_directory
        from shellmb.show.space.views import Appearance

        out = Path(folder) if folder is not None else None
        look = Appearance(**appearance)
        return draw_directory(self.directory, out, curves=curves, appearance=look)

    def report(self, file: Path | str | None = None) -> Path:
        """Write one self-contained HTML page with everything about the run.

        Args:
            file: The file; None: `report.html` in the run directory.
        """
        from shellmb.show.report import write_report

        return write_report(self, Path(file) if file else self.directory / "report.html")

    @property
    def account(self) -> dict[str, str]:
        """Numbers that say whether to trust the run, as text."""
        from shellmb.show.account import account

        try:
            return account(self.summary)
        except (TypeError, ValueError, KeyError, AttributeError) as error:
            file = self.directory / "summary.json"
            raise SceneError(f"{file} is damaged ({type(error).__name__}: {error})") from None

    def __repr__(self) -> str:
        s = self.summary
        if not s:
            return f"<Run '{self.name}' ({self.described.scheme}), not finished, {self.directory}>"
        steps, said = s["steps"], ""
        if s["failed"]:
            said = f", failed at t = {s['t']:g}"
        if self.warnings:
            said += f", {len(self.warnings)} warning{'s' if len(self.warnings) > 1 else ''}"
        return (
            f"<Run '{self.name}': {self.described.scheme}, {steps} step{'s' if steps != 1 else ''} "
            f"to t = {s['t']:g}{said}, {self.directory}>"
        )

    def _repr_html_(self) -> str:
        from shellmb.show.report import card

        return card(self)


def scene_of(scene: Scene | Run | str, options: dict[str, Any], command: str) -> Scene | str:
    """The scene that is meant, of a run with its last state as the option `state`.

    Args:
        scene: A scene, its name or file, or a run.
        options: Options, in which `state` may be a run; it becomes the run's directory.
        command: Who asks, for errors.

    Raises:
        SceneError: If the scene is a run and a state is given, too, or there is no such run.
    """
    from shellmb.running.request import scene_of_run

    if isinstance(scene, Run):
        if options.get("state") is not None:
            raise SceneError(f"{command}: the scene is a run, and a state is given, too; give one")
        options["state"], made_here = scene, scene._scene
        scene = made_here or scene_of_run(scene.directory, command)[0]
    if isinstance(options.get("state"), Run):
        options["state"] = options["state"].directory
    return scene
