"""Tunnels as rings: as wide as the tunnel, across the way it runs, in front of everything."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pyvista as pv
from numpy.typing import NDArray
from PySide6.QtCore import QPointF
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

from flyreg_core.handles import Handle
from flyreg_core.mesh import Floats
from flyreg_gui.theme import OESOPHAGUS, OFF, TUNNEL, Color, Theme
from flyreg_gui.views.canvas import Canvas
from flyreg_gui.views.layers import RIM, DotLayer, LabelLayer, draw_in_front
from flyreg_gui.views.picking import MARKER_REACH

CORNERS = 40
LEAST_RADIUS = 0.008
"""Radius of the smallest ring, as a share of the brain's diagonal."""
WIDTH, HALO = 3.0, 3.0
"""Width of a ring, and how much wider the dark line below it is, pixels."""
AROUND = 1.6
"""How much larger than a tunnel the ring around it is that tells that it is chosen."""
MOST_LABELS = 9
"""Up to how many tunnels have labels unless they are candidates or chosen."""
DOT = 7.0
"""Size of the dot amid a ring, which shows where it is when it is seen from its edge, pixels."""


class RingLayer:
    """The tunnels of one brain."""

    def __init__(self, canvas: Canvas) -> None:
        self._canvas = canvas
        self._labels, self._dots = LabelLayer(canvas), DotLayer(canvas, DOT, HALO)
        self._actors = [vtkActor() for _ in range(3)]  # dark line, rings, around the chosen
        self._mappers = [vtkPolyDataMapper() for _ in self._actors]
        for actor, mapper in zip(self._actors, self._mappers, strict=True):
            actor.SetMapper(mapper)
            actor.PickableOff()
            actor.GetProperty().SetLighting(False)
            actor.VisibilityOff()
            draw_in_front(mapper)
            mapper.SetScalarModeToUseCellFieldData()
            mapper.SelectColorArray("color")
            mapper.SetColorModeToDirectScalars()
            canvas.renderer.AddActor(actor)
        self._selected: Color = (0, 0, 0)
        self._centers, self._radii = np.zeros((0, 3)), np.zeros(0)

    def show_theme(self, theme: Theme) -> None:
        """Take the colours of a theme."""
        self._selected = theme.selected
        scale = self._canvas.devicePixelRatioF()
        self._labels.set_style(theme.text, theme.background, scale)
        self._dots.set_scale(scale)
        for actor, width in zip(self._actors, (WIDTH + HALO, WIDTH, WIDTH), strict=True):
            actor.GetProperty().SetLineWidth(scale * width)

    def show(
        self, tunnels: Sequence[Handle], chosen: int | None, is_guess: bool, diagonal: float
    ) -> None:
        """Draw a ring and a label for each tunnel."""
        self._centers = np.array([t.center_um for t in tunnels]).reshape(-1, 3)
        widths = np.array([tunnel.width_um for tunnel in tunnels])
        self._radii = np.maximum(widths / 2, LEAST_RADIUS * diagonal)
        colors = np.array([color_of(t) for t in tunnels], dtype=np.uint8).reshape(-1, 3)
        corners = [
            _circle(center, np.array(tunnel.direction), radius)
            for tunnel, center, radius in zip(tunnels, self._centers, self._radii, strict=True)
        ]
        dark = np.full((len(tunnels), 3), RIM, dtype=np.uint8)
        self._draw(0, corners, dark)
        self._draw(1, corners, colors)
        self._dots.show(self._centers, colors)
        around = [] if chosen is None else [_wider(corners[chosen], self._centers[chosen])]
        self._draw(2, around, np.full((len(around), 3), self._selected, dtype=np.uint8))
        shown = [
            i
            for i, tunnel in enumerate(tunnels)
            if i == chosen or tunnel.is_candidate or tunnel.is_oesophagus or i < MOST_LABELS
        ]
        unsure = [is_guess and tunnels[i].is_oesophagus for i in shown]
        texts = [f"{i + 1} ?" if ask else f"{i + 1}" for i, ask in zip(shown, unsure, strict=True)]
        self._labels.show(self._centers[shown], texts)
        self._canvas.refresh()

    def at(self, position: QPointF) -> int | None:
        """Return the number of the tunnel at a position in the widget."""
        if not len(self._centers):
            return None
        pixels, _ = self._canvas.to_pixels(self._centers)
        away = np.hypot(pixels[:, 0] - position.x(), pixels[:, 1] - position.y())
        reach = np.maximum(self._radii / self._canvas.micrometres_per_pixel(), MARKER_REACH)
        nearest = int(np.argmin(away / reach))
        return nearest if away[nearest] <= reach[nearest] else None

    def _draw(self, number: int, corners: list[Floats], colors: NDArray[np.uint8]) -> None:
        self._actors[number].SetVisibility(bool(corners))
        if corners:
            ring = np.append(np.arange(CORNERS), 0)
            lines = [np.append(CORNERS + 1, CORNERS * i + ring) for i in range(len(corners))]
            data = pv.PolyData(
                np.concatenate(corners).astype(np.float32), lines=np.concatenate(lines)
            )
            data.cell_data["color"] = colors
            self._mappers[number].SetInputData(data)


def color_of(tunnel: Handle) -> Color:
    """Return the colour of a tunnel."""
    if tunnel.is_oesophagus:
        return OESOPHAGUS
    return TUNNEL if tunnel.is_candidate else OFF


def _wider(corners: Floats, center: Floats) -> Floats:
    return np.asarray(center + AROUND * (corners - center))


def _circle(center: Floats, normal: Floats, radius: float) -> Floats:
    across = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    across /= np.linalg.norm(across)
    upwards = np.cross(normal, across)
    angles = np.linspace(0, 2 * np.pi, CORNERS, endpoint=False)[:, None]
    return np.asarray(center + radius * (np.cos(angles) * across + np.sin(angles) * upwards))
