"""What all measurements share: turns, typical times, JSON, tables."""

import json
import math
import time
from dataclasses import dataclass
from operator import itemgetter

import pytest
from rich.console import Console

from shellmb.accuracy.measuring import Column, print_table, spread, to_json, unbeaten, write
from shellmb.clock import now
from shellmb.demos.effects.stepping import in_turn, measured_in, shares
from shellmb.demos.verification.measuring import markdown, replaced, verdict


def test_every_other_round_goes_backwards():
    done = []
    works = [lambda name=name: done.append(name) or name.upper() for name in "abc"]
    assert in_turn(3, works) == [("A", "B", "C")] * 3
    assert "".join(done) == "abccbaabc"


def test_shares_are_of_rounds() -> None:
    """A round in which the machine did something else changes neither of the two."""
    pairs = [(2.0, 1.0), (4.0, 1.0), (1.0, 1.0), (8.0, 4.0), (1.0, 9.0)]
    assert shares(pairs) == (0.5, 0.5)
    assert shares(pairs[:1]) == (0.5, 0.0)


def test_the_clock_is_set_back():
    with pytest.raises(ZeroDivisionError), measured_in("cpu"):
        assert abs(now() - time.process_time()) < 1.0
        1 / 0  # noqa: B018
    assert abs(now() - time.perf_counter()) < 1.0


def test_spread():
    assert spread([4.0, 1.0, 2.0], 2.0) == 1.5
    # a clock may not have moved
    assert spread([0.0, 0.0], 0.0) == 0.0


def test_unbeaten_in_time_and_error():
    fast, slow, worse, failed = (1.0, 0.2), (3.0, 0.1), (2.0, 0.2), (0.5, math.inf)
    found = unbeaten([slow, worse, failed, fast], lambda p: p[0], lambda p: p[1])
    assert found == [fast, slow]


@dataclass(frozen=True)
class Part:
    """Says itself what is kept of it."""

    size: int

    def to_dict(self):
        return {"twice": 2 * self.size}


@dataclass(frozen=True)
class Made:
    """Made up."""

    passed: bool
    error: float
    parts: tuple[Part, ...]


def test_json_of_dataclasses(tmp_path):
    text = to_json([Made(True, math.inf, (Part(2),))], passed="pass")
    found = [{"pass": True, "error": None, "parts": [{"twice": 4}]}]
    assert json.loads(text) == found
    drawn = []
    write("some", text, drawn.append, tmp_path / "new")
    assert json.loads((tmp_path / "new" / "some.json").read_text()) == found
    assert drawn == [tmp_path / "new" / "some.png"]


COLUMNS = (
    Column("what", lambda row: row[0], "words"),
    Column("time [ms]", lambda row: f"{row[1]:.1f}"),
    Column("", lambda row: verdict(row[1] < 5), "words"),
)


def test_tables_from_columns(capsys):
    rows = [("[bold]a", 1.0), ("b", 10.0)]
    print_table(Console(width=60), COLUMNS, rows)
    lines = [line.rstrip() for line in capsys.readouterr().out.splitlines()]
    # what looks like markup is text; numbers stand to the right
    assert lines == ["what     time [ms]", "[bold]a        1.0  pass", "b             10.0  FAIL"]
    assert markdown(COLUMNS, rows)[1:] == [
        "| --- | --- | --- |",
        "| [bold]a | 1.0 | pass |",
        "| b | 10.0 | FAIL |",
    ]


def test_a_page_gets_what_was_made():
    assert replaced("a <b> old <e> c", "<b>", "<e>", "new") == "a <b>\nnew\n<e> c"
    with pytest.raises(ValueError, match="no lines '<b>' and '<e>'"):
        replaced("a <b> old", "<b>", "<e>", "new")


@pytest.mark.parametrize("width", [20, 40, 80, 200])
def test_no_number_is_cut(width, capsys):
    """Kind: a column too narrow for its number shows 2.83666... of 2.83666e-05."""
    columns = (
        Column("name", itemgetter(0), "words"),
        Column("value", itemgetter(1)),
        Column("why", itemgetter(2), "folded"),
    )
    rows = [("deflection of the corner, largest over time", "2.83666e-05", "one word " * 20)] * 3
    print_table(Console(width=width), columns, rows)
    printed = capsys.readouterr().out
    assert printed.count("2.83666e-05") == 3
    assert printed.count("largest over time") == 3
    assert printed.count("word") == 60
