"""Requests of an accuracy, and of the quantity that has to meet it."""

import re
from dataclasses import dataclass

from shellmb.accuracy.run_record import RunRecord
from shellmb.accuracy.studies.quantity import NORMS, Quantity, default_quantity, parse_quantity
from shellmb.errors import SceneError
from shellmb.options.run import AccuracyOptions
from shellmb.scene import Scene
from shellmb.scene.lookup import listed


@dataclass(frozen=True, kw_only=True)
class Target(AccuracyOptions):
    """An accuracy that is requested.

    Args:
        accuracy: The relative error.
    """

    accuracy: float

    def quantity(self, scene: Scene, measures: bool = False) -> Quantity:
        """The quantity: a result, or a probe in the norm of its history that fits the scene.

        Args:
            scene: The scene.
            measures: Whether it has results, though the scene itself does not say so.

        Raises:
            SceneError: If there is none of that name, as far as is known.
        """
        names = [b.name for b in scene.meshed]
        if self.body is not None and self.body not in names:
            raise SceneError(
                f"body is '{self.body}'; it must be one of the scene's shells and beams, "
                f"{listed(names) or 'none'}"
            )
        if self.modes:
            return Quantity(self.of or "f1")
        if self.of is None:
            return default_quantity(scene, "", "of")
        name, colon, norm = self.of.rpartition(":")
        if colon and norm in NORMS and name:
            return parse_quantity(self.of)
        if self.of in [probe.name for probe in scene.probes]:
            return Quantity(self.of, "end" if scene.static else "l2")
        measures = measures or scene.results is not None or bool(colon)
        if not measures or (colon and norm not in NORMS):
            raise UnknownQuantity(self._unknown(scene, ()))
        # which results there are a run tells (`check`)
        return Quantity(self.of)

    def check(self, scene: Scene, quantity: Quantity, known: RunRecord) -> None:
        """Check that a run has the quantity.

        Args:
            scene: The scene.
            quantity: The quantity.
            known: The run.

        Raises:
            SceneError: If it has none of that name.
        """
        names = known.results if quantity.norm is None else known.history.columns
        if quantity.name not in names:
            raise UnknownQuantity(self._unknown(scene, tuple(known.results)))

    def _unknown(self, scene: Scene, results: tuple[str, ...]) -> str:
        names = [*(p.name for p in scene.probes), *results]
        known = listed(names) or "none"
        return (
            f"of is '{self.of}'; it must be one of the scene's probes and results, {known}, or "
            f"COLUMN:NORM of its history, as 'tip:max' (norms: {', '.join(NORMS)})"
        )


class UnknownQuantity(SceneError):
    """A quantity that a run of the scene does not have."""


def frequency_number(name: str | None) -> int | None:
    """Number of a natural frequency from its name, "f1"; None: the name is none of a frequency.

    Args:
        name: The name.
    """
    found = re.fullmatch(r"f([1-9][0-9]*)", name or "")
    return None if found is None else int(found[1])
