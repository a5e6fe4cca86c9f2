"""Sentences that say who is fastest."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from tests.bench.peers.codes import OURS


def fastest(
    codes: Sequence[str],
    asked: Sequence[float],
    best: Callable[[str, float], tuple[float, str] | None],
) -> str:
    """Say who takes how long for which error.

    Args:
        codes: Codes, ours first.
        asked: Errors, relative.
        best: Least time of a code for an error, s, and with what; None if it does not get there.
    """
    parts = []
    for error in asked:
        times, mine = [], best(OURS, error)
        for code in codes:
            found = best(code, error)
            if found is None:
                times.append(f"{code} not reached")
                continue
            seconds, how = found
            more = f", {seconds / mine[0]:.1f} times ours" if mine and code != OURS else ""
            times.append(f"{code} {seconds:.3g} s ({how}{more})")
        parts.append(f"{100 * error:g} % error: {', '.join(times)}")
    return "; ".join(parts) + "."
