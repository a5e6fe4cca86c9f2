"""The antenna half unfolded, membrane forces in colour: docs/antenna.png.

python .ci/still.py         # runs the antenna to 40 s: a few minutes
"""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

from PIL import Image

import shellmb as sm
from demos.paper.pictures import without_margins
from shellmb.demos.antenna import scene
from shellmb.show.space.scenery import images, showing

FILE = Path(__file__).resolve().parents[1] / "docs" / "antenna.png"
END, WIDTH, SHOWN = 40.0, 2400, 1000


def main() -> None:
    """Run, draw at more than twice the size, and make it smaller."""
    with tempfile.TemporaryDirectory() as folder:
        described = replace(scene(), output=sm.Output(frames=2, fields=("N",)), t_end=END)
        run = sm.run(described, f"{folder}/run", pictures=False)
        what = showing(run.fields, run.described, [END], "N", factor=1.0)
        (drawn,) = without_margins(
            list(images(replace(what, force=0.0, colours="plasma"), WIDTH, marks=False))
        )
    size = (SHOWN, round(drawn.height * SHOWN / drawn.width))
    small = drawn.convert("RGB").resize(size, Image.Resampling.LANCZOS)
    small.save(FILE, optimize=True)
    print(FILE, FILE.stat().st_size)


if __name__ == "__main__":
    main()
