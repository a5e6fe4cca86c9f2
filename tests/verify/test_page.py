"""The table of docs/evidence/verification.md is made from all that `shellmb verify` said."""

import importlib.util
import json
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def tables() -> Any:
    """The script as a module."""
    spec = importlib.util.spec_from_file_location("tables", ROOT / ".ci/tables.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def entry(case: str, error: float | None, tolerance: float, source: str = "") -> dict[str, Any]:
    passed = error is not None and error <= tolerance
    return {"case": case, "error": error, "tolerance": tolerance, "pass": passed, "source": source}


def test_the_page_has_the_table_of_the_stored_results(tables: Any) -> None:
    for page, made in tables.pages(json.loads(tables.STORED.read_text())).items():
        assert page.read_text() == made, "run .ci/tables.py"


def test_each_mesh_of_an_element_shows_its_farthest_value_beside_others(tables: Any) -> None:
    """Of all values of a problem on a mesh, and of other codes on the same mesh."""
    title = "elements/twisted beam: quad 12x2, thickness=0.32"
    rows = [
        {"case": f"{title}; in plane", "value": 0.99},
        {"case": f"{title}; out of plane", "value": 1.02},
        {"case": "elements/twisted beam: tri 12x2, thickness=0.32; in plane", "value": 0.5},
        {"case": "elements/patch: shear, quad", "value": 1e-13},
        {"case": "plates/square: quad", "value": 0.9},
    ]
    rows += [{"case": f"elements/ring: quad 4x1; {k}", "value": 1 + k / 100} for k in (1, -3, 2)]
    beam = "| twisted beam | 12x2, thickness=0.32 |"
    assert tables.elements(rows, "quad").splitlines()[2:] == [
        f"{beam} -1.0 | in plane | OptiStruct QUAD4 -0.8, OptiStruct QUAD8 +6.2 |",
        f"{beam} +2.0 | out of plane | OptiStruct QUAD4 -1.2, OptiStruct QUAD8 +1.4 |",
        "| ring | 4x1 | -3.0 | -3 |  |",
    ]


def test_each_row_shows_the_value_nearest_to_its_bound(tables: Any, monkeypatch: Any) -> None:
    """By the share of its own bound, not by size; what is not a number comes before all."""
    monkeypatch.setattr(tables, "find_cases", lambda slow: [Named("a"), Named("b")])
    rows = [entry("a: small bound", 9e-4, 1e-3, "12 iterations"), entry("a: large", 0.05, 0.1)]
    rows += [entry("a: other", 1e-9, 1e-3, "arc; 33 iterations"), entry("b: x", 1.0, 2.0)]
    rows += [entry("b: |u| of none", None, 1.0), entry("b: y", 3.0, 2.0)]
    lines = tables.table(rows).splitlines()
    assert lines[0] == "6 values, 4 pass:"
    assert (
        lines[-2]
        == "| a | What (12 to 33 iterations) | 3 | small bound | 0.0009, 0.001 | 0.05, 0.1 |"
    )
    assert lines[-1] == "| b | What | 3 | \\|u\\| of none | not a number, 1 | not a number, 1 |"
    with pytest.raises(SystemExit, match="differ in: b"):
        tables.table(rows[:3])


def test_what_changed_is_told(tables: Any) -> None:
    old = [entry("a: x", 1e-2, 0.1), entry("a: y", 1e-14, 1e-9), entry("b: z", 1e-2, 0.1)]
    same = [entry("a: x", 1.04e-2, 0.1), entry("a: y", 3e-13, 1e-9)]
    assert not tables.differences(old, same)
    assert tables.differences(old, [entry("a: x", 2e-2, 0.1), entry("a: y", 0.0, 1e-9)])
    assert tables.differences(old, [entry("a: x", 1e-2, 0.1)]) == ["a: y: not in both"]


class Named:
    """A case with nothing but its name."""

    def __init__(self, name: str) -> None:
        self.name = name

    def checks(self) -> None:
        """What."""
