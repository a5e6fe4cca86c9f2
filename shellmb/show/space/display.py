"""Check of whether and how this machine draws in space: off-screen, or in a window."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

from shellmb.errors import RunError

# how VTK is told which kind of window to make
KIND = "VTK_DEFAULT_OPENGL_WINDOW"
EGL, X11, MESA = "vtkEGLRenderWindow", "vtkXOpenGLRenderWindow", "vtkOSOpenGLRenderWindow"


@cache
def offscreen_kind() -> str | None:
    """The kind of window that can be drawn into without a display; None: there is none.

    VTK would try them in turn, warn of each, and end the process where none works; so each is asked
    for by itself first.
    """
    if sys.platform != "linux":
        return ""
    if _egl_devices():
        return EGL
    if os.environ.get("DISPLAY") and _x_display():
        return X11
    try:
        ctypes.CDLL("libOSMesa.so.8")
    except OSError:
        return None
    return MESA


def has_display() -> bool:
    """Decide whether a window can be opened."""
    return sys.platform != "linux" or bool(os.environ.get("DISPLAY") and _x_display())


def why_not() -> str | None:
    """Say why pictures in space cannot be drawn here; None: they can."""
    if os.environ.get(KIND) or offscreen_kind() is not None:
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

    before = os.environ.get(KIND)
    if before is None and offscreen_kind():
        os.environ[KIND] = str(offscreen_kind())
    try:
        plotter = pv.Plotter(off_screen=True, window_size=[width, height])
        try:
            yield plotter
        finally:
            plotter.close()
    finally:
        if before is None:
            os.environ.pop(KIND, None)


def _egl_devices() -> bool:
    """Decide whether EGL has a device that can be used; also a processor is one."""
    from vtkmodules.vtkCommonCore import vtkLogger
    from vtkmodules.vtkRenderingOpenGL2 import vtkOpenGLRenderWindow

    said = vtkLogger.GetCurrentVerbosityCutoff()
    # that there is none is nothing to warn of
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    # where EGL has none, or one without a driver, VTK makes a window of another kind
    os.environ[KIND] = EGL
    found: bool = vtkOpenGLRenderWindow().GetClassName() == EGL
    del os.environ[KIND]
    vtkLogger.SetStderrVerbosity(said)
    return found


def _x_display() -> bool:
    """Decide whether the X server that DISPLAY names answers."""
    try:
        x11 = ctypes.CDLL("libX11.so.6")
    except OSError:
        return False
    x11.XOpenDisplay.restype = ctypes.c_void_p
    x11.XCloseDisplay.argtypes = [ctypes.c_void_p]
    found = x11.XOpenDisplay(None)
    if found:
        x11.XCloseDisplay(found)
    return bool(found)
