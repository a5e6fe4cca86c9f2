"""Bodies of a user's own in scenes: what a scene knows of them, which has no DOLFINx."""

from collections.abc import Callable, Mapping
from typing import Any

from shellmb.scene.values.bodies import SceneBody


class UserBody(SceneBody):
    """Base class of bodies that are described by functions: `sm.OwnBody`.

    Attributes:
        name: Its name.
        points: Named points, by their coordinates [m].
        regions: Named parts, by functions of coordinates, shape (3, n), that mark what is in them.
        massive: Whether it has a mass.
        has_strains: Whether it has strains.
        placed: Whether its field is a displacement [m] at nodes of its mesh: without, it has no
            places for supports, joints, loads and probes.
    """

    label = "own body"
    mass_remedy = ", so give it one"

    points: Mapping[str, tuple[float, float, float]]
    regions: Mapping[str, Callable[[Any], Any]]
    massive: bool
    has_strains: bool
    placed: bool

    @property
    def mass_given(self) -> float:
        """1 where it has a mass, else 0."""
        return float(self.massive)

    @property
    def point_names(self) -> tuple[str, ...]:
        """Names of its points."""
        return tuple(self.points)

    @property
    def region_names(self) -> tuple[str, ...]:
        """Names of its regions."""
        return tuple(self.regions)

    def place(self, point: str) -> tuple[float, float, float]:
        """Position of a named point [m]."""
        return self.points[point]

    def again(self, comm: Any, kind: Any) -> Any:
        """The body of a kind of the model, on a communicator."""
        raise NotImplementedError

    def in_values(self) -> dict[str, Any]:
        """Description in values, to be stored and compared."""
        raise NotImplementedError
