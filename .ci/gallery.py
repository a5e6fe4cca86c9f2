"""Gallery of the demos: pictures, and the cards in docs/gallery.md.

    python .ci/gallery.py                   # the cards anew, from pictures and times that are there
    python .ci/gallery.py --run latch_stop  # runs these scenes first; `--run all`: ten minutes
    python .ci/gallery.py --runs FOLDER     # pictures from runs that are there
    python .ci/gallery.py --check           # fails if the page has other cards

A card has a picture (`.ci/cards.py`), the first line of the demo, and the processor time of the
command with compiled loops. Demos that draw a figure of their own show that figure.
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

from cards import Look, banded, drawn

from shellmb.demos.verification.measuring import replaced
from shellmb.running.loader import demos, kinds

ROOT = Path(__file__).resolve().parents[1]
PAGE, PICTURES = ROOT / "docs" / "gallery.md", ROOT / "docs" / "gallery"
TIMES = PICTURES / "times.json"
BEGIN, END = "<!-- gallery: begin -->", "<!-- gallery: end -->"
# other commands than `shellmb run NAME`
COMMANDS = {
    "plate_modes": "modes plate_modes --count 8",
    "campbell": "modes campbell --rate 0,5,10,15,20",
}
# figures that a command or `demos/figures` has
DRAWN = {"campbell": "campbell.png"}
FIGURES = {
    "antenna": ROOT / "docs" / "antenna.png",
    "hinged_roof": ROOT / "demos" / "figures" / "hinged_roofs.png",
    "lateral_plate": ROOT / "demos" / "figures" / "lateral_plate.png",
}
# of motions: a state that shows most, and earlier ones
LOOKS = {
    "slider_crank": Look(0.354, 5),
    "four_bar": Look(ghosts=3),
    "heavy_top": Look(0.3, 5, camera=(25, -60)),
    "spin_up_beam": Look(9.0, 9),
    "satellite": Look(4.5, 3, camera=(20, -50)),
    "latch_stop": Look(ghosts=4),
    "latching_panel": Look(ghosts=4),
    "panel_hinge": Look(ghosts=4),
    "pid_arm": Look(ghosts=5),
    "robot_arm": Look(ghosts=5),
    "identify_joint": Look(ghosts=5),
    "critical_speed": Look(ghosts=5),
    "tumbling_plate": Look(ghosts=6),
    "short_cylinder": Look(2.5, 3),
    "flying_l_plate": Look(0.2, 4),
    "bouncing_plate": Look(ghosts=2, field="deformation", camera=(20, -40)),
    "tape_spring": Look(0.456, 3),
    "gripper": Look(camera=(20, -55), ghosts=2),
    "rolling_cart": Look(ghosts=1),
    "antenna_panels": Look(ghosts=3),
    "antenna_springs": Look(ghosts=3),
    "own_forms": Look(camera=(25, -50)),
    "lateral_buckling": Look(camera=(30, -35)),
    "wing_box": Look(camera=(25, -35)),
    "loaded_plate": Look(camera=(20, -55)),
    "plate_modes": Look(8.0, factor=0.1, camera=(35, -50)),
}
# the best first, within each kind
BEST = ("antenna", "snap_through", "satellite", "rolling_cart", "roll_up", "wing_box", "robot_arm")
FIRST = "examples of the paper"


def draw(name: str, directory: Path) -> None:
    """Draw the card of a demo from its run."""
    if name in DRAWN or name in FIGURES:
        made = drawn(FIGURES.get(name, directory / DRAWN.get(name, "")))
    else:
        made = banded(directory, LOOKS.get(name, Look()))
    made.save(PICTURES / f"{name}.png", optimize=True)


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
        draw(name, Path(folder) / "run")
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def card(name: str, what: str, seconds: float | None) -> str:
    """One card, as a directive of sphinx-design."""
    command = COMMANDS.get(name, f"run {name}")
    time = "" if seconds is None else f"{seconds:.2g} s · "
    return "\n".join(
        (
            f"```{{grid-item-card}} {name}",
            f":img-top: gallery/{name}.png",
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
    named: dict[str, list[str]] = {FIRST: []} | kinds()
    groups = {
        kind: [
            card(name, lines[name], times.get(name))
            for name in sorted(names, key=lambda n: BEST.index(n) if n in BEST else len(BEST))
            if (PICTURES / f"{name}.png").is_file()
        ]
        for kind, names in named.items()
    }
    return "\n\n".join(
        f"## {title[0].upper()}{title[1:]}\n\n````{{grid}} 1 2 2 2\n:gutter: 2\n\n"
        + "\n\n".join(made)
        + "\n````"
        for title, made in groups.items()
        if made
    )


def main() -> None:
    """Run what is asked for, and write or check the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--run", nargs="*", default=(), help="names of demos, or all")
    parser.add_argument("--runs", type=Path, help="draw from runs NAME in this folder")
    parser.add_argument("--check", action="store_true")
    asked = parser.parse_args()
    names = list(demos()) if asked.run == ["all"] else list(asked.run)
    if unknown := [name for name in names if name not in demos()]:
        sys.exit(f"there is no demo '{unknown[0]}'; give all, or some of {', '.join(demos())}")
    for name in demos() if asked.runs else ():
        if name in FIGURES or (asked.runs / name / "summary.json").is_file():
            draw(name, asked.runs / name)
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
