"""Pictures of surfaces without a window: triangles drawn by a program, the same everywhere.

A `View` says from where and how large; `draw_surface` and `draw_flat` return pictures of
(height, width, 4) bytes, red, green, blue and opacity, transparent where nothing is; `on_background`
and `png_bytes` make of them what files hold.
"""

from __future__ import annotations

import io
import math
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
REACH = 1e-6
"""The same in samples, no less than `CRACK` for a triangle as large as a picture."""
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


@dataclass(frozen=True, eq=False)
class Seen:
    """A surface in a picture, without colours yet: which face each sample shows."""

    placed: Floats  # (n, 3), vertices; see `_placed`
    faces: Integers  # (m, 3)
    normals: Floats  # (n, 3)
    light: Floats  # (3,), towards it, in the frame of the normals
    shown: NDArray[np.int32]  # (height, width) in samples, -1: none
    samples: int

    def painted(self, colors: Colors | Color, ambient: float = AMBIENT) -> Picture:
        """Return the picture in colours; see `draw_surface`."""
        height, width = (length // self.samples for length in self.shown.shape)
        picture = np.zeros((height, width, 4), dtype=np.uint8)
        painted = _painted(colors, len(self.placed))
        shape = self.placed, self.faces, self.normals, self.light, self.shown
        _shade(*shape, painted, ambient, self.samples, picture)
        return picture


def see_surface(
    surface: SurfaceMesh, view: View, size: tuple[int, int], samples: int = SAMPLES
) -> Seen:
    """Return what a picture of a surface shows, to be painted as often as there are colours."""
    light = np.array(LIGHT) / np.linalg.norm(LIGHT) @ view.axes
    placed = _placed(surface.vertices, view, size, samples)
    return _seen(placed, surface.faces, surface.vertex_normals, light, size, samples)


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
    return see_surface(surface, view, size, samples).painted(colors, ambient)


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
    straight = np.tile([0.0, 0.0, 1.0], (len(plane), 1))
    return _seen(placed, faces, straight, straight[0], size, samples).painted(colors, 1.0)


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


def webp_bytes(picture: Picture) -> bytes:
    """Return a small WebP file of a picture; colours may be off by a few parts of 255."""
    content = io.BytesIO()
    Image.fromarray(picture).save(content, "WEBP", quality=90, method=2)
    return content.getvalue()


def png_bytes(picture: Picture) -> bytes:
    """Return the PNG file of a picture of (height, width, 3 or 4) bytes."""
    content = io.BytesIO()
    Image.fromarray(picture).save(content, "PNG")
    return content.getvalue()


def _placed(points: Floats, view: View, size: tuple[int, int], samples: int) -> Floats:
    """Return (n, 3) samples across and down from the upper left corner, and towards the viewer."""
    zoom = samples / view.um_per_pixel
    origin = np.array([size[0], size[1], 0.0]) * samples / 2
    turn = zoom * view.axes * np.array([[1.0], [-1.0], [1.0]])  # pictures count downwards
    return _mapped(np.ascontiguousarray(points), turn, origin - turn @ view.middle)


@njit(nogil=True, cache=True)
def _mapped(points: Floats, matrix: Floats, offset: Floats) -> Floats:
    """Return (n, 3) points under an affine map; for so small a matrix BLAS takes longer."""
    mapped = np.zeros(points.shape)
    for n in range(len(points)):
        x, y, z = points[n, 0], points[n, 1], points[n, 2]
        for i in range(3):
            mapped[n, i] = matrix[i, 0] * x + matrix[i, 1] * y + matrix[i, 2] * z + offset[i]
    return mapped


def _painted(colors: Colors | Color, count: int) -> Floats:
    return np.array(np.broadcast_to(np.asarray(colors, dtype=float), (count, 3)))


def _seen(
    placed: Floats,
    faces: Integers,
    normals: Floats,
    light: Floats,
    size: tuple[int, int],
    samples: int,
) -> Seen:
    shown = np.full((size[1] * samples, size[0] * samples), -1, dtype=np.int32)
    _find_nearest_faces(placed, faces, shown)
    return Seen(placed, faces, normals, light, shown, samples)


@njit(nogil=True, cache=True)
def _find_nearest_faces(placed: Floats, faces: Integers, shown: NDArray[np.int32]) -> None:
    """Fill in for each sample the face nearest to the viewer that has its middle; -1 is none."""
    height, width = shown.shape
    nearness = np.full(shown.shape, -np.inf)
    for number in range(len(faces)):
        a, b, c = faces[number, 0], faces[number, 1], faces[number, 2]
        ay, by, cy = placed[a, 1], placed[b, 1], placed[c, 1]
        top, bottom = _first(min(ay, by, cy)), _last(max(ay, by, cy), height)
        if top > bottom:
            continue  # between two rows of samples, as many small ones are, or beside the picture
        ax, bx, cx = placed[a, 0], placed[b, 0], placed[c, 0]
        left, right = _first(min(ax, bx, cx)), _last(max(ax, bx, cx), width)
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if left > right or area == 0:
            continue  # beside the picture, or seen from its edge
        az, bz, cz = placed[a, 2], placed[b, 2], placed[c, 2]
        share = 1.0 / area
        for row in range(top, bottom + 1):
            y = row + 0.5
            for column in range(left, right + 1):
                x = column + 0.5
                u = ((bx - x) * (cy - y) - (by - y) * (cx - x)) * share
                v = ((cx - x) * (ay - y) - (cy - y) * (ax - x)) * share
                w = 1.0 - u - v
                if u < -CRACK or v < -CRACK or w < -CRACK:
                    continue
                near = u * az + v * bz + w * cz
                if near > nearness[row, column]:
                    nearness[row, column] = near
                    shown[row, column] = number


@njit(nogil=True, cache=True)
def _first(low: float) -> int:
    """Return the first row or column whose samples may lie beyond a coordinate."""
    return math.ceil(max(low - 0.5 - REACH, 0.0))


@njit(nogil=True, cache=True)
def _last(high: float, length: int) -> int:
    """Return the last one, of so many, whose samples may lie before a coordinate."""
    return math.floor(min(high - 0.5 + REACH, length - 1.0))


@njit(nogil=True, cache=True)
def _shade(
    placed: Floats,
    faces: Integers,
    normals: Floats,
    light: Floats,
    shown: NDArray[np.int32],
    colors: Floats,
    ambient: float,
    samples: int,
    picture: Picture,
) -> None:
    """Fill in the mean colour of each pixel's samples, and the share of them that show a face.

    Normals are those of the vertices in between, turned to the viewer if the face shows its back.
    """
    mean = np.zeros(3)
    for row in range(picture.shape[0]):
        for column in range(picture.shape[1]):
            count = 0
            mean[:] = 0.0
            for part in range(samples * samples):
                y, x = row * samples + part // samples, column * samples + part % samples
                if shown[y, x] < 0:
                    continue
                face = shown[y, x]
                a, b, c = faces[face, 0], faces[face, 1], faces[face, 2]
                ax, ay = placed[a, 0] - x - 0.5, placed[a, 1] - y - 0.5
                bx, by = placed[b, 0] - x - 0.5, placed[b, 1] - y - 0.5
                cx, cy = placed[c, 0] - x - 0.5, placed[c, 1] - y - 0.5
                u, v, w = bx * cy - by * cx, cx * ay - cy * ax, ax * by - ay * bx
                area = u + v + w
                u, v, w = u / area, v / area, w / area
                shine = length = 0.0
                for i in range(3):
                    along = u * normals[a, i] + v * normals[b, i] + w * normals[c, i]
                    shine += along * light[i]
                    length += along * along
                if area > 0:  # pictures count downwards: this is the back
                    shine = -shine
                lit = max(shine, 0.0) / np.sqrt(length) if length > 0 else 0.0
                brightness = ambient + (1.0 - ambient) * lit
                for i in range(3):
                    color = u * colors[a, i] + v * colors[b, i] + w * colors[c, i]
                    mean[i] += brightness * color
                count += 1
            if count > 0:
                for i in range(3):
                    picture[row, column, i] = int(min(mean[i] / count + 0.5, 255.0))
                picture[row, column, 3] = int(255.0 * count / (samples * samples) + 0.5)
