"""A case of the bench: a scene, what is judged of it, and the reference."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

from shellmb.accuracy.family import degree_of
from shellmb.scene import Scene


def triangles(scene: Scene) -> bool:
    """Decide whether elements are triangles, which have no degree 3."""
    return any(shell.cell == "tri" for shell in scene.shells)


@dataclass(frozen=True)
class Case:
    """A scene with a reference.

    Args:
        name: Its name in the table.
        kind: What it stands for: "statics", "motion", "mechanism", "path", "modes".
        make: Makes the scene.
        quantities: What is judged, as `parse_quantity` takes it; of modes "f1", "f2".
        exact: Exact values by quantity; the others are those of a finer run.
        mesh: How often the elements of the finer run are divided; 0 keeps mesh and degree.
        step: How many steps of the finer run are one of the scene's.
        scheme: Scheme of the finer run; None: that of the scene.
    """

    name: str
    kind: str
    make: Callable[[], Scene]
    quantities: tuple[str, ...]
    exact: Mapping[str, float] = field(default_factory=dict)
    mesh: int = 2
    step: int = 8
    scheme: str | None = None

    def finer(self, scene: Scene) -> Scene:
        """The scene of the reference.

        Args:
            scene: The scene.
        """
        if self.mesh:
            if degree_of(scene) is not None and not triangles(scene):
                scene = scene.with_options(degree=3)
            scene = scene.with_options(divide=self.mesh)
        if scene.static or self.kind == "modes":
            return scene
        if self.scheme is not None:
            scene = replace(scene, scheme=self.scheme, alpha=None)
        return scene.with_options(dt=(scene.dt or 0.0) / self.step)
