"""What the machine draws with."""

from __future__ import annotations

from functools import cache

from PySide6.QtGui import QOffscreenSurface, QOpenGLContext

GL_RENDERER = 0x1F01
SOFTWARE_RENDERERS = ("llvmpipe", "softpipe", "swrast", "software", "gdi generic")
SMOOTH, FAST = 4, 0
"""Samples per pixel; on a processor each sample costs as much as the picture itself."""
PRINT = 8


@cache
def samples_per_pixel() -> int:
    """Return how many samples per pixel the machine can afford while the user waits."""
    context, surface = QOpenGLContext(), QOffscreenSurface()
    if not context.create():
        return FAST
    surface.setFormat(context.format())
    surface.create()
    if not context.makeCurrent(surface):
        return FAST
    name = str(context.functions().glGetString(GL_RENDERER)).lower()
    context.doneCurrent()
    return FAST if any(word in name for word in SOFTWARE_RENDERERS) else SMOOTH
