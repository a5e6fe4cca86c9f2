"""Gallery of the demos: pictures, and the cards in docs/gallery.md.

    python .ci/gallery.py                   # the cards anew, from pictures and times that are there
    python .ci/gallery.py --run latch_stop  # runs these scenes first; `--run all`: ten minutes
    python .ci/gallery.py --check           # fails if the page has other cards

A card has the first state of a run's `shape.png`, the first line of the demo, and the processor
time of the command with cached kernels. The paper's examples and demos that draw a figure of their
own show that figure.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image, ImageChops

from shellmb.measuring.tables import replaced
from shellmb.observers.files.described import read_described
from shellmb.running.loader import demos, kinds
from shellmb.show.fields import Fields
from shellmb.show.pictures import shown_shape
from shellmb.show.space.scenery import images

ROOT = Path(__file__).resolve().parents[1]
PAGE, PICTURES = ROOT / "docs" / "gallery.md", ROOT / "docs" / "gallery"
TIMES = PICTURES / "times.json"
BEGIN, END = "<!-- gallery: begin -->", "<!-- gallery: end -->"
# width of a card, pixels
WIDTH = 420
PAPER = {"lateral_buckling": "6.1", "snap_through": "6.2", "antenna": "6.3"}
# figures that are there already, beside docs
FIGURES = {name: f"../demos/figures/{n}/animation.gif" for name, n in PAPER.items()} | {
    "antenna": "antenna.png",
    "hinged_roof": "../demos/figures/hinged_roofs.png",
    "lateral_plate": "../demos/figures/lateral_plate.png",
}
# other commands than `shellmb run NAME`, and other pictures than `shape.png`
COMMANDS = {
    "plate_modes": "modes plate_modes --count 8",
    "campbell": "modes campbell --rate 0,5,10,15,20",
}
DRAWN = {"campbell": "campbell.png", "plate_modes": "modes.png"}
FIRST = "examples of the paper"


def cropped(picture: Image.Image) -> Image.Image:
    """A picture without white around it, in the size of a card."""
    picture = picture.convert("RGB")
    box = ImageChops.difference(picture, Image.new("RGB", picture.size, "white")).getbbox()
    picture = picture.crop(box) if box else picture
    picture.thumbnail((WIDTH, WIDTH))
    card = Image.new("RGB", (WIDTH, round(0.75 * WIDTH)), "white")
    picture.thumbnail(card.size)
    card.paste(picture, ((card.width - picture.width) // 2, (card.height - picture.height) // 2))
    return card


def shape(directory: Path) -> Image.Image:
    """The first state of a run's `shape.png`, without caption, scale and axes."""
    described = read_described(directory)
    fields = Fields(directory / "fields", described.bodies, described.labels)
    return next(iter(images(shown_shape(fields, described), marks=False)))


def run(name: str) -> float:
    """Run a demo, keep its picture, and return the processor time in seconds."""
    with tempfile.TemporaryDirectory() as folder:
        words = COMMANDS.get(name, f"run {name}").split()
        shellmb = str(Path(sys.executable).parent / "shellmb")
        command = [shellmb, *words, "--out", f"{folder}/run", "--quiet"]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        environment = {**os.environ, "OMP_NUM_THREADS": "1"}
        subprocess.run(command, check=True, env=environment, cwd=folder, capture_output=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        if name not in FIGURES:
            made = Path(folder) / "run"
            drawn = Image.open(made / DRAWN[name]) if name in DRAWN else shape(made)
            cropped(drawn).quantize(64).save(PICTURES / f"{name}.png", optimize=True)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def card(name: str, what: str, seconds: float | None) -> str:
    """One card, as a directive of sphinx-design."""
    command = COMMANDS.get(name, f"run {name}")
    picture = FIGURES.get(name, f"gallery/{name}.png")
    time = "" if seconds is None else f"{seconds:.2g} s · "
    return "\n".join(
        (
            f"```{{grid-item-card}} {name}",
            f":img-top: {picture}",
            "",
            what,
            ":::{card-footer}",
            f"{time}`shellmb {command}` · [source](../demos/{name}.py)",
            ":::",
            "```",
        )
    )


def cards() -> str:
    """All cards, by kind, the paper's examples first."""
    times = json.loads(TIMES.read_text()) if TIMES.is_file() else {}
    lines = demos()
    groups = {
        kind: [
            card(name, lines[name], times.get(name))
            for name in names
            if name in FIGURES or (PICTURES / f"{name}.png").is_file()
        ]
        for kind, names in ({FIRST: []} | kinds()).items()
    }
    return "\n\n".join(
        f"## {title[0].upper()}{title[1:]}\n\n````{{grid}} 1 2 3 3\n:gutter: 2\n\n"
        + "\n\n".join(made)
        + "\n````"
        for title, made in groups.items()
        if made
    )


def main() -> None:
    """Run what is asked for, and write or check the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--run", nargs="*", default=(), help="names of demos, or all")
    parser.add_argument("--check", action="store_true")
    asked = parser.parse_args()
    names = list(demos()) if asked.run == ["all"] else list(asked.run)
    if unknown := [name for name in names if name not in demos()]:
        sys.exit(f"there is no demo '{unknown[0]}'; give all, or some of {', '.join(demos())}")
    failed = []
    for name in names:
        try:
            seconds = run(name)
        except subprocess.CalledProcessError as error:
            print(f"{name}: {error.stderr.decode()[-400:]}", file=sys.stderr)
            failed.append(name)
            continue
        times = json.loads(TIMES.read_text()) if TIMES.is_file() else {}
        times[name] = round(seconds, 1)
        TIMES.write_text(json.dumps(dict(sorted(times.items())), indent=1) + "\n")
        print(f"{name}: {seconds:.1f} s", flush=True)
    text = PAGE.read_text()
    page = replaced(text, BEGIN, END, cards())
    if asked.check:
        sys.exit(0 if page == text else "docs/gallery.md: run .ci/gallery.py")
    PAGE.write_text(page)
    if failed:
        sys.exit(f"failed: {', '.join(failed)}")


if __name__ == "__main__":
    main()
