"""Pictures of the first pages: docs/antenna.png, docs/first_scene.png, docs/first_history.png.

python .ci/still.py first          # states and history of README.md's scene
python .ci/still.py antenna        # half unfolded, membrane forces: a few minutes
python .ci/still.py antenna RUN    # the same from a run that is there
"""

from __future__ import annotations

import re
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

from cards import with_bar
from PIL import Image

import shellmb as sm
from shellmb.demos.antenna import scene
from shellmb.demos.paper.pictures import without_margins
from shellmb.show.pictures import shown_shape
from shellmb.show.space.scenery import Showing, images, showing

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
END, WIDTH, SHOWN = 40.0, 2000, 1000


def _drawn(what: Showing, width: int) -> Image.Image:
    """All states side by side, half as wide as they are drawn, with one bar below them."""
    parts = [p.convert("RGB") for p in without_margins(list(images(what, 2 * width, marks=False)))]
    gap = 40
    whole = Image.new(
        "RGB", (sum(p.width for p in parts) + gap * (len(parts) - 1), parts[0].height), "white"
    )
    left = 0
    for part in parts:
        whole.paste(part, (left, 0))
        left += part.width + gap
    height = round(whole.height * SHOWN / whole.width)
    return with_bar(whole.resize((SHOWN, height), Image.Resampling.LANCZOS), what)


def antenna(directory: str | None) -> None:
    """Half unfolded."""
    with tempfile.TemporaryDirectory() as folder:
        if directory is None:
            described = replace(scene(), output=sm.Output(frames=2, fields=("N",)), t_end=END)
            run = sm.run(described, f"{folder}/run", pictures=False)
        else:
            found = sm.load(directory)
            assert isinstance(found, sm.Run)
            run = found
        what = showing(run.fields, run.described, [END], "N", factor=1.0)
        picture = _drawn(replace(what, force=0.0, colours="plasma"), WIDTH)
    picture.save(DOCS / "antenna.png", optimize=True)


def first() -> None:
    """The scene of README.md."""
    (code,) = re.findall(r"^```python\n(.*?)^```$", (ROOT / "README.md").read_text(), re.M | re.S)
    with tempfile.TemporaryDirectory() as folder:
        # ten lines have no room for units
        space: dict[str, Any] = {}
        exec(code, space)
        run = sm.run(replace(space["scene"](), units="m, kg, s"), f"{folder}/run", pictures=False)
        _drawn(shown_shape(run.fields, run.described), 700).save(
            DOCS / "first_scene.png", optimize=True
        )
        figure = run.plot()
        figure.set_size_inches(7, 3)
        figure.savefig(DOCS / "first_history.png", dpi=130, bbox_inches="tight")


if __name__ == "__main__":
    if sys.argv[1:2] == ["antenna"]:
        antenna(sys.argv[2] if len(sys.argv) > 2 else None)
    else:
        first()
