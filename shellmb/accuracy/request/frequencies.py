"""Levels of a request for a natural frequency, or for a number of modes."""

from __future__ import annotations

import time
from contextlib import ExitStack

from shellmb.accuracy.companions import Change
from shellmb.accuracy.measuring.times import slowest
from shellmb.accuracy.modes import mode_errors, write_mode_errors
from shellmb.accuracy.request.levels import Store
from shellmb.accuracy.request.messages import mesh_label
from shellmb.accuracy.request.search import Running, Search
from shellmb.accuracy.request.target import Target, UnknownQuantity, frequency_number
from shellmb.errors import SceneError
from shellmb.running.natural_modes.run import find_modes
from shellmb.scene import Scene


class ModeSearch(Search):
    """Finds modes of a scene with finer and finer meshes.

    Args:
        scene: The scene, with the mesh of its first level.
        wanted: What is requested: a frequency as "f1", or a result of modes.
        store: Where levels are kept.
        how: How modes are found.

    Raises:
        SceneError: If a scheme is to be chosen.
    """

    def __init__(self, scene: Scene, wanted: Target, store: Store, how: Running) -> None:
        super().__init__(scene, wanted, store, how)
        if wanted.auto:
            raise SceneError("scheme is 'auto', and natural modes have no scheme; leave it out")

    def label(self, change: Change) -> str:
        """Mesh of a level in words.

        Args:
            change: What is different in it.
        """
        return mesh_label(change.apply(self.scene)) or "no mesh"

    def _first(self) -> Change:
        return Change(body=self.wanted.body)

    def _level(self, change: Change, on: ExitStack) -> None:
        """Modes of a level with their errors; what is in the store is taken from there."""
        number, comm, wanted = len(self.levels) + 1, self.how.comm, self.wanted
        before = next((v for v in self._stored if v.change == change), None)
        if before is not None and self.store.is_done(number):
            self.levels.append(before)
            return
        place, scene = self.store.emptied(number), change.apply(self.scene)
        measure, loaded, name = self.how.mode_results, wanted.loaded, self.quantity.name
        count = max(wanted.count, frequency_number(name) or 1)
        clock = time.process_time()
        modes, summary = find_modes(
            scene, place, count, loaded, results=measure, comm=comm, pictures=False
        )
        seconds = slowest(comm, time.process_time() - clock)
        found, said = mode_errors(scene, modes, summary["results"], loaded, measure, wanted.body)
        if name not in found:
            listed = ", ".join(f"'{each}'" for each in found)
            raise UnknownQuantity(
                f"of is '{name}'; it must be a frequency or a result of the modes, {listed}"
            )
        if (frequency_number(name) or modes.rigid + 1) <= modes.rigid:
            raise SceneError(
                f"of is '{name}', the frequency of a rigid-body motion, which is 0; ask for a "
                "mode that deforms the bodies, 'f7' of a free one"
            )
        if said:
            self._family.failures[change] = "; ".join(said)
        write_mode_errors(comm, summary, place, found, said)
        # eigenproblems of fine meshes take most of the time: all of it grows with the elements
        self.levels.append(self._level_of(change, found[name], seconds, seconds))
        self.store.keep(self._family, self.levels)
