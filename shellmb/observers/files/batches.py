"""Times at which a run writes: a little at a time, several short steps together."""

import time as clock

# wall time whose results a killed process may lose, s
BATCH = 0.2


class Batches:
    """Says when to write what has been collected.

    Writing is cheap in a row, and dear between the steps of a simulation, whose numbers take its
    place in the processor's caches. Long steps are written one by one. What is collected has to be
    written before a state that counts on it, and at the end of the run, however it ends.
    """

    def __init__(self) -> None:
        self._written = -BATCH

    def due(self) -> bool:
        """Decide whether it is time to write."""
        return clock.perf_counter() - self._written > BATCH

    def written(self) -> None:
        """All that was collected is written."""
        self._written = clock.perf_counter()
