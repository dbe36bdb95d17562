"""The demo pair: two made-up brain surfaces whose true correspondence is known.

The source is a soft union of ellipsoids with the proportions of an adult fly brain; the target is
the source moved by `deform`, so the place where each point of the source belongs is known exactly.
Coordinates are micrometres; x grows to the animal's left, y ventrally, z posteriorly.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flyreg_core.isosurface import extract_surface
from flyreg_core.mesh import SurfaceMesh

Floats = NDArray[np.float64]

PITCH = 8.3
"""Edge of the grid on which the source is drawn; gives about 20,000 vertices."""
LOW, HIGH = np.array([-292.0, -132.0, -92.0]), np.array([292.0, 162.0, 92.0])
BLEND = 14.0
"""Over how many micrometres neighbouring parts run into each other."""
SMOOTHING_PASSES = 12

# centre and radii of each part; those with x != 0 come in pairs
PARTS = (
    ((55.0, -30.0, 6.0), (88.0, 84.0, 58.0)),  # protocerebrum
    ((0.0, 84.0, 4.0), (78.0, 58.0, 50.0)),  # gnathal ganglia
    ((60.0, 46.0, -38.0), (37.0, 35.0, 32.0)),  # antennal lobes
    ((66.0, -66.0, 42.0), (32.0, 28.0, 26.0)),  # calyces
    ((28.0, -84.0, -34.0), (24.0, 24.0, 22.0)),  # vertical lobes
    ((158.0, -2.0, 8.0), (62.0, 36.0, 30.0)),  # necks of the optic lobes
    ((226.0, 0.0, 6.0), (50.0, 108.0, 54.0)),  # optic lobes
)
OESOPHAGUS_CENTER = (0.0, 34.0)  # x and y, in the plane of the midline's middle
OESOPHAGUS_RADII = (19.0, 15.0)
OESOPHAGUS_SLOPE = 0.16  # how much further ventral it lies per micrometre towards posterior


def make_demo_pair() -> tuple[SurfaceMesh, SurfaceMesh]:
    """Return a source and a target brain surface; vertex i of both is the same place."""
    shape = np.ceil((HIGH - LOW) / PITCH).astype(int) + 1
    grid = LOW + PITCH * np.moveaxis(np.indices(shape), 0, -1)
    drawn = extract_surface(_depth(grid), LOW, PITCH)
    source = SurfaceMesh(_relaxed(drawn), drawn.faces)
    return source, SurfaceMesh(deform(source.vertices), source.faces)


def deform(points: Floats) -> Floats:
    """Return where points of the source, (n, 3) micrometres, lie on the target.

    A slight turn and change of size plus slow waves: one-to-one, and 15 to 45 um long.
    """
    x, y, z = points.T
    waves = np.stack(
        [
            9.0 * np.sin(y / 62.0 + 0.4) + 5.0 * np.sin(z / 45.0),
            9.0 * np.sin(x / 80.0 + 1.1) + 5.0 * np.cos(z / 55.0),
            6.0 * np.sin(x / 90.0 + 0.3) + 5.0 * np.cos(y / 60.0),
        ],
        axis=1,
    )
    turn = np.deg2rad(2.5)
    rotation = np.array(
        [[np.cos(turn), -np.sin(turn), 0.0], [np.sin(turn), np.cos(turn), 0.0], [0.0, 0.0, 1.0]]
    )
    scale = np.array([1.05, 0.95, 1.06])
    return np.asarray((points * scale) @ rotation.T + waves + np.array([6.0, -10.0, 8.0]))


def _depth(points: Floats) -> Floats:
    """Return about how deep points (..., 3) lie inside the source; negative outside."""
    depth = np.full(points.shape[:-1], -np.inf)
    for center, radii in PARTS:
        sides = (1.0, -1.0) if center[0] else (1.0,)
        for side in sides:
            offset = points - np.array([side * center[0], center[1], center[2]])
            depth = _soft_maximum(depth, _ellipsoid_depth(offset, np.array(radii)))
    furrows = 1.6 * np.sin(points[..., 0] / 17.0 + 1.0) * np.sin(points[..., 1] / 15.0)
    furrows *= np.cos(points[..., 2] / 19.0)
    x = points[..., 0] - OESOPHAGUS_CENTER[0]
    y = points[..., 1] - OESOPHAGUS_CENTER[1] - OESOPHAGUS_SLOPE * points[..., 2]
    across, along = OESOPHAGUS_RADII
    channel = (np.hypot(x / across, y / along) - 1) * min(OESOPHAGUS_RADII)
    return np.asarray(-_soft_maximum(-(depth + furrows), -channel))


def _ellipsoid_depth(offset: Floats, radii: Floats) -> Floats:
    """Return the depth inside an ellipsoid to first order, which is exact on its surface."""
    scaled = np.linalg.norm(offset / radii, axis=-1)
    steepness = np.maximum(np.linalg.norm(offset / radii**2, axis=-1), 1e-9)
    return np.asarray(scaled * (1 - scaled) / steepness)


def _soft_maximum(a: Floats, b: Floats) -> Floats:
    """Return the larger of two depths, rounded where they are less than `BLEND` apart."""
    overlap = np.clip(1 - np.abs(a - b) / BLEND, 0, None)
    return np.asarray(np.maximum(a, b) + BLEND / 4 * overlap**2)


def _relaxed(mesh: SurfaceMesh) -> Floats:
    """Return the vertices moved a few times halfway to the mean of their neighbours."""
    edges = np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]])
    count = np.bincount(edges[:, 0], minlength=len(mesh.vertices))[:, None]
    vertices = np.array(mesh.vertices)
    for _ in range(SMOOTHING_PASSES):
        total = np.stack(
            [
                np.bincount(edges[:, 0], vertices[edges[:, 1], axis], len(vertices))
                for axis in range(3)
            ],
            axis=1,
        )
        vertices = (vertices + total / count) / 2
    return vertices
