"""Pictures of surfaces without a window: triangles drawn by a program, the same everywhere.

A `View` says from where and how large; `draw_surface` and `draw_flat` return pictures of
(height, width, 4) bytes, red, green, blue and opacity, transparent where nothing is; `on_background`
and `png_bytes` make of them what files hold.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numba import njit
from numpy.typing import NDArray
from PIL import Image

from flyreg_core.color_maps import Color, Colors
from flyreg_core.frame import BrainFrame
from flyreg_core.mesh import Floats, Integers, SurfaceMesh

Picture = NDArray[np.uint8]
Side = Literal["front", "back", "top"]
SIDES: tuple[Side, ...] = ("front", "back", "top")

MARGIN = 1.06
"""How much more than what is drawn a picture shows."""
SAMPLES = 2
"""Edges are smoothed by this many samples per pixel each way."""
AMBIENT = 0.32
"""Brightness of what no light reaches."""
LIGHT = (-0.30, 0.45, 0.84)
"""Where the light comes from: towards the picture's right, its top and the viewer."""
CRACK = 1e-9
"""Share of a triangle by which it reaches over its edges, lest rounding leave cracks between two."""
WHITE: Color = (255, 255, 255)


@dataclass(frozen=True, eq=False)
class View:
    """From where surfaces are seen, without perspective."""

    axes: Floats  # (3, 3), rows point to the picture's right, its top, and the viewer
    middle: Floats  # (3,), what lies in the middle of the picture, micrometres
    um_per_pixel: float

    def pixels(self, points: Floats, size: tuple[int, int]) -> Floats:
        """Return (n, 2) pixels, from the upper left corner, of (n, 3) points in a picture."""
        return _placed(points, self, size, 1)[:, :2]


def axes_of(frame: BrainFrame, side: Side) -> Floats:
    """Return the axes of the view on one side of a brain.

    From the front the fly looks at the viewer, dorsal is up. From the back dorsal is up too. From
    the top the front is below, as if the brain had been tilted forward from the first view.
    """
    towards, up = {
        "front": (frame.anterior, frame.dorsal),
        "back": (-frame.anterior, frame.dorsal),
        "top": (frame.dorsal, -frame.anterior),
    }[side]
    return np.stack([np.cross(up, towards), up, towards])


def view_of(points: Floats, axes: Floats, size: tuple[int, int]) -> View:
    """Return the view that shows all of (n, 3) points in a picture of (width, height) pixels."""
    along = points @ axes.T
    low, high = along.min(axis=0), along.max(axis=0)
    across, up = (high - low)[:2]
    scale = MARGIN * max(across / size[0], up / size[1], np.finfo(float).tiny)
    return View(axes, (low + high) / 2 @ axes, float(scale))


def views_of(
    points: Floats, frame: BrainFrame, size: tuple[int, int], sides: Sequence[Side] = SIDES
) -> dict[Side, View]:
    """Return views on several sides of (n, 3) points, all at the scale at which each fits."""
    views = {side: view_of(points, axes_of(frame, side), size) for side in sides}
    scale = max(view.um_per_pixel for view in views.values())
    return {side: replace(view, um_per_pixel=scale) for side, view in views.items()}


def draw_surface(
    surface: SurfaceMesh,
    colors: Colors | Color,
    view: View,
    size: tuple[int, int],
    samples: int = SAMPLES,
    ambient: float = AMBIENT,
) -> Picture:
    """Return the picture of a surface, lit from behind the viewer, somewhat from the upper left.

    Parameters
    ----------
    colors : (n, 3) uint8, or one colour
        Of the vertices; between them they run straight.
    size : (int, int)
        Width and height, pixels.
    samples : int
        Per pixel and direction: 1 is fast, 2 smooths edges.
    ambient : float
        Brightness of what no light reaches, 0 to 1. Colours that must be read off want more of it.

    Returns
    -------
    (height, width, 4) uint8
        Opacity last, 0 where nothing is.
    """
    placed = _placed(surface.vertices, view, size, samples)
    normals = surface.vertex_normals @ view.axes.T
    canvas = _canvas(size, samples)
    painted = _painted(colors, len(placed))
    light = np.array(LIGHT) / np.linalg.norm(LIGHT)
    _draw(placed, surface.faces, painted, normals, light, ambient, *canvas)
    return _finished(canvas[0], samples)


def draw_flat(
    plane: Floats,
    faces: Integers,
    colors: Colors | Color,
    extent: tuple[float, float],
    size: tuple[int, int],
    samples: int = SAMPLES,
) -> Picture:
    """Return the picture of (m, 3) triangles in the plane, unlit; see `draw_surface`.

    Parameters
    ----------
    plane : (n, 2) float
        Places of the vertices, y up; 0 lies in the middle of the picture.
    extent : (float, float)
        Width and height of what the picture must show.
    """
    scale = MARGIN * max(extent[0] / size[0], extent[1] / size[1])
    points = np.column_stack([plane, np.zeros(len(plane))])
    placed = _placed(points, View(np.eye(3), np.zeros(3), scale), size, samples)
    canvas = _canvas(size, samples)
    straight = np.tile([0.0, 0.0, 1.0], (len(plane), 1))
    painted = _painted(colors, len(plane))
    _draw(placed, faces, painted, straight, np.array([0.0, 0.0, 1.0]), 1.0, *canvas)
    return _finished(canvas[0], samples)


def blended(pictures: Sequence[Picture], shares: Sequence[float]) -> Picture:
    """Return pictures of one size laid over each other, each counting by its share."""
    total = np.zeros((*pictures[0].shape[:2], 4))
    opacity = np.zeros((*pictures[0].shape[:2], 1))
    for picture, share in zip(pictures, shares, strict=True):
        own = picture[..., 3:] / 255
        total[..., :3] += share * own * picture[..., :3]
        total[..., 3:] += share * own
        opacity = np.maximum(opacity, own)
    total[..., :3] /= np.maximum(total[..., 3:], 1e-9)
    total[..., 3:] = 255 * opacity
    return np.asarray(np.round(total), dtype=np.uint8)


def on_background(picture: Picture, color: Color = WHITE) -> Picture:
    """Return a picture of (height, width, 3) bytes with a colour where it was transparent."""
    opacity = picture[..., 3:] / 255
    mixed = opacity * picture[..., :3] + (1 - opacity) * np.array(color)
    return np.asarray(np.round(mixed), dtype=np.uint8)


def png_bytes(picture: Picture) -> bytes:
    """Return the PNG file of a picture of (height, width, 3 or 4) bytes."""
    content = io.BytesIO()
    Image.fromarray(picture).save(content, "PNG")
    return content.getvalue()


def _placed(points: Floats, view: View, size: tuple[int, int], samples: int) -> Floats:
    """Return (n, 3) samples across and down from the upper left corner, and towards the viewer."""
    along = (points - view.middle) @ view.axes.T / view.um_per_pixel
    along[:, 0] += size[0] / 2
    along[:, 1] = size[1] / 2 - along[:, 1]
    return np.asarray(along * samples)


def _canvas(size: tuple[int, int], samples: int) -> tuple[Floats, Floats]:
    """Return a canvas of colours with opacity, and how near each of its samples is."""
    shape = size[1] * samples, size[0] * samples
    return np.zeros((*shape, 4)), np.full(shape, -np.inf)


def _painted(colors: Colors | Color, count: int) -> Floats:
    return np.array(np.broadcast_to(np.asarray(colors, dtype=float), (count, 3)))


def _finished(canvas: Floats, samples: int) -> Picture:
    """Return the canvas with each pixel the mean of its samples."""
    height, width = canvas.shape[0] // samples, canvas.shape[1] // samples
    pixels = canvas.reshape(height, samples, width, samples, 4).mean(axis=(1, 3))
    pixels[..., :3] /= np.maximum(pixels[..., 3:], 1e-9)  # the colour of what is covered
    pixels[..., 3] *= 255
    return np.asarray(np.round(np.clip(pixels, 0, 255)), dtype=np.uint8)


@njit(nogil=True, cache=True)
def _draw(
    placed: Floats,
    faces: Integers,
    colors: Floats,
    normals: Floats,
    light: Floats,
    ambient: float,
    canvas: Floats,
    nearness: Floats,
) -> None:
    """Draw triangles into a canvas where nothing nearer is, lit from both sides of a face.

    A sample belongs to a triangle if its middle does; normals are those of the vertices in between,
    turned to the viewer if the face shows its back.
    """
    height, width = nearness.shape
    for number in range(len(faces)):
        a, b, c = faces[number]
        ax, ay, bx, by = placed[a, 0], placed[a, 1], placed[b, 0], placed[b, 1]
        cx, cy = placed[c, 0], placed[c, 1]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0:
            continue
        facing = -1.0 if area > 0 else 1.0  # pictures count downwards
        left, right = max(int(min(ax, bx, cx)), 0), min(int(max(ax, bx, cx)) + 1, width)
        top, bottom = max(int(min(ay, by, cy)), 0), min(int(max(ay, by, cy)) + 1, height)
        for row in range(top, bottom):
            y = row + 0.5
            for column in range(left, right):
                x = column + 0.5
                u = ((bx - x) * (cy - y) - (by - y) * (cx - x)) / area
                v = ((cx - x) * (ay - y) - (cy - y) * (ax - x)) / area
                w = 1.0 - u - v
                if u < -CRACK or v < -CRACK or w < -CRACK:
                    continue
                near = u * placed[a, 2] + v * placed[b, 2] + w * placed[c, 2]
                if near <= nearness[row, column]:
                    continue
                nearness[row, column] = near
                shine, length = 0.0, 0.0
                for i in range(3):
                    along = u * normals[a, i] + v * normals[b, i] + w * normals[c, i]
                    shine += along * light[i]
                    length += along * along
                lit = max(facing * shine / np.sqrt(length), 0.0) if length > 0 else 0.0
                brightness = ambient + (1.0 - ambient) * lit
                for i in range(3):
                    color = u * colors[a, i] + v * colors[b, i] + w * colors[c, i]
                    canvas[row, column, i] = brightness * color
                canvas[row, column, 3] = 1.0
