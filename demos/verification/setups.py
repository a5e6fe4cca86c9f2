"""Plates and their supports, as several cases use them.

Square plates have sides of length 1 in the x-y plane. The load is `D` per area, so that the
deflection is the dimensionless one that tables give; the linear problem does not mind its size.
"""

from typing import Literal

from shellmb.scene import (
    Clamped,
    Fixed,
    HardSupport,
    Isotropic,
    LinearSection,
    Load,
    Rectangle,
    Scene,
    Shell,
    SoftSupport,
    Support,
    SurfaceForce,
)

Cell = Literal["quad", "tri"]
Edges = Literal["hard", "soft", "clamped", "cantilever", "free", "SS-1", "SS-2"]

ALL = ("left", "right", "bottom", "top")
NU = 0.3
CENTRE = (0.5, 0.5, 0.0)
TIP = (1.0, 0.5, 0.0)

# held in its plane without a force, since none acts there
IN_PLANE = (
    Fixed("left-bottom", displacement=(0.0, 0.0, None)),
    Fixed("right-bottom", displacement=(None, 0.0, None)),
)
# along the edges of a laminate (SS-1) or across them (SS-2)
ALONG = (
    Fixed(("left", "right"), displacement=(None, 0.0, None)),
    Fixed(("bottom", "top"), displacement=(0.0, None, None)),
)
ACROSS = (
    Fixed(("left", "right"), displacement=(0.0, None, None)),
    Fixed(("bottom", "top"), displacement=(None, 0.0, None)),
)
SUPPORTS: dict[Edges, tuple[Support, ...]] = {
    "hard": (HardSupport(ALL), *IN_PLANE),
    "soft": (SoftSupport(ALL), *IN_PLANE),
    "clamped": (Clamped(ALL),),
    "cantilever": (Clamped("left"),),
    "free": (),
    "SS-1": (HardSupport(ALL), *ALONG),
    "SS-2": (HardSupport(ALL), *ACROSS),
}


def plate_section(thickness: float, density: float = 0.0) -> Isotropic:
    """Isotropic section with Young's modulus 1."""
    return Isotropic(1.0, NU, thickness=thickness, density=density)


def square(
    edges: Edges,
    section: LinearSection,
    load: Load | None = None,
    mesh: tuple[int, int] = (8, 8),
    cell: Cell = "quad",
    distortion: float = 0.0,
) -> Scene:
    """A square plate in linear statics.

    Args:
        edges: Its supports.
        section: Its section.
        load: Its load; None: uniform.
        mesh: Numbers of elements.
        cell: Cell type.
        distortion: Distortion of the mesh.
    """
    shell = Shell(
        "plate", Rectangle(1.0, 1.0), section, mesh=mesh, cell=cell, distortion=distortion
    )
    if load is None:
        load = SurfaceForce((0.0, 0.0, float(section.D[0, 0])))
    return Scene(
        "square", (shell,), supports=SUPPORTS[edges], loads=(load,), scheme="linear-statics"
    )
