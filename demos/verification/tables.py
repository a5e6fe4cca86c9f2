"""Values of the reference tables of `demos/references/data`, by what they hold.

Lengths, loads and frequencies are dimensionless as stated with each function:
`D = E h^3 / (12 (1 - nu^2))`, `a` the side of a square plate, `q` a load per area.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import pandas as pd

from shellmb.arrays import Floats
from shellmb.demos.references.tables import read, source

CurveName = Literal["sze31_cantilever_shear", "sze32_cantilever_moment", "sze34_hemisphere"]
Theory = Literal["3D_elasticity", "FSDT_k5/6", "CLPT"]


@dataclass(frozen=True)
class Curve:
    """Displacements along a path of growing load.

    Args:
        name: Name of the table.
        load: Fractions of the largest load, shape (n,), ending with 1.
        values: Displacements by name of the column, each of shape (n,).
        source: The table's comment lines.
    """

    name: str
    load: Floats
    values: Mapping[str, Floats]
    source: str


def _row(table: str, **wanted: str | float) -> pd.Series:
    """The one row whose columns have the wanted values.

    Raises:
        KeyError: If no row or more than one has them; the message lists what there is.
    """
    data = read(table)
    found = data
    for column, value in wanted.items():
        found = found[found[column] == value]
    if len(found) != 1:
        known = data[list(wanted)].drop_duplicates().to_dict("records")
        raise KeyError(f"table {table} has {len(found)} rows with {wanted}; known are {known}")
    return found.iloc[0]


def _numbered(row: pd.Series) -> Floats:
    """The columns l1, l2, ... of a row of natural frequencies."""
    return row.filter(regex=r"^l\d+$").to_numpy(float)


def curve(name: CurveName) -> Curve:
    """A load-displacement curve of Sze, Liu & Lo (2004).

    Displacements have the unit of length of the problem. The cantilever under an end moment has
    the columns `..._num` (S4R elements) and `..._exact`.
    """
    data = read(name)
    load, *columns = data.columns
    values = {column: data[column].to_numpy(float) for column in columns}
    return Curve(name, data[load].to_numpy(float), values, source(name))


def plate_deflection(support: str, a_over_h: float) -> float:
    """Deflection `w D / (q a^4)` of a square Reissner-Mindlin plate under a uniform load.

    Args:
        support: "SSSS hard", "SSSS soft" or "CCCC" (w at the centre), or "CFFF" (cantilever, w at
            the middle of the free edge).
        a_over_h: Side over thickness: 5, 10, 20, 50 or 100; for "SSSS hard" also 1000.

    Raises:
        KeyError: If the table has no such plate.
    """
    if support == "SSSS hard":
        row = _row("plate_ss_square_static", a_over_h=a_over_h)
        return float(row["w_center*D/(q*a^4)"])
    return float(_row("plate_rm_static_ritz", bc=support, a_over_h=a_over_h)["wD_over_qa4"])


def plate_frequencies(support: str, a_over_h: float) -> Floats:
    """First eight `omega a^2 sqrt(rho h / D)` of a square Reissner-Mindlin plate, shape (8,).

    Bending modes only; rigid modes of the free plate are left out.

    Args:
        support: "SSSS hard", "SSSS soft", "CCCC", "CFFF" (cantilever) or "FFFF".
        a_over_h: Side over thickness: 5, 10, 20, 50 or 100.

    Raises:
        KeyError: If the table has no such plate.
    """
    return _numbered(_row("plate_rm_freq_ritz", bc=support, a_over_h=a_over_h))


def thin_plate_frequencies(name: str) -> Floats:
    """First eight `omega a^2 sqrt(rho h / D)` of a thin plate, shape (8,).

    Args:
        name: "clamped", "free", "simply supported", "cantilever (clamped x=0)",
            "CFCF order x0,xa,y0,yb", "SFSF order x0,xa,y0,yb" or
            "cantilever, b/a=1/2 (length a)".

    Raises:
        KeyError: If the table has no such plate.
    """
    return _numbered(_row("plate_thin_freq_ritz", name=name))


def laminate_deflection(layup: str, a_over_h: float, theory: Theory = "FSDT_k5/6") -> float:
    """Centre deflection `100 w E2 h^3 / (q0 a^4)` of a cross-ply square, sinusoidal load.

    Args:
        layup: "0/90/90/0", "0/90/0" or "0/90", with E1 = 25 E2.
        a_over_h: Side over thickness: 4, 10, 20, 50 or 100.
        theory: First-order shear deformation (the default), 3D elasticity or thin plate.

    Raises:
        KeyError: If the table has no such laminate.
    """
    row = _row("laminate_ss_sinusoidal_deflection", layup=layup, a_over_h=a_over_h)
    return float(row[f"w_{theory}"])


def angle_ply_deflection(b_over_a: float, a_over_h: float) -> float:
    """Centre deflection `100 w E2 h^3 / (q0 a^4)` of a [45/-45] rectangle, sinusoidal load.

    Args:
        b_over_a: Ratio of the sides, 1 or 3.
        a_over_h: First side over thickness: 4, 10 or 100.

    Raises:
        KeyError: If the table has no such laminate.
    """
    row = _row("laminate_angleply_deflection", b_over_a=b_over_a, a_over_h=a_over_h)
    return float(row["w_FSDT_k5/6"])


def laminate_frequency(layup: str, a_over_h: float) -> float:
    """Lowest `omega a^2 / h sqrt(rho / E2)` of a simply supported square laminate, FSDT.

    Args:
        layup: "0/90/90/0 equal plies", "45/-45" or "(45/-45)x4", with E1 = 40 E2.
        a_over_h: Side over thickness: 2, 4, 5, 10, 20, 25, 50 or 100.

    Raises:
        KeyError: If the table has no such laminate.
    """
    row = _row("laminate_ss_frequency", layup=layup, a_over_h=a_over_h)
    return float(row["omega*a^2/h*sqrt(rho/E2)"])
