"""Units of a scene, for labels only: numbers are in whatever consistent units a user takes."""

from dataclasses import dataclass

# derived units that have names of their own, by those of length, mass and time
NAMED: dict[tuple[str, ...], dict[str, str]] = {
    ("m", "kg", "s"): {"force": "N", "stress": "Pa", "energy": "J"},
    ("mm", "t", "s"): {"force": "N", "stress": "MPa", "energy": "mJ"},
    ("mm", "kg", "ms"): {"force": "kN", "stress": "GPa", "energy": "J"},
}

# frequent names of each; a place of another one has none of them
KNOWN = {
    "length": {"m", "mm", "cm", "km", "um", "in", "ft"},
    "mass": {"kg", "g", "mg", "t", "lb", "slug"},
    "time": {"s", "ms", "us", "min", "h"},
}

# powers of length, mass and time
POWERS = {
    "length": (1, 0, 0),
    "time": (0, 0, 1),
    "velocity": (1, 0, -1),
    "curvature": (-1, 0, 0),
    "force": (1, 1, -2),
    "moment": (2, 1, -2),
    "energy": (2, 1, -2),
    "stress": (-1, 1, -2),
    "force per length": (0, 1, -2),
    "moment per length": (1, 1, -2),
    "energy per length": (1, 1, -2),
    "energy per area": (0, 1, -2),
}
PLAIN = {"angle": "rad", "number": "-"}


@dataclass(frozen=True)
class Units:
    """Names of the units of length, mass and time; empty: labels have none.

    Args:
        names: The three names, or none.
    """

    names: tuple[str, ...] = ()

    def of(self, quantity: str) -> str:
        """Unit of a quantity; "" where none is known.

        Args:
            quantity: "length", "force", "moment per length", "angle", ... (`POWERS`, `PLAIN`).
        """
        if quantity in PLAIN:
            return PLAIN[quantity]
        if len(self.names) != 3:
            return ""
        named, (length, _, time) = NAMED.get(self.names, {}), self.names
        if quantity in named:
            return named[quantity]
        if quantity == "angular velocity":
            return f"rad/{time}"
        if quantity == "strain or curvature":
            return f"-, 1/{length}"
        powers = POWERS[quantity]
        if named and powers[1]:
            # what has a mass is a force, times or over lengths
            return _composed((named["force"], length), (1, powers[0] - 1))
        return _composed(self.names, powers)

    def label(self, text: str, quantity: str) -> str:
        """A label with its unit in brackets, if there is one.

        Args:
            text: The label.
            quantity: What it is of.
        """
        unit = self.of(quantity)
        return f"{text} [{unit}]" if unit else text


def _composed(names: tuple[str, ...], powers: tuple[int, ...]) -> str:
    above: list[str] = []
    below: list[str] = []
    for name, power in zip(names, powers, strict=True):
        size = {1: "", 2: "²"}.get(abs(power), f"^{abs(power)}")
        if power:
            (above if power > 0 else below).append(f"{name}{size}")
    over = " ".join(above) or "1"
    under = " ".join(below)
    if not below:
        return over
    return f"{over}/({under})" if len(below) > 1 else f"{over}/{under}"


def parse_units(text: str | None) -> Units:
    """Units from "mm, t, s": those of length, mass and time.

    Args:
        text: The names with commas; None: no units.

    Raises:
        ValueError: If it is no such list.
    """
    if text is None:
        return Units()
    names = tuple(part.strip() for part in text.split(","))
    if len(names) != 3 or not all(names):
        raise ValueError(
            "it must be the units of length, mass and time with commas between them, as in "
            "'mm, t, s'"
        )
    return Units(names)


def check_order(units: Units) -> None:
    """Refuse names in another order than length, mass and time; runs that have such are still read.

    Args:
        units: The units.

    Raises:
        ValueError: If a frequent name is in the place of another kind.
    """
    for name, wanted in zip(units.names, KNOWN, strict=False):
        for kind, known in KNOWN.items():
            if name in known and kind != wanted:
                raise ValueError(
                    f"it must be the units of length, mass and time in this order, as in "
                    f"'mm, t, s'; '{name}' is a unit of {kind}, in the place of {wanted}"
                )
