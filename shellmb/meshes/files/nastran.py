"""Nastran's bulk data: nodes in their coordinate systems, shells, and what else there is.

Written here, as meshio takes coordinates for Cartesian and leaves out what it does not know, and
pyNastran (1.4) does not go with NumPy 2.
"""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from shellmb.arrays import Floats
from shellmb.meshes.files.cards import DeckError, cards, integer, real
from shellmb.meshes.files.kinds import CELLS, FileContent
from shellmb.meshes.raw import vertex_count

# card -> number of nodes, and the field of the offset from them, before which is the direction
SHELLS = {
    "CTRIA3": (3, 7),
    "CTRIAR": (3, 7),
    "CTRIA6": (6, 10),
    "CQUAD4": (4, 8),
    "CQUADR": (4, 8),
    "CQUAD8": (8, 16),
    "CQUAD": (9, 13),
}
SYSTEM = re.compile(r"CORD([12])([RCS])")
# cards with C that are no elements
OTHERS = re.compile(
    r"CORD|CAERO|CREEP|CYAX|CYJOIN|CYSUP|CYSYM|CSET|CSSCHD|CSUP|CLOAD|CONTRLT|CONV|CBARAO|CTYPE"
)
# what ties nodes to one another
TIES = re.compile(r"RBE\d|RBAR|RROD|RTRPLT|RSPLINE|RSSCON|RJOINT|MPC$|PLOTEL")


def is_nastran(path: Path) -> bool:
    """Decide whether a file holds bulk data of Nastran.

    Args:
        path: The file.
    """
    begin = path.read_bytes()[:200_000].decode(errors="replace")
    found = r"^(BEGIN\s+BULK|GRID[ *,\t]|C(QUAD|TRIA)[468R3]?[ *,\t])"
    return bool(re.search(found, begin, re.IGNORECASE | re.MULTILINE))


def read_nastran(path: Path) -> FileContent:
    """Read a deck.

    Args:
        path: The file.

    Raises:
        DeckError: If a card cannot be read, or names a node or coordinate system that is missing.
    """
    deck = list(cards(path))
    systems = _Systems(deck)
    numbers = {number: row for row, number in enumerate(systems.nodes)}
    x = [systems.node(number) for number in systems.nodes]
    found = FileContent(np.zeros((0, 3)), directions="THETA or MCID")
    left_out = found.left_out
    offsets = dict(_offsets(deck))
    for card in deck:
        if card[0] not in SHELLS:
            if TIES.match(card[0]) or (card[0][0] == "C" and not OTHERS.match(card[0])):
                left_out[card[0]] += 1
            continue
        count, offset = SHELLS[card[0]]
        nodes = _nodes(card, count, numbers, x)
        if card[0] != "CQUAD" and real(card, offset) != 0:
            left_out[f"ZOFFS of {card[0]}"] += 1
        # an angle from the first side is a number, a coordinate system a whole one
        given = card[offset - 1] if offset <= len(card) else ""
        if given.isdigit() or real(card, offset - 1) != 0:
            found.directed.append(len(found.cells))
        part = integer(card, 2) or integer(card, 1)
        if part in offsets:
            left_out[offsets[part]] += 1
        found.groups.setdefault(f"PID {part}", []).append(len(found.cells))
        found.cells.append(nodes)
    found.x = np.array(x, dtype=float).reshape(-1, 3)
    return found


def _offsets(deck: list[list[str]]) -> Iterator[tuple[int | None, str]]:
    """Properties whose shells are not in the middle between both sides, and what says so."""
    for card in deck:
        if card[0] == "PSHELL" and real(card, 13) != 0:
            yield integer(card, 1), "ZOFFS of PSHELL"
        elif card[0] == "PCOMP" and len(card) > 2 and card[2]:
            # material, thickness, angle, output; the thickness goes on with the next ply
            plies = [k for k in range(9, len(card), 4) if any(card[k : k + 4])]
            thickness = before = 0.0
            for k in plies:
                before = real(card, k + 1) or before
                thickness += before
            thickness *= 2 if card[8].upper().startswith("SYM") else 1
            if abs(real(card, 2) + thickness / 2) > 1e-4 * thickness:
                yield integer(card, 1), "Z0 of PCOMP"
        elif card[0] == "PCOMPG" and len(card) > 2 and card[2]:
            yield integer(card, 1), "Z0 of PCOMPG"


def _nodes(card: list[str], count: int, numbers: dict[int, int], x: list[Floats]) -> list[int]:
    """Rows of the nodes of a shell; middles of sides that are left empty are made."""
    corners = vertex_count(CELLS[count])
    nodes: list[int] = []
    for k in range(count):
        number = integer(card, 3 + k)
        if number is None and corners <= k < 2 * corners:
            a, b = nodes[k - corners], nodes[(k - corners + 1) % corners]
            nodes.append(len(x))
            x.append((x[a] + x[b]) / 2)
        elif number in numbers:
            nodes.append(numbers[number])
        else:
            named = "has no node" if number is None else f"has the node {number}"
            raise DeckError(
                f"{card[0]} {card[1]} {named} in field {3 + k}; it must be one of its GRIDs"
            )
    return nodes


class _Systems:
    """Nodes and coordinate systems of a deck, in basic coordinates.

    Args:
        deck: The cards.

    Attributes:
        nodes: Cards of the nodes by their numbers.
    """

    def __init__(self, deck: list[list[str]]) -> None:
        self.nodes: dict[int, list[str]] = {}
        self._cards: dict[int, list[str]] = {}
        self._usual = 0
        self._axes: dict[int, tuple[Floats, Floats]] = {0: (np.zeros(3), np.eye(3))}
        self._open: list[int] = []
        for card in deck:
            kind = SYSTEM.fullmatch(card[0])
            if card[0] == "GRID":
                _keep(self.nodes, _number(card, 1), card)
            elif card[0] == "GRDSET":
                self._usual = integer(card, 2) or 0
            elif kind is not None and kind[1] == "1":
                # two of them to a card
                for k in (1, 5):
                    if integer(card, k) is not None:
                        one = [card[0], *card[k : k + 4]]
                        _keep(self._cards, _number(card, k), one)
            elif card[0].startswith("CORD"):
                _keep(self._cards, _number(card, 1), card)

    def node(self, number: int) -> Floats:
        """Position of a node."""
        card = self.nodes[number]
        system = integer(card, 2)
        system = self._usual if system is None else system
        return self._position(system, [real(card, k) for k in (3, 4, 5)], card)

    def _position(self, system: int, place: list[float], card: list[str]) -> Floats:
        """A place given in a system; ``card`` asks for it."""
        if system not in self._cards and system != 0:
            raise DeckError(
                f"{card[0]} {card[1]} is given in the coordinate system {system}, which the deck "
                "does not define"
            )
        if system not in self._axes:
            self._axes[system] = self._found(system)
        kind = "R" if system == 0 else self._cards[system][0][-1]
        a, b, c = place
        if kind == "C":
            place = [a * np.cos(np.radians(b)), a * np.sin(np.radians(b)), c]
        elif kind == "S":
            level = a * np.sin(np.radians(b))
            turn = np.radians(c)
            place = [level * np.cos(turn), level * np.sin(turn), a * np.cos(np.radians(b))]
        origin, axes = self._axes[system]
        return origin + np.asarray(place) @ axes

    def _found(self, system: int) -> tuple[Floats, Floats]:
        """Origin and axes of a system, by three points: origin, on z, in the plane of x and z."""
        card = self._cards[system]
        kind = SYSTEM.fullmatch(card[0])
        if kind is None:
            raise DeckError(
                f"nodes are given in the coordinate system {card[0]} {system}; it must be one of "
                "CORD1R, CORD1C, CORD1S, CORD2R, CORD2C, CORD2S"
            )
        if system in self._open:
            raise DeckError(
                f"{card[0]} {system} is defined by itself, over "
                f"{' and '.join(map(str, self._open))}; it must not be"
            )
        self._open.append(system)
        if kind[1] == "1":
            given = [_number(card, k) for k in (2, 3, 4)]
            missing = [number for number in given if number not in self.nodes]
            if missing:
                raise DeckError(
                    f"{card[0]} {system} has the node {missing[0]}; it must be one of its GRIDs"
                )
            points = [self.node(number) for number in given]
        else:
            base = integer(card, 2) or 0
            points = [
                self._position(base, [real(card, k + i) for i in range(3)], card) for k in (3, 6, 9)
            ]
        self._open.pop()
        origin, z, x = points[0], points[1] - points[0], points[2] - points[0]
        y = np.cross(z, x)
        if not np.linalg.norm(y) > 1e-9 * np.linalg.norm(z) * np.linalg.norm(x):
            raise DeckError(
                f"the three points of {card[0]} {system} are on one line; they must not be"
            )
        x = np.cross(y, z)
        return origin, np.array([v / np.linalg.norm(v) for v in (x, y, z)])


def _keep(known: dict[int, list[str]], number: int, card: list[str]) -> None:
    """Take a card, which may be there twice if both say the same."""
    if number in known and _values(known[number]) != _values(card):
        raise DeckError(f"{card[0]} {number} is there twice and differs; it must be there once")
    known[number] = card


def _values(card: list[str]) -> list[float | str]:
    """Values of a card, however its numbers are written; without zeros at its end."""
    values = [real(card, k) for k in range(1, len(card))]
    while values and values[-1] == 0:
        values.pop()
    return [card[0], *values]


def _number(card: list[str], k: int) -> int:
    number = integer(card, k)
    if number is None:
        raise DeckError(f"field {k} of a {card[0]} is empty; it must be a number")
    return number
