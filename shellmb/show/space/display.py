"""Check of whether and how this machine draws in space: off-screen, or in a window."""

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

from shellmb.errors import RunError

# what VTK is told to make windows of
KIND = "VTK_DEFAULT_OPENGL_WINDOW"
X11, MESA = "vtkXOpenGLRenderWindow", "vtkOSOpenGLRenderWindow"


@cache
def window_kind() -> str | None:
    """The kind of window that VTK draws into here; None: there is none.

    It tries a display, EGL with a driver, and at last OSMesa, whether that is there or not: without
    it, it would end the process.
    """
    from vtkmodules.vtkCommonCore import vtkLogger
    from vtkmodules.vtkRenderingOpenGL2 import vtkOpenGLRenderWindow

    said = vtkLogger.GetCurrentVerbosityCutoff()
    # what it does without is nothing to warn of
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    found: str = vtkOpenGLRenderWindow().GetClassName()
    vtkLogger.SetStderrVerbosity(said)
    if found == MESA:
        try:
            ctypes.CDLL("libOSMesa.so.8")
        except OSError:
            return None
    # it is not asked, and warned of, once more
    os.environ.setdefault(KIND, found)
    return found


def has_display() -> bool:
    """Decide whether a window can be opened."""
    return sys.platform != "linux" or window_kind() == X11


def why_not() -> str | None:
    """Say why pictures in space cannot be drawn here; None: they can."""
    if window_kind() is not None:
        return None
    return (
        "this machine cannot draw in 3-D: VTK needs EGL with a driver (packages libegl1 "
        "and libgl1-mesa-dri), OSMesa (libosmesa6), or a display"
    )


@contextmanager
def canvas(width: int, height: int) -> Iterator[Any]:
    """A Plotter of pyvista's that needs no display.

    Args:
        width: Its width, pixels.
        height: Its height.

    Raises:
        RunError: If this machine cannot draw.
    """
    reason = why_not()
    if reason is not None:
        raise RunError(reason)
    import pyvista as pv

    plotter = pv.Plotter(off_screen=True, window_size=[width, height])
    try:
        yield plotter
    finally:
        plotter.close()
