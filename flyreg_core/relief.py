"""Shading of a surface by its bumps and grooves, so that anatomy stays visible when it is moved."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flyreg_core.color_maps import Color
from flyreg_core.mesh import Floats, SurfaceMesh
from flyreg_core.smooth import averaging_matrix

PASSES = 40
"""How far the surface is smoothed to tell bumps from the rest."""
DARKEST, LIGHTEST = 0.55, 1.3
"""Brightness of the deepest groove and of the highest bump."""


def relief_of(surface: SurfaceMesh) -> Floats:
    """Return (n,) how bright each vertex is drawn: 1 as it is, bumps lighter, grooves darker.

    Carried along with the vertices, it shows where the bumps of one brain land on another.
    """
    matrix = averaging_matrix(surface.faces, len(surface.vertices))
    smoothed = np.array(surface.vertices)
    for _ in range(PASSES):
        smoothed = matrix @ smoothed
    height = np.einsum("ij,ij->i", surface.vertices - smoothed, surface.vertex_normals)
    height *= 1.0 if surface.volume >= 0 else -1.0  # in mirrored files normals point inwards
    low, high = np.percentile(height, [4, 96])
    share = np.clip((height - low) / max(high - low, 1e-12), 0, 1)
    return np.asarray(DARKEST + (LIGHTEST - DARKEST) * share)


def tinted(brightness: Floats, color: Color | NDArray[np.integer]) -> NDArray[np.uint8]:
    """Return (n, 3) colours of so many vertices; `color` is one for all, or one for each."""
    shaded = np.array(color) * brightness[:, np.newaxis]
    return np.asarray(np.clip(shaded, 0, 255), dtype=np.uint8)


def relief_colors(surface: SurfaceMesh, color: Color | NDArray[np.integer]) -> NDArray[np.uint8]:
    """Return an (n, 3) colour for each vertex of a surface: bumps lighter, grooves darker."""
    return tinted(relief_of(surface), color)
