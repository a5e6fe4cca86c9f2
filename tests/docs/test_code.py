"""What the documentation shows runs: every Python block, and the first steps of every scene."""

import inspect
import re
import types
from pathlib import Path
from typing import Any

import pytest

import shellmb.scene
from shellmb.running.execute import execute

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


def test_every_class_of_scenes_has_an_example() -> None:
    """In the reference, a how-to or a tutorial; what only others derive from needs none."""
    shown = "\n".join(
        code
        for page in PAGES
        if "_build" not in page.parts
        for code in re.findall(
            r"^```(?:python|\{code-cell\})\n(.*?)^```$", page.read_text(), re.DOTALL | re.MULTILINE
        )
    )
    classes = [n for n in shellmb.scene.__all__ if inspect.isclass(getattr(shellmb.scene, n))]
    bases = {b.__name__ for n in classes for b in getattr(shellmb.scene, n).__mro__[1:]}
    missing = [n for n in classes if n not in bases and not re.search(rf"\b{n}\b", shown)]
    assert not missing
