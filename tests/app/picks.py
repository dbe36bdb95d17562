"""Clicks all over a view, and whether what they mean is what is drawn under them.

Run as a program it looks at one surface in a window of its own, at the screen's pixels per point:

    QT_SCALE_FACTOR=2 python -m tests.app.picks
"""

from __future__ import annotations

import sys
from collections.abc import Callable

import numpy as np
from flyreg_gui.main_window import MainWindow
from flyreg_gui.views.camera import ViewSpace
from flyreg_gui.views.canvas import Canvas
from flyreg_gui.views.flat_view import FlatView
from flyreg_gui.views.surface_layer import SurfaceLayer
from flyreg_gui.views.surface_view import SurfaceView
from PySide6.QtCore import QPointF
from PySide6.QtWidgets import QApplication, QMainWindow
from vtkmodules.vtkCommonDataModel import vtkDataObject
from vtkmodules.vtkRenderingCore import vtkHardwareSelector

from flyreg_core.frame import BrainFrame
from flyreg_core.mesh import SurfaceMesh
from tests import shapes

ROUNDING = 0.03
"""How far from where an edge is drawn, in pixels, exact geometry may have it."""


class DrawnFaces:
    """The face that the graphics hardware draws at each pixel of a view: another route than ours."""

    def __init__(self, canvas: Canvas, layer: SurfaceLayer) -> None:
        self._canvas = canvas
        others = [
            actor
            for actor in canvas.renderer.GetActors()
            if actor is not layer.actor and actor.GetVisibility()
        ]
        for actor in others:
            actor.VisibilityOff()
        canvas.set_samples(0)
        self._selector = vtkHardwareSelector()
        self._selector.SetRenderer(canvas.renderer)
        self._selector.SetFieldAssociation(vtkDataObject.FIELD_ASSOCIATION_CELLS)
        self.width, self.height = canvas.ren_win.GetSize()
        self._selector.SetArea(0, 0, self.width - 1, self.height - 1)
        was_pickable = layer.actor.GetPickable()
        layer.actor.PickableOn()
        assert self._selector.CaptureBuffers()
        layer.actor.SetPickable(was_pickable)
        for actor in others:
            actor.VisibilityOn()

    def at(self, x: int, y: int) -> int | None:
        """The face at a pixel of the screen, counted from the upper left."""
        row = self.height - 1 - y
        node = self._selector.GenerateSelection(x, row, x, row).GetNode(0)
        return None if node is None else int(node.GetSelectionList().GetValue(0))

    def position(self, x: int, y: int) -> QPointF:
        """Where the middle of a pixel of the screen is in the widget."""
        canvas = self._canvas
        return QPointF(
            (x + 0.5) / self.width * canvas.width(), (y + 0.5) / self.height * canvas.height()
        )


FaceAt = Callable[[QPointF], int | None]
"""The face that a click at a position in a view means."""


def mispicks(
    canvas: Canvas, layer: SurfaceLayer, face_at: FaceAt, count: int, seed: int
) -> list[str]:
    """What went wrong with so many clicks at random pixels where the surface is drawn."""
    rng, drawn, wrong, clicks = np.random.default_rng(seed), DrawnFaces(canvas, layer), [], 0
    while clicks < count:
        x, y = int(rng.integers(drawn.width)), int(rng.integers(drawn.height))
        face = drawn.at(x, y)
        if face is None:
            continue
        clicks += 1
        position = drawn.position(x, y)
        meant = face_at(position)
        if meant != face and not _is_at(face_at, face, position):
            wrong.append(f"{meant} for face {face} at {x}, {y}")
    return wrong


def _is_at(face_at: FaceAt, face: int, position: QPointF) -> bool:
    """Whether a face, perhaps a sliver, is met as near as single precision can tell."""
    around = np.array([[x, y] for x in (-1, 0, 1) for y in (-1, 0, 1)])
    steps = np.concatenate([ROUNDING / 3**k * around for k in range(5)])
    return any(face_at(position + QPointF(*step)) == face for step in steps)


def surface_mispicks(view: SurfaceView, count: int, seed: int) -> list[str]:
    """What went wrong with so many clicks on the surface in a view."""

    def face_at(position: QPointF) -> int | None:
        hit = view.hit_at(position)
        return None if hit is None else hit.place.face

    return mispicks(view.canvas, view.surface, face_at, count, seed)


def window_mispicks(window: MainWindow, name: str, count: int, seed: int) -> list[str]:
    """What went wrong with so many clicks in a view of the window, by what its cursor points at."""
    area, source = window.view_area, window.session.results.source
    view = getattr(area, name)
    is_flat = isinstance(view, FlatView)
    pieces = source.flat.dissection.piece_of_face
    number = np.zeros(len(source.surface.faces), dtype=int)  # in the half that a face belongs to
    for piece in range(int(pieces.max()) + 1):
        number[pieces == piece] = np.arange((pieces == piece).sum())

    def face_at(position: QPointF) -> int | None:
        place = area.pointer.at(view, position)
        if place is None:
            return None
        if view is area.target:
            return place.target.face
        return int(number[place.source.face]) if is_flat else place.source.face

    layer = view._source if is_flat else view.surface
    return mispicks(view.canvas, layer, face_at, count, seed)


def main() -> int:
    """Click a thousand times on a surface with a hole, from four sides."""
    app = QApplication(sys.argv[:1])
    window = QMainWindow()
    window.resize(420, 380)
    canvas = Canvas(window)
    window.setCentralWidget(canvas)
    window.show()
    view = SurfaceView(canvas)
    ring = shapes.torus(around=96, across=48)
    outwards, inwards = SurfaceMesh(*ring), SurfaceMesh(*shapes.inside_out(ring))
    frame = BrainFrame(np.zeros(3), np.eye(3))
    wrong = []
    for turn, mesh in enumerate((outwards, outwards, inwards, inwards)):  # as in mirrored files
        colors = np.full((len(mesh.vertices), 3), 200, np.uint8)
        view.show_surface(mesh, colors, ViewSpace.of(mesh, frame))
        canvas.renderer.GetActiveCamera().Azimuth(70)
        canvas.renderer.GetActiveCamera().Elevation(20)
        canvas.renderer.GetActiveCamera().OrthogonalizeViewUp()
        canvas.refresh()
        app.processEvents()
        wrong += surface_mispicks(view, 250, turn)
    ratio = canvas.devicePixelRatioF()
    canvas.end()
    window.close()
    sys.stdout.write(f"pixels per point {ratio:g}, mispicks {len(wrong)} {wrong[:3]}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
