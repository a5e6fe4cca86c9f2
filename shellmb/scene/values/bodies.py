"""Bodies of a scene: what it may ask of any of them."""

from collections.abc import Callable, Mapping
from typing import Any, ClassVar

from shellmb.arrays import Floats


class SceneBody:
    """Base class of bodies, with the answers of a body that says nothing else.

    Attributes:
        name: Its name.
        label: What messages call it.
        model: How it deforms.
        directors: Number of directors at each of its places; 3 are a frame.
        single: Whether it is one frame with a reference point, and has no nodes.
        placed: Whether it has places for supports, joints, loads and probes.
        of: Name of the body whose modes it moves with; none: it moves by itself.
        terms: Terms added to its weak form.
        natural: Strains that it has without stress.
        quantities: What probes record of its kind only.
        mass_word: What messages call its `mass_given` [kg], of shells per area [kg/m^2], of beams
            per length [kg/m].
        mass_remedy: How it gets a mass, for messages.
    """

    name: str
    label: ClassVar[str] = "body"
    model: Any = "exact"
    directors: ClassVar[int] = 0
    single: ClassVar[bool] = False
    placed: bool = True
    of: str = ""
    terms: Any = ()
    natural: Any = None
    quantities: ClassVar[tuple[str, ...]] = ()
    mass_word: ClassVar[str] = "mass"
    mass_remedy: ClassVar[str] = ""

    @property
    def rigid(self) -> bool:
        """Decide whether the body is one rigid body."""
        return bool(self.model == "rigid")

    @property
    def exact(self) -> bool:
        """Decide whether the body deforms by any amount."""
        return bool(self.model == "exact")

    @property
    def linear(self) -> bool:
        """Decide whether its strains are small relative to a floating frame."""
        return bool(self.model == "floating-frame")

    @property
    def modes(self) -> int:
        """Number of modes that it is reduced to; 0 where it is not."""
        return getattr(self.model, "modes", 0)

    @property
    def nodal(self) -> bool:
        """Decide whether its nodes are the unknowns."""
        return self.exact or self.linear

    @property
    def framed(self) -> bool:
        """Decide whether its places have frames, which moments turn."""
        return self.directors == 3 or not self.nodal

    @property
    def edge_names(self) -> tuple[str, ...] | None:
        """Names of its edges, of a beam its ends; None where only its mesh knows them."""
        return self.region_names

    @property
    def area_names(self) -> tuple[str, ...]:
        """Names of its areas."""
        return ()

    @property
    def region_names(self) -> tuple[str, ...]:
        """Names of its parts with several nodes, as far as they are known."""
        return ()

    @property
    def field_kinds(self) -> set[str]:
        """Kinds of `FieldKind.bodies` that it is of."""
        return {"rigid"}

    def some_positions(self, s: Floats) -> Floats | None:
        """Positions of some of its points, shape (3, n) [m]; None where only its mesh knows them.

        Args:
            s: Numbers between 0 and 1, shape (n,).
        """
        return None


class Ground(SceneBody):
    """The ground, which bodies are joined to as to a rigid one."""

    label = "the ground"
    model = "rigid"
    directors = 3
    single = True


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
