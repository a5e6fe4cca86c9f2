"""Cards of Nastran's bulk data: small, large and free fields, continuations, included files."""

import re
from collections.abc import Iterator
from pathlib import Path

# files do not include one another deeper than this, and decks no more files than this, which may
# include one another again and again
DEEPEST, MOST = 100, 10_000
# cards that a mesh is made of
USED = re.compile(r"GRID|GRDSET|CORD|CTRIA|CQUAD|PCOMP|PSHELL")
_EXPONENT = re.compile(r"([+-]?[0-9]*\.?[0-9]*)([+-][0-9]+)")


class DeckError(Exception):
    """A mistake in a deck; the text says what would be right."""


def cards(path: Path) -> Iterator[list[str]]:
    """Cards of a deck: each its name in capitals, and its fields without those of continuations.

    Args:
        path: The file.

    Raises:
        DeckError: If it includes a file that is not there, or goes round in a circle; if a card
            that is used has more fields than a line takes, goes on elsewhere, or is repeated.
    """
    card: list[str] = []
    mark = ""
    for line in _bulk(list(_lines((path,), []))):
        name, fields, more, goes_on = _fields(line)
        if name.startswith("="):
            raise DeckError(
                f"the line '{line.strip()}' repeats the card before it, which is not read; write "
                "all cards out"
            )
        if not goes_on:
            if card:
                yield card
            card = [name]
        used = USED.match(card[0]) if card else None
        if used and goes_on and mark and name[1:] and name.strip("+*") != mark:
            raise DeckError(
                f"{' '.join(card[:2])} goes on in a line '{mark}', but the next one is '{name}'; "
                "continuations must follow their cards"
            )
        mark = more[0].strip("+* ").upper() if more and more[0][:1] in ("+", "*") else ""
        if used and (any(more[1:]) or (more and more[0][:1].isdigit())):
            raise DeckError(
                f"the line '{line.strip()}' has more than {len(fields)} fields; the rest must be "
                "in the next line, which begins with a comma"
            )
        card += fields
    if card:
        yield card


def integer(card: list[str], k: int) -> int | None:
    """A field as a whole number; None where it is empty.

    Args:
        card: The card.
        k: Number of the field.

    Raises:
        DeckError: If it is none.
    """
    text = card[k] if k < len(card) else ""
    if not text:
        return None
    try:
        return int(text)
    except ValueError:
        raise _wrong(card, k, "a whole number") from None


def real(card: list[str], k: int) -> float:
    """A field as a number, 0 where it is empty; also ``1.5-3`` and ``1.5D-3``.

    Args:
        card: The card.
        k: Number of the field.

    Raises:
        DeckError: If it is none.
    """
    text = (card[k] if k < len(card) else "").upper().replace("D", "E")
    short = _EXPONENT.fullmatch(text)
    try:
        return float(f"{short[1]}E{short[2]}" if short and short[1] else text or 0.0)
    except ValueError:
        raise _wrong(card, k, "a number") from None


def _wrong(card: list[str], k: int, right: str) -> DeckError:
    named = " ".join(card[:3])
    return DeckError(f"field {k} of {named} is '{card[k]}'; it must be {right}")


def included(name: str, within: tuple[Path, ...], read: list[Path]) -> tuple[Path, ...]:
    """A file that another one includes, behind those that it is within.

    Args:
        name: Its name as the other one has it.
        within: The file that includes it, the last one, and those that include that.
        read: All files that were included so far; it is added.

    Raises:
        DeckError: If there is no such file, it includes itself, or there are too many.
    """
    other = within[-1].parent / name
    read.append(other)
    why = ""
    if not other.is_file():
        why = "there is no such file"
    elif other.resolve() in {path.resolve() for path in within}:
        why = "the files go round in a circle"
    elif len(within) > DEEPEST:
        why = f"files must include one another at most {DEEPEST} deep"
    elif len(read) > MOST:
        why = f"there must be at most {MOST} files"
    if why:
        raise DeckError(f"it includes '{name}'; {why}")
    return (*within, other)


def _lines(within: tuple[Path, ...], read: list[Path]) -> Iterator[str]:
    """Lines without comments, those of included files in their places."""
    for raw in within[-1].read_text(errors="replace").splitlines():
        line = raw.partition("$")[0].rstrip()
        if not line:
            continue
        if line.lstrip()[:7].upper() != "INCLUDE":
            yield line
            continue
        name = line.lstrip()[7:].strip().strip("'\"")
        yield from _lines(included(name, within, read), read)


def _bulk(lines: list[str]) -> Iterator[str]:
    """The lines of bulk data: all, or those between BEGIN BULK and ENDDATA."""
    begins = [k for k, line in enumerate(lines) if re.match(r"\s*BEGIN\b", line, re.IGNORECASE)]
    for line in lines[begins[0] + 1 if begins else 0 :]:
        if line.strip().upper().startswith("ENDDATA"):
            return
        if not re.match(r"\s*BEGIN\b", line, re.IGNORECASE):
            yield line


def _fields(line: str) -> tuple[str, list[str], list[str], bool]:
    """Name, fields, what comes behind them, and whether the line goes on with the card before."""
    if "," in line:
        parts = [part.strip() for part in line.split(",")]
        name, wide = parts[0], "*" in parts[0]
        count = 4 if wide else 8
        fields = (parts[1 : count + 1] + [""] * count)[:count]
        more = parts[count + 1 :]
    else:
        line = line.expandtabs(8)
        name, wide = line[:8].strip(), "*" in line[:8]
        count, width = (4, 16) if wide else (8, 8)
        fields = [line[8 + width * k : 8 + width * (k + 1)].strip() for k in range(count)]
        # numbers of lines may stand there, too
        more = [line[72:80].strip()] if line[72:73] in ("+", "*") else []
    goes_on = name == "" or name[0] in "+*"
    return name.rstrip("*").strip().upper(), fields, more, goes_on
