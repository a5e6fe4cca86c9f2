"""Entries of flat mappings whose keys begin alike, as arrays of a state and fingerprints have."""

from collections.abc import Mapping


def below[V](entries: Mapping[str, V], prefix: str) -> dict[str, V]:
    """Entries whose keys begin with a prefix, without it."""
    return {k.removeprefix(prefix): v for k, v in entries.items() if k.startswith(prefix)}
