"""Models of a body: exact, in few modes about a moving frame, or rigid."""

from typing import Annotated, Literal

from pydantic import BeforeValidator

from shellmb.errors import SceneError
from shellmb.scene.types import PositiveInt
from shellmb.scene.values.renamed import choice_of_today
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


class Deforming:
    """Base class of shells and beams.

    Attributes:
        model: How it deforms.
        transverse_shear: Whether sections shear.
        stretching: Whether it stretches.
    """

    model: BodyModel
    transverse_shear: bool
    stretching: bool

    @property
    def rigid(self) -> bool:
        """Decide whether the body is one rigid body."""
        return self.model == "rigid"

    @property
    def exact(self) -> bool:
        """Decide whether the body deforms by any amount."""
        return self.model == "exact"

    @property
    def linear(self) -> bool:
        """Decide whether its strains are small relative to a floating frame."""
        return self.model == "floating-frame"

    @property
    def nodal(self) -> bool:
        """Decide whether its nodes are the unknowns."""
        return self.exact or self.linear

    @property
    def holds_strains(self) -> bool:
        """Decide whether some strain is kept at zero by forces that are multipliers."""
        return self.nodal and not (self.transverse_shear and self.stretching)
