"""The reference tables are complete, and their readers say what is known."""

from importlib.resources import files

import numpy as np
import pytest

from shellmb.demos.verification import tables
from tests.analytic.solutions import plate_wave_frequencies

NAMES = sorted(path.name[:-4] for path in (files("shellmb.demos.references") / "data").iterdir())


def test_the_tables_are_there() -> None:
    assert len(NAMES) == 20


def test_every_table_says_where_it_comes_from() -> None:
    sources = {name: tables.source(name).lower() for name in NAMES}
    assert not [n for n, text in sources.items() if not ("computed" in text or "seen in" in text)]
    data = {name: tables.read(name) for name in NAMES}
    assert not [n for n, table in data.items() if len(table) == 0 or table.isna().any().any()]


@pytest.mark.parametrize(
    ("name", "end"),
    [
        ("sze31_cantilever_shear", {"minus_U_tip": 3.286, "W_tip": 6.698}),
        ("sze32_cantilever_moment", {"minus_U_tip_exact": 12.0, "W_tip_exact": 0.0}),
        ("sze34_hemisphere", {"V_A_outward": 4.067, "minus_U_B_inward": 8.178}),
    ],
)
def test_curves(name: tables.CurveName, end: dict[str, float]) -> None:
    curve = tables.curve(name)
    np.testing.assert_allclose(curve.load, np.linspace(0.05, 1.0, 20), atol=1e-12)
    assert {key: curve.values[key][-1] for key in end} == end
    assert "Sze, Liu & Lo 2004" in curve.source


def test_plates() -> None:
    """Values of docs/reference/literature.md, tables."""
    assert tables.plate_deflection("SSSS hard", 10) == 4.272842e-3
    assert tables.plate_deflection("CCCC", 100) == 1.267854e-3
    assert tables.plate_deflection("CFFF", 5) == 0.1365595
    np.testing.assert_array_equal(tables.plate_frequencies("CFFF", 10)[:2], [3.4307, 8.0603])
    assert tables.plate_frequencies("FFFF", 10).shape == (8,)
    assert plate_wave_frequencies(10)[1, 1] == 19.064967
    assert tables.thin_plate_frequencies("cantilever, b/a=1/2 (length a)")[1] == 14.8028


@pytest.mark.parametrize("a_over_h", [5, 10, 20, 50, 100])
def test_the_two_tables_of_the_hard_square_agree(a_over_h: float) -> None:
    row = tables.read("plate_rm_static_ritz").query(f"bc == 'SSSS hard' and a_over_h == {a_over_h}")
    assert row["wD_over_qa4"].item() == tables.plate_deflection("SSSS hard", a_over_h)


def test_laminates() -> None:
    """Values of docs/reference/literature.md, tables."""
    assert tables.laminate_deflection("0/90", 4) == 2.14916
    assert tables.laminate_deflection("0/90/0", 10, "3D_elasticity") == 0.75303
    assert tables.angle_ply_deflection(3.0, 100) == 2.06742
    assert tables.laminate_frequency("(45/-45)x4", 100) == 25.1757


def test_an_unknown_row_names_the_known_ones() -> None:
    with pytest.raises(KeyError, match=r"0 rows with .*'CCFF'.*known are .*'CFFF'"):
        tables.plate_deflection("CCFF", 10)
    with pytest.raises(KeyError, match=r"a_over_h in .*1000.*not 7"):
        plate_wave_frequencies(7)
    with pytest.raises(FileNotFoundError):
        tables.source("no_such_table")
