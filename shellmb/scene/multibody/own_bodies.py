"""Bodies of a user's own in scenes: what a scene knows of them, which has no DOLFINx."""

from collections.abc import Callable, Mapping
from typing import Any, ClassVar


class UserBody:
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

    label: ClassVar[str] = "own body"
    # how bodies of scenes deform, what acts on them, and what a scene may ask of them
    model: ClassVar[str] = "exact"
    rigid: ClassVar[bool] = False
    linear: ClassVar[bool] = False
    nodal: ClassVar[bool] = True
    terms: ClassVar[tuple[Any, ...]] = ()
    natural: ClassVar[None] = None

    name: str
    points: Mapping[str, tuple[float, float, float]]
    regions: Mapping[str, Callable[[Any], Any]]
    massive: bool
    has_strains: bool
    placed: bool

    @property
    def point_names(self) -> tuple[str, ...]:
        """Names of its points."""
        return tuple(self.points)

    @property
    def region_names(self) -> tuple[str, ...]:
        """Names of its regions."""
        return tuple(self.regions)

    def in_values(self) -> dict[str, Any]:
        """Description in values, to be stored and compared."""
        raise NotImplementedError
