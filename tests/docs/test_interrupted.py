"""A build of the documentation that was stopped is not continued: its pages would be missing."""

import runpy
from pathlib import Path
from types import SimpleNamespace

CONF = Path(__file__).parents[2] / "docs" / "conf.py"


def test_a_stopped_build_starts_anew(tmp_path: Path) -> None:
    conf = runpy.run_path(str(CONF))
    begin, end = conf["_begin"], conf["_end"]
    app = SimpleNamespace(outdir=tmp_path / "html", doctreedir=tmp_path / "trees")
    read = tmp_path / "trees" / "environment.pickle"
    read.parent.mkdir()
    read.touch()
    # after a whole build what was read is used again
    begin(app)
    end(app, None)
    begin(app)
    assert read.exists()
    # that one was stopped, or failed
    end(app, RuntimeError())
    begin(app)
    assert not read.exists()
    end(app, None)
    assert not (tmp_path / "html" / ".unfinished").exists()
