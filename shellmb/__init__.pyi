# what `shellmb.__getattr__` finds when it is used, for editors and type checkers
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, overload

from mpi4py import MPI

import pandas as pd

from shellmb import errors as errors
from shellmb import forms as forms
from shellmb import scene as scene
from shellmb.api.fitting.fitted import Fit as Fit
from shellmb.api.fitting.rank import rank as rank
from shellmb.api.matrices import Matrices as Matrices
from shellmb.api.matrices import matrices as matrices
from shellmb.api.modeshapes import ModeShapes as ModeShapes
from shellmb.api.modeshapes import RotatingModes as RotatingModes
from shellmb.api.modeshapes import StateModes as StateModes
from shellmb.api.motion import Motion as Motion
from shellmb.api.record import Run as Run
from shellmb.api.responding.curves import shock_spectrum as shock_spectrum
from shellmb.api.responding.linearise import linearise as linearise
from shellmb.api.responding.linearise import response as response
from shellmb.api.responding.response import Response as Response
from shellmb.api.responding.system import LinearSystem as LinearSystem
from shellmb.api.runs import load as load
from shellmb.api.runs import load_scene as load_scene
from shellmb.api.runs import resume as resume
from shellmb.api.runs import scenes as scenes
from shellmb.api.sensitivity.record import Sensitivities as Sensitivities
from shellmb.api.studies import Study as Study
from shellmb.api.sweeps import sweep as sweep
from shellmb.errors import ControlError as ControlError
from shellmb.errors import ConvergenceError as ConvergenceError
from shellmb.errors import RunError as RunError
from shellmb.errors import SceneError as SceneError
from shellmb.errors import ShellmbError as ShellmbError
from shellmb.errors import ShellmbWarning as ShellmbWarning
from shellmb.exchange.export import export_fmu as export_fmu
from shellmb.exchange.motion import SceneMotion as SceneMotion
from shellmb.exchange.precice import couple_precice as couple_precice
from shellmb.model.user_bodies.body import Hold as Hold
from shellmb.model.user_bodies.body import OwnBody as OwnBody
from shellmb.scene import *
from shellmb.scene import Scene as Scene
from shellmb.sensitivity.adjoint.objective import Objective
from shellmb.sensitivity.adjoint.run import Adjoint as Adjoint
from shellmb.simulate.simulation import Observer

__version__: str

# as their options are described (`shellmb/options`); a test says what to write here
def run(
    scene: Scene | str,
    out: Path | str | None = None,
    *,
    parameters: Mapping[str, Any] | None = None,
    observers: Sequence[Observer] = (),
    pictures: bool | None = None,
    progress: bool | None = None,
    comm: MPI.Comm | None = None,
    scheme: str | None = None,
    alpha: float | None = None,
    dt: float | None = None,
    t_end: float | None = None,
    mesh: tuple[int, int] | str | None = None,
    degree: Literal[2, 3] | None = None,
    cell: Literal["quad", "tri"] | None = None,
    divide: int | None = None,
    body: str | None = None,
    model: str | None = None,
    solve: Literal["reduced", "full"] | None = None,
    newton: Literal["auto", "modified", "full"] | None = None,
    backend: Literal["newton", "snes"] | None = None,
    assembler: Literal["native", "reference"] | None = None,
    newton_tolerance: float | None = None,
    end_forces: bool | None = None,
    errors: bool | None = None,
    step_error: float | None = None,
    accuracy: float | None = None,
    of: str | None = None,
    budget: float | str | None = None,
) -> Run: ...
def study(
    scene: Scene | Callable[..., Scene] | str,
    *,
    quantity: str | Sequence[str] = (),
    parameters: Mapping[str, Any] | None = None,
    repeat: int = 1,
    out: Path | str | None = None,
    clock: Literal["wall", "cpu"] = "wall",
    tell: Callable[[str], None] | None = None,
    dt: Sequence[float] = (),
    mesh: Sequence[tuple[int, int] | str] = (),
    scheme: Sequence[str] = (),
    alpha: Sequence[float] = (),
    degree: Sequence[int] = (),
    cell: Sequence[str] = (),
    divide: Sequence[int] = (),
    model: Sequence[str] = (),
    solve: Sequence[str] = (),
    step_error: Sequence[float] = (),
    newton_tolerance: Sequence[float] = (),
    exact: float | None = None,
    reference: str | None = None,
    refine: int = 2,
    body: str | None = None,
    t_end: float | None = None,
) -> Study: ...
def sensitivities(
    scene: Callable[..., Scene] | str,
    parameters: Sequence[str],
    out: Path | str | None = None,
    *,
    values: Mapping[str, Any] | None = None,
    scales: Mapping[str, float] | None = None,
    columns: Literal["all", "probes"] = "all",
    fields: bool = True,
    at: Literal["length", "load"] = "length",
    resume: bool = False,
    comm: MPI.Comm | None = None,
    scheme: str | None = None,
    alpha: float | None = None,
    dt: float | None = None,
    t_end: float | None = None,
    mesh: tuple[int, int] | str | None = None,
    degree: Literal[2, 3] | None = None,
    cell: Literal["quad", "tri"] | None = None,
    divide: int | None = None,
    body: str | None = None,
    model: str | None = None,
    solve: Literal["reduced", "full"] | None = None,
    newton: Literal["auto", "modified", "full"] | None = None,
    backend: Literal["newton", "snes"] | None = None,
    newton_tolerance: float | None = None,
    end_forces: bool | None = None,
    step_error: float | None = None,
) -> Sensitivities: ...
def adjoint(
    scene: Callable[..., Scene] | str,
    objective: Objective,
    fields: Sequence[tuple[str, str]] = (),
    parameters: Sequence[str] = (),
    *,
    values: Mapping[str, Any] | None = None,
    scales: Mapping[str, float] | None = None,
    states: int | None = None,
    comm: MPI.Comm | None = None,
    scheme: str | None = None,
    alpha: float | None = None,
    dt: float | None = None,
    t_end: float | None = None,
    mesh: tuple[int, int] | str | None = None,
    degree: Literal[2, 3] | None = None,
    cell: Literal["quad", "tri"] | None = None,
    divide: int | None = None,
    body: str | None = None,
    model: str | None = None,
    solve: Literal["reduced", "full"] | None = None,
    newton: Literal["auto", "modified", "full"] | None = None,
    backend: Literal["newton", "snes"] | None = None,
    newton_tolerance: float | None = None,
    end_forces: bool | None = None,
    step_error: float | None = None,
) -> Adjoint: ...
def fit(
    scene: Callable[..., Scene] | str,
    data: pd.DataFrame,
    parameters: Sequence[str],
    *,
    noise: float | Mapping[str, float] | None = None,
    values: Mapping[str, Any] | None = None,
    bounds: Mapping[str, tuple[float | None, float | None]] | None = None,
    scales: Mapping[str, float] | None = None,
    runs: int = 30,
    tell: Callable[[str], None] | None = None,
    scheme: str | None = None,
    alpha: float | None = None,
    dt: float | None = None,
    t_end: float | None = None,
    mesh: tuple[int, int] | str | None = None,
    degree: Literal[2, 3] | None = None,
    cell: Literal["quad", "tri"] | None = None,
    divide: int | None = None,
    body: str | None = None,
    model: str | None = None,
    solve: Literal["reduced", "full"] | None = None,
    newton: Literal["auto", "modified", "full"] | None = None,
    backend: Literal["newton", "snes"] | None = None,
    newton_tolerance: float | None = None,
    end_forces: bool | None = None,
    step_error: float | None = None,
) -> Fit: ...
def frequency_sensitivities(
    scene: Callable[..., Scene] | str,
    parameters: Sequence[str],
    count: int = 6,
    loaded: bool = False,
    *,
    values: Mapping[str, Any] | None = None,
    scales: Mapping[str, float] | None = None,
    mesh: tuple[int, int] | str | None = None,
    degree: Literal[2, 3] | None = None,
    cell: Literal["quad", "tri"] | None = None,
    divide: int | None = None,
    body: str | None = None,
    model: str | None = None,
) -> pd.DataFrame: ...

# by what modes are about
@overload
def modes(
    scene: Run, out: Path | str | None = None, count: int | None = None, **options: Any
) -> StateModes: ...
@overload
def modes(
    scene: Scene | str,
    out: Path | str | None = None,
    count: int | None = None,
    *,
    state: Run | Path | str,
    **options: Any,
) -> StateModes: ...
@overload
def modes(
    scene: Scene | str,
    out: Path | str | None = None,
    count: int | None = None,
    *,
    at: float,
    **options: Any,
) -> StateModes: ...
@overload
def modes(
    scene: Scene | str,
    out: Path | str | None = None,
    count: int | None = None,
    loaded: bool = False,
    *,
    rates: Sequence[float],
    **options: Any,
) -> RotatingModes: ...
@overload
def modes(
    scene: Scene | str,
    out: Path | str | None = None,
    count: int | None = None,
    loaded: bool = False,
    **options: Any,
) -> ModeShapes: ...
