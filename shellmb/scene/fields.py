"""Fields over bodies: names, components, units, and which bodies have them."""

from dataclasses import dataclass

XYZ, PLANE, SHEAR = ("x", "y", "z"), ("11", "22", "12"), ("13", "23")
FRAME = ("1", "2", "3")
# in names of components of strains: these are changes of a direction by length
CURVATURES = ("kap", "twist", "curvature")
STRAIN = "strain or curvature"


@dataclass(frozen=True)
class FieldKind:
    """A field over a body.

    Args:
        what: What it is.
        quantity: What its unit is of (`Units.of`).
        components: Names of its components; none: a scalar.
        bodies: Kinds of bodies that have it.
        axis: Name of the dimension of its components.
    """

    what: str
    quantity: str
    components: tuple[str, ...]
    bodies: frozenset[str]
    axis: str = ""

    def quantity_of(self, component: str | None) -> str:
        """Quantity of one component, for fields whose components have several units.

        Args:
            component: Its name; None: all together.
        """
        if self.quantity != STRAIN or component is None:
            return self.quantity
        return "curvature" if any(name in component for name in CURVATURES) else "number"


def _kind(
    what: str, quantity: str, components: tuple[str, ...], axis: str, bodies: str
) -> FieldKind:
    return FieldKind(what, quantity, components, frozenset(bodies.split()), axis)


EVERY, BODIES, SHELL = "shell beam rigid joint", "shell beam rigid", "shell"
FACES, BOTH = ("lower", "upper"), ("first", "second")
LOWER_UPPER = tuple(f"{face} {c}" for face in FACES for c in PLANE)
SIX = tuple(f"{side} {c}" for side in ("bottom", "middle", "top") for c in SHEAR)
SPRINGS = ("eps 11", "eps 22", "2 eps 12", "kap 11", "kap 22", "2 kap 12")
EXTREMES = tuple(f"{face} {which}" for face in FACES for which in BOTH)

FIELDS: dict[str, FieldKind] = {
    "displacement": _kind("displacement", "length", XYZ, "axis", EVERY),
    "director": _kind("directors", "number", XYZ, "axis", BODIES),
    "velocity": _kind("velocity", "velocity", XYZ, "axis", BODIES),
    "director_velocity": _kind("velocities of directors", "angular velocity", XYZ, "axis", BODIES),
    "N": _kind("membrane forces", "force per length", PLANE, "plane", SHELL),
    "M": _kind("bending moments", "moment per length", PLANE, "plane", SHELL),
    "Q": _kind("transverse shear forces", "force per length", SHEAR, "across", SHELL),
    "principal_N": _kind("principal membrane forces", "force per length", BOTH, "principal", SHELL),
    "strains": _kind("strains", STRAIN, (), "strain", "shell beam"),
    "branch_strains": _kind("strains of Maxwell branches", STRAIN, SPRINGS, "branch", "relaxing"),
    "natural_factor": _kind("factor of natural strains", "number", (), "", "held"),
    "energy_density": _kind("strain energy density", "energy per area", (), "", "shell beam"),
    "surface_stress": _kind("stresses at both faces", "stress", LOWER_UPPER, "face", "linear"),
    "von_mises": _kind("von Mises stresses at both faces", "stress", FACES, "surface", "linear"),
    "principal_stress": _kind(
        "principal stresses at both faces", "stress", EXTREMES, "extreme", "linear"
    ),
    "principal_strain": _kind(
        "principal strains at both faces", "number", EXTREMES, "extreme", "linear"
    ),
    "ply_stress": _kind("stresses along the fibres", "stress", LOWER_UPPER, "face", "laminate"),
    "interlaminar": _kind("shear stresses between plies", "stress", SIX, "side", "linear"),
    "utilisation": _kind("utilisation, 1 at failure", "number", (), "", "linear"),
    "reserve": _kind("reserve factor against failure", "number", (), "", "linear"),
    "critical_ply": _kind("ply with the least reserve factor", "number", (), "", "linear"),
    "force": _kind("forces", "force", FRAME, "frame", "beam joint"),
    "moment": _kind("moments", "moment", FRAME, "frame", "beam joint"),
}

# of which a body has several, with a number or a name behind theirs
JUDGED = ("utilisation", "reserve", "critical_ply")
MANY = ("ply_stress", "interlaminar", "branch_strains", *JUDGED)
# written if nothing is named
DEFAULT = ("displacement", "director", "velocity")
# of which nothing has to be computed
STATE = (*DEFAULT, "director_velocity")
