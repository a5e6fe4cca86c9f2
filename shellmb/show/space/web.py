"""A scene in space as a page that can be turned in a browser, without a server (trame-vtk)."""

import html
import io
import json
import zipfile
from typing import Any

from shellmb.show.space.display import canvas
from shellmb.show.space.scenery import Showing, Stage


def page(what: Showing) -> str:
    """The first state as a page that needs no other file.

    The data are what pyvista's own export gives trame's viewer; it starts a server to make them,
    which is not needed.

    Args:
        what: What is shown.

    Raises:
        RunError: If this machine cannot draw.
    """
    from trame_vtk.tools.vtksz2html import write_html

    with canvas(640, 480) as plotter:
        Stage(what, plotter, marks=False).set(what.states[0])
        plotter.render()
        data = _serialised(plotter.render_window, plotter.renderer)
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("index.json", json.dumps(data))
    written = io.StringIO()
    write_html(packed.getvalue(), written)
    return written.getvalue()


def framed(what: Showing, style: str = "") -> str:
    """The first state as a part of a page, with a line that says what is shown.

    Args:
        what: What is shown.
        style: CSS of the view.

    Raises:
        RunError: If this machine cannot draw.
    """
    inner = html.escape(page(what), quote=True)
    low, high = what.limits
    said = f"{what.title(what.states[0])}; colours: {what.shown.label}, {low:.4g} to {high:.4g}"
    return (
        f'<iframe title="shape" loading="lazy" style="{style}" srcdoc="{inner}"></iframe>'
        f'<p class="quiet">Turn it with the mouse. {html.escape(said)}</p>'
    )


class Cell:
    """A view that a notebook displays.

    Args:
        text: Its HTML.
    """

    def __init__(self, text: str) -> None:
        self._text = text

    def _repr_html_(self) -> str:
        return self._text

    def __repr__(self) -> str:
        return "<view of a shape>"


def in_cell(what: Showing) -> Cell:
    """The first state for a cell of a notebook."""
    return Cell(framed(what, "width: 100%; height: 28rem; border: 1px solid #ddd"))


def _serialised(window: Any, renderer: Any) -> dict[str, Any]:
    """Scene and arrays as trame's viewer reads them."""
    from trame_vtk.modules.vtk import serializers as s

    s.initialize_serializers()
    s.configure_serializer(encode_lut=True, skip_light=True)
    context = s.SynchronizationContext()
    context.set_ignore_last_dependencies(True)
    scene = s.serialize(None, window, s.reference_id(window), context, 1)
    camera = renderer.GetActiveCamera()
    scene["extra"] = {
        "vtkRefId": s.reference_id(window),
        "centerOfRotation": camera.GetFocalPoint(),
        "camera": s.reference_id(camera),
    }
    arrays = {}
    for entry in s.extract_array_hash(scene):
        key = entry["hash"]
        arrays[key] = {**entry, "content": context.get_cached_data_array(key, False)}
    return {"hashes": arrays, "scene": scene}
