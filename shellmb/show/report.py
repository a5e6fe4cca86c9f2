"""A run on one page: scene, pictures, energy balance, warnings; and short of that in a notebook."""

from __future__ import annotations

import base64
import html
import io
import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from shellmb.errors import RunError, SceneError
from shellmb.files.reading import read_bytes, read_json
from shellmb.files.writing import write_text
from shellmb.options.run import ACCURACY

if TYPE_CHECKING:
    from matplotlib.figure import Figure


STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; max-width: 64rem; margin: 2rem auto; padding: 0 1rem;
       color: #222 }
h1 { font-size: 1.5rem } h2 { font-size: 1.15rem; margin-top: 2rem }
table { border-collapse: collapse } td, th { padding: .15rem .8rem .15rem 0; text-align: left;
       vertical-align: top } td + td { font-variant-numeric: tabular-nums }
img { max-width: 100%; display: block; margin: .5rem 0 } iframe { width: 100%;
       aspect-ratio: 4 / 3; max-height: 32rem; border: 1px solid #ddd }
.warning { background: #fff4d6; padding: .5rem .8rem; border-left: 4px solid #e0a800;
       margin: .4rem 0 } .failed { background: #fde2e0; border-left-color: #c0392b }
.quiet { color: #666 } details > table { font-size: .85rem }
"""
# style of warnings in a notebook, whose own stays as it is
SCOPED = ".warning { background: #fff4d6; padding: .3rem .6rem; border-left: 4px solid #e0a800 }"
# a picture of a page has at most so many bytes
LARGEST = 100_000_000
# what is shown of the curves, in this order
CURVES = {
    "accuracy.png": "What accuracy costs",
    "path.png": "Static path",
    "probes.png": "Probes",
    "energy.png": "Energy balance",
    "joints.png": "Joints",
    "steps.png": "Steps",
}


# a run (`shellmb.api.record.Run`), and modes (`shellmb.api.modeshapes.ModeShapes`): rooms above
# this one have them
type Shown = Any
type ShownModes = Any


def card(run: Shown) -> str:
    """A run in a notebook: its picture beside the balance, and its warnings."""
    rows = f"<div>{_table(run.account.items())}</div>"
    flex = "display:flex;gap:1.5rem;align-items:center;flex-wrap:wrap"
    inner = f'<div style="{flex}">{_first_picture(run)}{rows}</div>'
    return _card(run, run.warnings, inner, f"<style>{SCOPED}</style>")


def _card(shown: object, warnings: Iterable[str], inner: str, style: str = "") -> str:
    title, said = html.escape(repr(shown)[1:-1]), "".join(map(_warning, warnings))
    return f"<div>{style}<p><b>{title}</b></p>{said}{inner}</div>"


def modes_card(modes: ShownModes) -> str:
    """Modes in a notebook: their picture and frequencies."""
    rows = _table((f"mode {k}", text) for k, text in enumerate(modes.captions, start=1))
    picture = _or_why(lambda: image_tag(_png(modes.picture()), "modes"))
    return _card(modes, modes.warnings, picture + rows)


def _or_why(made: Callable[[], str]) -> str:
    """A part of a page, or a sentence on why this machine cannot make it."""
    try:
        return made()
    except RunError as error:
        return f'<p class="quiet">{html.escape(str(error))}</p>'


def campbell_card(modes: Any, diagram: Figure) -> str:
    """Modes at several rates in a notebook: the verdict, and their Campbell diagram.

    Args:
        modes: The modes.
        diagram: Their diagram.
    """
    drawn = io.BytesIO()
    diagram.savefig(drawn, format="png", dpi=100)
    picture = image_tag(drawn.getvalue(), "Campbell diagram")
    return _card(modes, () if modes.stable else (modes.verdict,), picture)


def write_report(run: Shown, file: Path) -> Path:
    """Write the page.

    Args:
        run: The run.
        file: The page.
    """
    folder = run.directory
    drawn = {name: folder / name for name in ("shape.png", "animation.gif", *CURVES)}
    if not drawn["shape.png"].is_file() and len(run.fields):
        run.draw()
    described = run.described
    parts = [f"<h1>{html.escape(run.name)}</h1>", f"<p>{html.escape(repr(run)[1:-1])}</p>"]
    failed = run.summary.get("failed")
    if failed:
        parts.append(f'<p class="warning failed">{html.escape(failed)}</p>')
    parts += [_warning(w) for w in run.warnings] or ['<p class="quiet">No warnings.</p>']
    parts.append("<h2>Shape</h2>")
    parts += [_file_tag(drawn[n]) for n in ("shape.png", "animation.gif") if drawn[n].is_file()]
    parts.append(_turnable(run))
    results = run.summary.get("results") or {}
    if results:
        rows = ((name, value) for name, value in run.account.items() if name in results)
        parts.append(f"<h2>Results</h2>{_table(rows)}")
    rows = ((name, value) for name, value in run.account.items() if name not in results)
    parts.append(f"<h2>Energy balance and constraints</h2>{_table(rows)}")
    parts += _accuracy(folder / ACCURACY)
    for name, title in CURVES.items():
        if drawn[name].is_file():
            parts.append(f"<h2>{title}</h2>{_file_tag(drawn[name])}")
    parts.append("<h2>Scene</h2>")
    kinds = {"bodies": ", ".join(f"{n} ({k})" for n, k in described.bodies.items())}
    for key in ("joints", "drivers", "elements"):
        kinds[key] = ", ".join(getattr(described, key))
    kinds["units"] = described.units or "consistent, not named"
    parts.append(_table((k, v) for k, v in kinds.items() if v))
    parts += _details(folder)
    versions = run.summary.get("versions", {})
    said = ", ".join(f"{name} {number}" for name, number in versions.items())
    parts.append(f'<p class="quiet">{html.escape(said)}</p>')
    file.parent.mkdir(parents=True, exist_ok=True)
    write_text(
        file,
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{html.escape(run.name)}</title><style>{STYLE}</style></head><body>\n"
        + "\n".join(parts)
        + "\n</body></html>\n",
    )
    return file


def _accuracy(file: Path) -> list[str]:
    """Cost of an error, of a run to an accuracy."""
    if not file.is_file():
        return []
    found = read_json(file)
    rows = [offer["says"].partition(": ") for offer in found.get("offers", [])]
    said = html.escape(str(found.get("says", "")))
    table = _table((error, cost) for error, _, cost in rows)
    title = f"What accuracy costs ({found.get('quantity', '')}, processor time)"
    return [f"<h2>{html.escape(title)}</h2>{table}<p>{said}</p>"]


def _turnable(run: Shown) -> str:
    """The last state, to be turned in the browser."""
    if not len(run.fields.times):
        return ""
    from shellmb.show.space.scenery import showing
    from shellmb.show.space.web import framed

    what = showing(run.fields, run.described)
    return _or_why(lambda: framed(what))


def _details(folder: Path) -> list[str]:
    """Request and all fields of the scene, as far as the directory says."""
    found: list[str] = []
    for name, title in (("request.json", "As it was requested"), ("state/state.json", "In full")):
        file = folder / name
        if not file.is_file():
            continue
        values = read_json(file)
        values = values.get("scene", {}) if name.startswith("state") else values
        if not isinstance(values, dict):
            raise SceneError(f"{file} is damaged (it holds no scene)")
        shown = {k: v for k, v in values.items() if not k.endswith("sha256")}
        rows = _table((k, json.dumps(v)) for k, v in shown.items())
        found.append(f"<details><summary>{title}</summary>{rows}</details>")
    return found


def _first_picture(run: Shown) -> str:
    file = run.directory / "shape.png"
    if file.is_file():
        return _file_tag(file, "max-width:640px")
    if not len(run.fields.times):
        return ""
    return _or_why(lambda: image_tag(_png(run.picture()), "shape", "max-width:640px"))


def _file_tag(file: Path, style: str = "") -> str:
    kind = "gif" if file.suffix == ".gif" else "png"
    return image_tag(read_bytes(file, LARGEST), file.stem, style, kind)


def image_tag(content: bytes, name: str, style: str = "", kind: str = "png") -> str:
    """An image within a page.

    Args:
        content: Its file.
        name: What it shows.
        style: Its style.
        kind: "png" or "gif".
    """
    data = base64.b64encode(content).decode()
    return f'<img alt="{html.escape(name)}" style="{style}" src="data:image/{kind};base64,{data}">'


def _png(picture: Any) -> bytes:
    made = io.BytesIO()
    picture.save(made, "png")
    return made.getvalue()


def _warning(text: str) -> str:
    return f'<p class="warning">warning: {html.escape(text)}</p>'


def _table(rows: Iterable[tuple[str, str]]) -> str:
    cells = "".join(
        f"<tr><td>{html.escape(str(k))}</td><td>{html.escape(str(v))}</td></tr>" for k, v in rows
    )
    return f"<table>{cells}</table>"
