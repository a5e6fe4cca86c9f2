"""Pictures of a run: what they show, drawn on a stack of its own (`run_pictures`)."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from shellmb.observers.frames import Frame, Frames
from shellmb.observers.grid import Grid
from shellmb.scene import Scene
from shellmb.simulate.simulation import Simulation


@dataclass(frozen=True)
class Shown:
    """What pictures show of a run: values only, no meshes or solvers.

    Args:
        scene: The scene.
        dynamic: Whether it moves in time.
        history: The history.
        frames: The frames, at least one.
        grids: What the frames show, by name.
    """

    scene: Scene
    dynamic: bool
    history: pd.DataFrame
    frames: list[Frame]
    grids: dict[str, Grid]

    @property
    def time_label(self) -> str:
        """Label of the axis of time."""
        if self.scene.path is not None:
            return "arc length [-]"
        return "time [s]" if self.dynamic else "load parameter [-]"

    @property
    def size(self) -> float:
        """Diagonal of the box around the scene, m."""
        nodes = np.concatenate([grid.nodes for grid in self.grids.values()])
        return float(np.linalg.norm(np.ptp(nodes, axis=0)))


def draw(directory: Path, history: pd.DataFrame, frames: Frames, simulation: Simulation) -> None:
    """Draw all pictures that make sense for a run; on rank 0.

    The parser in matplotlib leaves exceptions in cycles, when it is imported and with every
    logarithmic axis. They hold the frames of all callers: in the caller's thread they would hold
    the simulation, to be freed later than on the other ranks, which wait for it for ever.

    Args:
        directory: Where they go.
        history: The history.
        frames: The frames.
        simulation: The simulation.
    """
    shown = Shown(simulation.scene, simulation.scheme.dynamic, history, frames.frames, frames.grids)
    with ThreadPoolExecutor(max_workers=1) as thread:
        thread.submit(_draw, directory, shown).result()


def _draw(directory: Path, shown: Shown) -> None:
    from shellmb.observers.run_pictures import draw_run

    draw_run(directory, shown)
