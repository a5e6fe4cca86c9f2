"""A scene in space as a page that can be turned in a browser, without a server (trame-vtk)."""

from __future__ import annotations

import io
import json
import zipfile
from typing import Any

from shellmb.errors import RunError
from shellmb.show.space.display import offscreen, why_not
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
    reason = why_not()
    if reason is not None:
        raise RunError(reason)
    import pyvista as pv
    from trame_vtk.tools.vtksz2html import write_html

    with offscreen():
        plotter = pv.Plotter(off_screen=True, window_size=[640, 480])
        try:
            Stage(what, plotter, marks=False).set(what.states[0])
            plotter.render()
            data = _serialised(plotter.render_window, plotter.renderer)
        finally:
            plotter.close()
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("index.json", json.dumps(data))
    written = io.StringIO()
    write_html(packed.getvalue(), written)
    return written.getvalue()


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
