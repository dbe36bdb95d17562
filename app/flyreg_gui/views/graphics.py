"""What the machine draws with."""

from __future__ import annotations

from functools import cache

from PySide6.QtGui import QGuiApplication, QOffscreenSurface, QOpenGLContext

GL_RENDERER = 0x1F01
SOFTWARE_RENDERERS = ("llvmpipe", "softpipe", "swrast", "software", "gdi generic")
SMOOTH, FAST = 4, 0
"""Samples per pixel; on a processor each sample costs as much as the picture itself."""
PRINT = 8


@cache
def draws_on_processor() -> bool:
    """Tell whether there is no graphics card to draw with."""
    context, surface = QOpenGLContext(), QOffscreenSurface()
    if not context.create():
        return True
    surface.setFormat(context.format())
    surface.create()
    if not context.makeCurrent(surface):
        return True
    name = str(context.functions().glGetString(GL_RENDERER)).lower()
    context.doneCurrent()
    return any(word in name for word in SOFTWARE_RENDERERS)


def samples_per_pixel() -> int:
    """Return how many samples per pixel the machine can afford while the user waits."""
    return FAST if draws_on_processor() else SMOOTH


def is_put_together_alone() -> bool:
    """Tell whether what draws should be a window to the system, inside the program's.

    A processor takes 13 ms to put a whole window together, for one letter of a label too; what is a
    window of its own is put together by itself. A graphics card does either at once. Known to work
    on X11 only.
    """
    return draws_on_processor() and QGuiApplication.platformName() == "xcb"
