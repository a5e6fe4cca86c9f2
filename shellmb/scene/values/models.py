"""Models of a body, and strains that it has without stress: of heat, swelling, prestress."""

from collections.abc import Callable
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator

from shellmb.errors import SceneError
from shellmb.scene.types import NONE, Finite, Listed, PositiveInt, Vec3, vector
from shellmb.scene.values.bodies import SceneBody
from shellmb.scene.values.renamed import choice_of_today
from shellmb.scene.values.user_functions import OfPosition
from shellmb.scene.values.validate import described

WORDS = ("exact", "floating-frame", "rigid")


@described("modal model")
class Modal:
    """Small strains and rotations relative to a floating frame, in few modes (Craig and Bampton).

    The frame moves by any amount, as a rigid body does; relative to it the body moves in the modes
    that it has with its joints fixed, and in those of its joints, each of which moves as a rigid
    frame: six for each place that something is attached to, less the six of the body as a whole.

    Args:
        modes: Number of modes with all joints fixed, the lowest ones; without joints and loads the
            number of elastic modes of the free body. Distributed loads add their own.
    """

    modes: PositiveInt = 10


def _word_or_modal(value: object) -> object:
    if isinstance(value, Modal) or (isinstance(value, str) and value in WORDS):
        return value
    today = choice_of_today("model", value)
    raise ValueError(f"it must be 'exact', 'floating-frame', Modal(modes=10) or 'rigid'{today}")


def model_of(text: str) -> str | Modal:
    """A model from text: ``"exact"``, ``"floating-frame"``, ``"rigid"``, or ``"modal:10"``.

    Raises:
        SceneError: If it is none of these.
    """
    word, _, count = text.partition(":")
    if word == "modal" and count.isdecimal():
        return Modal(int(count))
    if text in WORDS:
        return text
    raise SceneError(
        f"model is {text!r}; it must be 'exact', 'floating-frame', 'modal:10' or 'rigid'"
        + choice_of_today("model", text)
    )


BodyModel = Annotated[
    Literal["exact", "floating-frame", "rigid"] | Modal, BeforeValidator(_word_or_modal)
]


class Deforming(SceneBody):
    """Base class of shells and beams.

    Attributes:
        home: The parameter of a scene that has it.
        section: Its section.
        transverse_shear: Whether sections shear.
        stretching: Whether it stretches.
    """

    home: ClassVar[str]
    section: Any
    transverse_shear: bool
    stretching: bool

    mass_remedy = ", so give its section a density"

    @property
    def mass_given(self) -> float:
        """Mass per area or length, of a section that varies one that is zero where it is."""
        return float(self.section.generic.mass[0])

    @property
    def holds_strains(self) -> bool:
        """Decide whether some strain is kept at zero by forces that are multipliers."""
        return self.nodal and not (self.transverse_shear and self.stretching)


def _given(value: Any) -> Any:
    return value if callable(value) else vector(value)


Six = tuple[Finite, Finite, Finite, Finite, Finite, Finite]
Strains = Annotated[Vec3 | OfPosition, BeforeValidator(_given)]


@described("natural strain")
class NaturalStrain:
    """Strains of a shell without stress, in its material axes.

    Stresses follow from the difference between the strains of eq. (9) and these. A plate that is
    heated by ``T`` has ``membrane=(alpha T, alpha T, 0)``; one whose temperature grows by ``G`` per
    length along the normal has ``curvature=(alpha G, alpha G, 0)``. ``thermal_strain`` finds both,
    also of laminates.

    Args:
        membrane: Membrane strains (11, 22, 2*12) [-]; or a vectorised function of positions (3, n)
            that gives (3, n).
        curvature: Changes of curvature (11, 22, 2*12) [1/m]; or such a function.
        time: Factor over time; None: 1, and in statics the share of the load.
        plies: Strains that each ply would have alone, from the lower to the upper face, as
            ``thermal_strain`` finds them: (11, 22, 2*12) along and across its fibres at the
            reference surface [-], and their changes along the normal [1/m]. The section holds the
            plies together, which leaves stresses in them without resultants. None: every ply has
            the strains of the section, and no stress.
    """

    membrane: Strains = (0.0, 0.0, 0.0)
    curvature: Strains = (0.0, 0.0, 0.0)
    time: Callable[[float], float] | None = None
    plies: Listed[Six] = NONE


@described("natural strain of a beam")
class BeamNaturalStrain:
    """Strains of a beam without stress, along its directors.

    Args:
        extension: Strain along the line [-].
        curvature: Twist, and curvatures about d2 and d3 [1/m].
        time: Factor over time; None: 1, and in statics the share of the load.
    """

    extension: Finite = 0.0
    curvature: Vec3 = (0.0, 0.0, 0.0)
    time: Callable[[float], float] | None = None
