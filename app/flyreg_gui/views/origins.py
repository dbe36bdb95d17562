"""Where each part of a prepared surface comes from, as colours with a key."""

from __future__ import annotations

import numpy as np

from flyreg_core.mesh import Integers
from flyreg_core.relief import tinted
from flyreg_core.results import PreparedBrain
from flyreg_core.torus import ORIGINS
from flyreg_gui.theme import Color
from flyreg_gui.views.layers import Colors

ORIGIN_COLORS: dict[str, Color] = {  # Okabe and Ito's palette
    "original": (196, 196, 196),
    "filled": (213, 94, 0),
    "drilled": (0, 114, 178),
    "trimmed": (204, 121, 167),
    "bridged": (240, 228, 66),
}
MEANINGS = {
    "original": "the file's own surface",
    "filled": "a crack, a hollow or another tunnel was filled",
    "drilled": "the wall of a drilled channel",
    "trimmed": "where an optic lobe was cut off",
    "bridged": "a gap in the file's surface was bridged",
}


def origins_of(brain: PreparedBrain) -> Integers:
    """Return for each vertex of a prepared surface the number of its origin in `ORIGINS`.

    The vertices of the torus come first and are followed by those on the cuts, unless the surface
    was simplified; any other vertex takes after the nearest of the torus.
    """
    known, vertices = brain.torus.surface.vertices, brain.surface.vertices
    count = len(known) if brain.simplified.surface is brain.torus.surface else 0
    nearest = brain.torus.nearest_vertices(vertices[count:])
    origins = brain.torus.origin_of_vertex
    return np.asarray(np.concatenate([origins[:count], origins[nearest]]))


def origin_colors(brain: PreparedBrain) -> Colors:
    """Return an (n, 3) colour for each vertex of a prepared surface, shaded by its relief."""
    palette = np.array([ORIGIN_COLORS[name] for name in ORIGINS])
    return tinted(brain.relief, palette[origins_of(brain)])


def key_of(brain: PreparedBrain) -> list[tuple[Color, str, str]]:
    """Return colour, name with share of the area, and meaning of what occurs on a surface."""
    faces, areas = brain.surface.faces, brain.surface.face_areas
    weights = np.repeat(areas / 3, 3)
    size = np.bincount(origins_of(brain)[faces].reshape(-1), weights, minlength=len(ORIGINS))
    shares = size / max(float(size.sum()), 1e-12)
    return [
        (ORIGIN_COLORS[name], f"{name} {_per_cent(float(share))}", MEANINGS[name])
        for name, share in zip(ORIGINS, shares, strict=True)
        if share > 0
    ]


def _per_cent(share: float) -> str:
    return f"{share:.0%}" if share >= 0.01 else "below 1%"
