"""Abaqus input: nodes, shells and element sets of parts and instances, and what else there is.

Written here, as meshio knows neither instances nor all shells, and leaves out what it does not
know.
"""

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from shellmb.arrays import Floats
from shellmb.meshes.files.cards import DeckError, included
from shellmb.meshes.files.kinds import FileContent

# shells, membranes, and cells of plane models, by their numbers of nodes
SHELL = re.compile(r"(?:S|DS|STRI|SFM3D|M3D|CPS|CPE|CAX)([34689])")
# keywords that make or move nodes and elements, which are not carried out
MAKE = {"NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "SYSTEM", "IMPERFECTION"}
# keywords that tie nodes to one another
TIES = re.compile(
    r"TIE|MPC|EQUATION|((KINEMATIC|DISTRIBUTING|SHELL TO SOLID) )?COUPLING|RIGID BODY"
    r"|EMBEDDED ELEMENT|FASTENER|MASS|ROTARY INERTIA"
)
# sets have no more elements that are counted up
LONGEST = 10**7


@dataclass
class _Part:
    """Content of one part: positions by node, kind and nodes by element, elements by set."""

    nodes: dict[int, list[float]] = field(default_factory=dict)
    elements: dict[int, list[int]] = field(default_factory=dict)
    sets: dict[str, list[int]] = field(default_factory=dict)


def read_abaqus(path: Path) -> FileContent:
    """Read an input file.

    Args:
        path: The file.

    Raises:
        DeckError: If it makes nodes or elements by keywords, or a line cannot be read.
    """
    return _Reader().read(path)


class _Reader:
    """Reads keywords one after the other."""

    def __init__(self) -> None:
        self.parts: dict[str, _Part] = {}
        self.here = self.whole = _Part()
        # name, part or content of its own, and translation with rotation
        self.instances: list[tuple[str, _Part, list[list[float]]]] = []
        # sets of the assembly: numbers of elements by instances
        self.assembly: dict[str, dict[str, list[int]]] = {}
        self.left_out: Counter[str] = Counter()
        self.names: dict[str, str] = {}
        # sets whose sections have a direction
        self.oriented: set[str] = set()

    def read(self, path: Path) -> FileContent:
        for name, options, data in _keywords((path,), []):
            try:
                self._take(name, options, data)
            except (ValueError, IndexError) as error:
                raise DeckError(
                    f"the lines of *{name} are not read ({error}); they must be numbers with "
                    "commas between them"
                ) from error
        return self._found()

    def _take(self, name: str, options: dict[str, str], data: list[list[str]]) -> None:
        if name in MAKE or (name == "NODE" and "SYSTEM" in options) or "INPUT" in options:
            more = ", ".join(o for o in ("SYSTEM", "INPUT") if o in options and name not in MAKE)
            raise DeckError(
                f"*{name}{', ' + more if more else ''} is not read; write nodes and elements out "
                "one by one, in Cartesian coordinates"
            )
        if name == "PART":
            self.here = self.parts.setdefault(options.get("NAME", "").upper(), _Part())
        elif name in ("END PART", "ASSEMBLY", "END INSTANCE"):
            self.here = self.whole
        elif name == "INSTANCE":
            self._instance(options, data)
        elif name == "NODE":
            for row in data:
                place = [float(v) for v in row[1:4] if v]
                number, x = int(row[0]), [*place, 0.0, 0.0, 0.0][:3]
                if self.here.nodes.setdefault(number, x) != x:
                    raise DeckError(
                        f"node {number} is there twice, at different places; it must be there once"
                    )
        elif name == "ELEMENT":
            self._elements(options, data)
        elif name == "ELSET":
            self._set(options, data)
        elif TIES.fullmatch(name):
            self.left_out[f"*{name}"] += 1
        elif name in ("SHELL SECTION", "SHELL GENERAL SECTION"):
            if "OFFSET" in options and not _is_zero(options["OFFSET"]):
                self.left_out[f"OFFSET of *{name}"] += 1
            if "ORIENTATION" in options:
                self.oriented.add(options.get("ELSET", "").upper())

    def _elements(self, options: dict[str, str], data: list[list[str]]) -> None:
        kind = options.get("TYPE", "").upper()
        shell = SHELL.match(kind)
        numbers: list[int] = []
        if shell is None:
            # an element goes on where a line ends in a comma
            starts = [True, *(row[-1] != "" for row in data[:-1])]
            self.left_out[kind or "*ELEMENT"] += sum(starts[: len(data)])
            numbers = [int(row[0]) for row, start in zip(data, starts, strict=False) if start]
        else:
            count = int(shell[1])
            flat = [int(v) for row in data for v in row if v]
            if len(flat) % (count + 1):
                raise ValueError(f"{kind} has {count} nodes")
            for k in range(0, len(flat), count + 1):
                numbers.append(flat[k])
                element = flat[k + 1 : k + count + 1]
                if self.here.elements.setdefault(flat[k], element) != element:
                    raise DeckError(
                        f"element {flat[k]} is there twice, with different nodes; each must have a "
                        "number of its own"
                    )
        if "ELSET" in options:
            self._add(options["ELSET"], "", numbers)

    def _instance(self, options: dict[str, str], data: list[list[str]]) -> None:
        """Take an instance: of a part, of a part and more, or with a mesh of its own."""
        of = options.get("PART", "")
        if "LIBRARY" in options or of.upper() not in self.parts:
            why = "of another run" if "LIBRARY" in options else f"of the part '{of}'"
            raise DeckError(
                f"instance '{options.get('NAME', '')}' is {why}, which is not there; it must be of "
                "a *PART of the file"
            )
        part = self.parts[of.upper()]
        # what follows, if anything does, is of this instance alone
        sets = {name: [*numbers] for name, numbers in part.sets.items()}
        self.here = _Part(dict(part.nodes), dict(part.elements), sets)
        moved = [[float(v) for v in row if v] for row in data]
        self.instances.append((options.get("NAME", "").upper(), self.here, moved))

    def _key(self, name: str) -> str:
        """The name of a set as it is first written."""
        return self.names.setdefault(name.upper(), name)

    def _set(self, options: dict[str, str], data: list[list[str]]) -> None:
        rows = [[v for v in row if v] for row in data]
        name, of = options.get("ELSET", ""), options.get("INSTANCE", "").upper()
        self._add(name, of, [])
        if "GENERATE" in options:
            for first, last, *step in ([int(v) for v in row] for row in rows):
                numbers = range(first, last + 1, step[0] if step else 1)
                if len(numbers[: LONGEST + 1]) > LONGEST:
                    raise ValueError(
                        f"GENERATE goes from {first} to {last}, beyond {LONGEST} elements"
                    )
                self._add(name, of, list(numbers))
            return
        for value in (v for row in rows for v in row):
            self._member(name, of, value)

    def _member(self, name: str, of: str, value: str) -> None:
        """Put an element, or those of another set, into a set."""
        instance, dot, rest = value.strip('"').rpartition(".")
        if dot and self._key(value) in self.here.sets:
            rest = value
        elif dot:
            of = instance.strip('"').upper()
        rest = rest.strip('"')
        if rest.isdigit():
            self._add(name, of, [int(rest)])
            return
        key = self._key(rest)
        within = {number: part for number, part, _ in self.instances}
        if of in within and key in within[of].sets:
            self._add(name, of, list(within[of].sets[key]))
        elif not of and (key in self.here.sets or key in self.assembly):
            self._add(name, "", list(self.here.sets.get(key, ())))
            for other, numbers in dict(self.assembly.get(key, {})).items():
                self._add(name, other, list(numbers))
        else:
            raise DeckError(
                f"the set '{name}' has '{value}' in it, which is not there; it must be an element "
                "or a set that is defined before"
            )

    def _add(self, name: str, of: str, numbers: list[int]) -> None:
        """Add elements to a set: of an instance, or of the part that is read."""
        sets = self.assembly.setdefault(self._key(name), {}) if of else self.here.sets
        sets.setdefault(of or self._key(name), []).extend(numbers)

    def _found(self) -> FileContent:
        """All instances, each with its nodes where it stands; without any the file as it is."""
        placed = self.instances or [(name, part, []) for name, part in self.parts.items()]
        if self.whole.nodes or not self.parts:
            placed = [("", self.whole, []), *placed]
        x: list[Floats] = []
        found = FileContent(np.zeros((0, 3)), left_out=self.left_out, directions="ORIENTATION")
        for instance, part, moved in placed:
            rows = {number: len(x) + k for k, number in enumerate(part.nodes)}
            x += list(_moved(np.array(list(part.nodes.values())).reshape(-1, 3), moved))
            places = {}
            for number, nodes in part.elements.items():
                missing = [node for node in nodes if node not in rows]
                if missing:
                    raise DeckError(
                        f"element {number} has the node {missing[0]}; it must be one of *NODE"
                    )
                places[number] = len(found.cells)
                found.cells.append([rows[node] for node in nodes])
            own = [(name, numbers) for name, numbers in part.sets.items()]
            own += [(name, by[instance]) for name, by in self.assembly.items() if instance in by]
            for name, numbers in own:
                if there := [places[number] for number in numbers if number in places]:
                    found.groups.setdefault(name, []).extend(there)
                    found.directed += there if name.upper() in self.oriented else []
        found.x = np.array(x, dtype=float).reshape(-1, 3)
        return found


def _is_zero(value: str) -> bool:
    try:
        return float(value) == 0
    except ValueError:
        return False


def _moved(x: Floats, moved: list[list[float]]) -> Floats:
    """Nodes of an instance: translated, then turned about an axis through two points."""
    if moved:
        x = x + np.array(moved[0][:3])
    if len(moved) > 1:
        from scipy.spatial.transform import Rotation

        a, b, angle = np.array(moved[1][:3]), np.array(moved[1][3:6]), moved[1][6]
        axis = (b - a) / np.linalg.norm(b - a)
        x = a + Rotation.from_rotvec(np.radians(angle) * axis).apply(x - a)
    return x


def _keywords(
    within: tuple[Path, ...], read: list[Path]
) -> Iterator[tuple[str, dict[str, str], list[list[str]]]]:
    """Keywords with their options and lines of data, those of included files in their places."""
    lines = [
        line.strip()
        for line in within[-1].read_text(errors="replace").splitlines()
        if line.strip() and not line.lstrip().startswith("**")
    ]
    k = 0
    while k < len(lines):
        line = lines[k]
        k += 1
        if not line.startswith("*"):
            continue
        while line.endswith(",") and k < len(lines):
            line += lines[k]
            k += 1
        words = [word.strip() for word in line[1:].split(",")]
        pairs = (word.partition("=") for word in words[1:] if word)
        options = {a.strip().upper(): b.strip().strip('"') for a, _, b in pairs}
        data = []
        while k < len(lines) and not lines[k].startswith("*"):
            data.append([value.strip() for value in lines[k].split(",")])
            k += 1
        name = " ".join(words[0].upper().split())
        if name != "INCLUDE":
            yield name, options, data
            continue
        files = included(options.get("INPUT", ""), within, read)
        yield from _keywords(files, read)
