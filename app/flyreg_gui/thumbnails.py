"""Small pictures of templates, drawn beside the window and kept on disk."""

from __future__ import annotations

import contextlib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from PySide6.QtCore import QObject, Signal
from PySide6.QtGui import QImage

from flyreg_core.brain_files import open_brain, read_brain
from flyreg_core.cache import open_cache
from flyreg_core.errors import FlyregError
from flyreg_core.picture import draw_surface, view_of
from flyreg_core.templates import template_file
from flyreg_gui.theme import TARGET

SIZE = (176, 112)
SHARPNESS = 2
"""Pixels per pixel of the window, for screens with small ones."""
AXES = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]])
"""Templates grow to the right, downwards, and away from who looks at them, as image stacks do."""
VERTICES, PROBLEM = "vertices", "problem"
"""What is written into a picture's own texts."""


class Thumbnails(QObject):
    """Draws pictures of templates on a thread of its own, those on disk excepted."""

    drawn = Signal(str, QImage)  # label, picture; null if the template cannot be read

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        cache = open_cache()
        self._folder = None if cache is None else cache.folder / "thumbnails"
        self._executor = ThreadPoolExecutor(max_workers=1, thread_name_prefix="flyreg-thumbnails")

    def ask(self, label: str) -> None:
        """Have `drawn` tell the picture of a template, soon."""
        self._executor.submit(self._draw, label)

    def close(self) -> None:
        """Draw no more."""
        self._executor.shutdown(wait=True, cancel_futures=True)

    def _draw(self, label: str) -> None:  # on the thread
        place = self._place(label)
        image = QImage() if place is None else QImage(str(place))
        if image.isNull():
            image = drawn(label)
            if place is not None:
                with contextlib.suppress(OSError):
                    place.parent.mkdir(parents=True, exist_ok=True)
                    image.save(str(place))
        self.drawn.emit(label, image)

    def _place(self, label: str) -> Path | None:
        file = template_file(label)
        if file is None or self._folder is None:
            return None
        about = file.stat()
        return self._folder / f"{label}-{about.st_size}-{about.st_mtime_ns}.png"


def drawn(label: str) -> QImage:
    """Return the picture of a template, with its number of vertices among the picture's texts."""
    try:
        surface = read_brain(open_brain(label, None))
    except FlyregError as error:
        image = QImage(*SIZE, QImage.Format.Format_ARGB32)
        image.fill(0)
        image.setText(PROBLEM, str(error))
        return image
    width, height = size = (SHARPNESS * SIZE[0], SHARPNESS * SIZE[1])
    view = view_of(surface.vertices, AXES, size)
    pixels = np.ascontiguousarray(draw_surface(surface, TARGET, view, size))
    image = QImage(pixels.tobytes(), width, height, QImage.Format.Format_RGBA8888).copy()
    image.setText(VERTICES, str(len(surface.vertices)))
    return image
