"""What the documentation shows runs: every Python block, and the first steps of every scene."""

import re
import types
from pathlib import Path
from typing import Any

import pytest

from shellmb.run.execute import execute

ROOT = Path(__file__).parents[2]
BLOCK = re.compile(r"^```python\n(.*?)^```$", re.DOTALL | re.MULTILINE)
# tutorials are executed when the documentation is built
PAGES = [ROOT / "README.md", *sorted(ROOT.glob("docs/**/*.md"))]
BLOCKS = [
    pytest.param(code, id=f"{page.relative_to(ROOT)}-{k}")
    for page in PAGES
    if not {"_build", "tutorials"} & set(page.parts)
    for k, code in enumerate(BLOCK.findall(page.read_text()))
]
STEPS = 2


@pytest.mark.parametrize("code", BLOCKS)
def test_it_runs(code: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    module: Any = types.ModuleType("shown")
    exec(code, module.__dict__)
    if not callable(getattr(module, "scene", None)):
        return
    scene = module.scene()
    if not scene.static:
        scene = scene.with_options(t_end=STEPS * scene.dt)
    result = execute(scene)
    assert result.summary["failed"] is None
