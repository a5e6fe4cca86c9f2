"""Tables of what is refused, by the sentences that say so: checked in one test that names all."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from shellmb.errors import SceneError


def refusal(call: Callable[[], object]) -> str:
    """Sentence with which a call is refused; empty where it is not."""
    try:
        call()
    except SceneError as error:
        return str(error)
    return ""


def other_sentences(table: Mapping[str, Callable[[], object]]) -> str:
    """Sentences of a table beside what is said instead; empty where all are said.

    Args:
        table: What is refused, by its sentence.
    """
    assert table
    found = {expected: refusal(call) for expected, call in table.items()}
    return "\n".join(
        f"expected: {expected}\nsaid:     {said or 'nothing'}"
        for expected, said in found.items()
        if said != expected.rstrip()
    )
