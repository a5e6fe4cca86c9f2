"""The table of stated and true errors in the documentation is what its records say."""

from tests.bench.errors.report import BEGIN, PAGE, RECORDS, kept, read, table
from tests.bench.errors.requests import ASKED, ask


def test_the_table_is_that_of_the_records() -> None:
    assert table(read(RECORDS)) in PAGE.read_text().partition(BEGIN)[2]


def test_errors_are_covered_as_promised() -> None:
    """95 % of true errors are at most the stated ones, at a median of at most 3."""
    found = read(RECORDS)
    assert kept(found)
    assert sum(len(case.rows) for case in found.values()) >= 40
    assert len(found) >= 30


def test_a_request_of_the_bench_is_met() -> None:
    scene, of = ASKED["bent rod"]
    found, alone = ask(scene, of, 1e-2)
    assert found["met"]
    assert found["levels"][-1]["error"] <= 1e-2 * found["size"]
    assert found["levels"][-1]["total"] > alone > 0
