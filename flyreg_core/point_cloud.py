"""The surface that points lie on, with or without normals, as contours of a segmentation give."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from scipy import sparse

from flyreg_core.errors import MeshError
from flyreg_core.isosurface import extract_surface
from flyreg_core.mesh import Floats, SurfaceMesh
from flyreg_core.point_normals import (
    NEIGHBOURS,
    Neighbourhood,
    estimate_directions,
    find_neighbours,
    nearest_points,
    orient,
    orient_given,
    see_from_outside,
)
from flyreg_core.progress import Report

FEWEST_POINTS = 1000
FINEST_UM = 2.0
"""Points nearer to each other become one, and no grid is finer: a voxel of the solid has 2 to 5 um."""
PITCH = 1.1
"""Edge of a voxel, in spacings of the points."""
MOST_VOXELS = 12_000_000
MARGIN = 6
"""Layers of voxels around the points."""
BLUR, LEVEL_BLUR = 1.0, 4.0
"""Standard deviation of the Gaussians that even out the points and the level, voxels."""
ROUGHEST = 0.14
"""Median of the least variance above which points fill space (see `estimate_directions`)."""
NARROWEST = 0.05
"""Median of the middle variance below which points lie on lines."""
SPECK = 0.01
"""Bodies smaller than this share of the largest are specks around stray points."""


@dataclass(frozen=True, eq=False)
class PointCloud:
    """Points on a surface, as a file has them."""

    points: Floats  # (n, 3)
    normals: Floats | None  # (n, 3), of any length, 0 where not known


def reconstruct_surface(cloud: PointCloud, report: Report) -> SurfaceMesh:
    """Return the closed surface that points lie on.

    Parameters
    ----------
    cloud : PointCloud
        In micrometres, in any order and density. Normals may point in, out, or both ways.

    Returns
    -------
    SurfaceMesh
        Closed, oriented outwards. Where points are missing it is as smooth as it can be.

    Raises
    ------
    MeshError
        There are too few points, they fill space, or enclose nothing.

    Notes
    -----
    The indicator function of the body, whose gradient is the field of the normals, solves a Poisson
    equation; on a periodic grid that is one division between two Fourier transforms. Its level is
    taken from the values at the points nearby, and each vertex of the isosurface is then moved onto
    the plane through the points around it. O(n log n).

    References
    ----------
    Kazhdan, Bolitho, Hoppe, Poisson surface reconstruction, SGP 2006. By Fourier transform: Peng et
    al., Shape As Points, NeurIPS 2021, section 3.1. Planes: Alexa, Adamson, On normals and
    projection operators for surfaces defined by point sets, SPBG 2004.
    """
    report(0.0, "finding how the points are spread")
    evened, around, directions = _evened(cloud)
    report(0.15, "finding which side of the points is outside")
    normals = _normals(evened, directions, around)
    report(0.5, "finding the surface of the points")
    surface = _extract(evened.points, normals, around)
    report(0.8, "moving the surface onto the points")
    vertices = _moved_onto(surface.vertices, evened.points, normals, around)
    return SurfaceMesh(vertices, surface.faces)


def _evened(cloud: PointCloud) -> tuple[PointCloud, Neighbourhood, Floats]:
    """Return as many of the points as show a surface, what is around them, and their directions.

    Points of contours lie much denser along them than across, so that their neighbours are on a
    line; thinned to the distance of the contours they show the surface.
    """
    edge = FINEST_UM
    while True:
        thinned = _thinned(cloud, edge)
        around = find_neighbours(thinned.points)
        directions, variances = estimate_directions(thinned.points, around)
        if np.median(variances[:, 0]) > ROUGHEST:
            raise MeshError(
                "the points fill space instead of lying on a surface; give the points of the "
                "outline only, or the labels as a volume"
            )
        if np.median(variances[:, 1]) > NARROWEST:
            return thinned, around, directions
        edge *= 2


def _thinned(cloud: PointCloud, edge: float) -> PointCloud:
    """Return the mean of the points in each cell of a grid; a normal is that of the first."""
    cell = np.floor((cloud.points - cloud.points.min(axis=0)) / edge).astype(np.int64)
    key = np.ravel_multi_index(tuple(cell.T), tuple(cell.max(axis=0) + 1))
    _, first, group, count = np.unique(
        key, return_index=True, return_inverse=True, return_counts=True
    )
    if len(first) < FEWEST_POINTS:
        raise MeshError(
            f"the {len(cloud.points):,} points are too few for a surface: {len(first):,} are left "
            f"where they are {edge:g} um apart, and at least {FEWEST_POINTS:,} are needed"
        )
    sums = [np.bincount(group, weights=cloud.points[:, axis]) for axis in range(3)]
    normals = None if cloud.normals is None else cloud.normals[first]
    return PointCloud(np.stack(sums, axis=1) / count[:, None], normals)


def _normals(cloud: PointCloud, directions: Floats, around: Neighbourhood) -> Floats:
    """Return normals that point outwards, the given ones where they can be used."""
    is_complete = False
    if cloud.normals is not None:
        length = np.linalg.norm(cloud.normals, axis=1, keepdims=True)
        is_complete = bool((length > 0).all())
        given = cloud.normals / np.maximum(length, np.finfo(float).tiny)
        directions = np.where(length > 0, given, directions)
    sight = see_from_outside(cloud.points, directions, around)
    if not sight.is_seen.any():
        raise MeshError("the points enclose nothing; give points from all around the brain")
    oriented = orient_given(directions, sight) if is_complete else None
    return orient(cloud.points, directions, around, sight) if oriented is None else oriented


def _extract(points: Floats, normals: Floats, around: Neighbourhood) -> SurfaceMesh:
    extent = np.ptp(points, axis=0)
    pitch = max(PITCH * around.spacing, FINEST_UM, float(np.cbrt(extent.prod() / MOST_VOXELS)))
    origin = points.min(axis=0) - MARGIN * pitch
    shape = tuple(
        scipy.fft.next_fast_len(int(length), real=True)
        for length in np.ceil(extent / pitch) + 2 * MARGIN + 1
    )
    spread = _spread((points - origin) / pitch, shape)
    indicator = _without_specks(_indicator(normals, around.areas, spread, shape))
    if not (indicator > 0).any():
        raise MeshError("the points enclose nothing; give points from all around the brain")
    for axis in range(3):  # the grid's end, where the next period begins
        np.moveaxis(indicator, axis, 0)[[0, -1]] = -1
    return extract_surface(indicator, origin, pitch)


def _spread(places: Floats, shape: tuple[int, ...]) -> sparse.csr_array:
    """Return the (voxels, n) matrix that spreads values at points over the 8 voxels around each."""
    corner = np.floor(places).astype(np.int64)
    beyond = places - corner
    rows, shares = [], []
    for offset in np.ndindex(2, 2, 2):
        shares.append(np.where(offset, beyond, 1 - beyond).prod(axis=1))
        rows.append(np.ravel_multi_index(tuple((corner + offset).T), shape))
    columns = np.tile(np.arange(len(places)), 8)
    ends = (np.concatenate(rows), columns)
    return sparse.csr_array((np.concatenate(shares), ends), (int(np.prod(shape)), len(places)))


def _indicator(
    normals: Floats, areas: Floats, spread: sparse.csr_array, shape: tuple[int, ...]
) -> Floats:
    """Return a field on the grid that is positive inside and 0 at the points."""
    frequencies = [2 * np.pi * scipy.fft.fftfreq(n) for n in shape[:2]]
    frequencies.append(2 * np.pi * scipy.fft.rfftfreq(shape[2]))
    waves = np.meshgrid(*frequencies, indexing="ij", sparse=True)
    squared = np.asarray(sum(wave**2 for wave in waves))
    blur = np.exp(-squared * LEVEL_BLUR**2 / 2)
    weighted = spread @ (normals * areas[:, None])
    divergence = sum(
        1j * wave * scipy.fft.rfftn(weighted[:, axis].reshape(shape), workers=-1)
        for axis, wave in enumerate(waves)
    )
    divergence *= np.exp(-squared * BLUR**2 / 2)
    squared[0, 0, 0] = 1.0  # the mean, which no gradient tells
    indicator = scipy.fft.irfftn(divergence / squared, shape, workers=-1)
    values = spread.T @ indicator.ravel()
    middle = np.average(values, weights=areas)
    deviation, density = (
        scipy.fft.irfftn(
            blur * scipy.fft.rfftn((spread @ part).reshape(shape), workers=-1), shape, workers=-1
        )
        for part in ((values - middle) * areas, areas)
    )
    far = 1e-3 * density.max()  # from all points, where the level is their mean
    return np.asarray(indicator - middle - deviation / (np.maximum(density, 0) + far))


def _without_specks(indicator: Floats) -> Floats:
    bodies, _ = scipy.ndimage.label(indicator > 0)
    sizes = np.bincount(bodies.ravel())
    sizes[0] = 0
    is_speck = sizes < SPECK * sizes.max()
    is_speck[0] = False
    return np.where(is_speck[bodies], -np.abs(indicator), indicator)


def _moved_onto(vertices: Floats, points: Floats, normals: Floats, around: Neighbourhood) -> Floats:
    """Return vertices moved onto the planes of the points around, those far from any left alone."""
    distances, index = nearest_points(points, vertices, NEIGHBOURS)
    width = distances[:, -1:] / 2
    shares = np.exp(-((distances / width) ** 2) / 2) * around.areas[index]
    shares /= np.maximum(shares.sum(axis=1, keepdims=True), np.finfo(float).tiny)
    normal = np.einsum("nk,nki->ni", shares, normals[index])
    certainty = np.linalg.norm(normal, axis=1)
    normal /= np.maximum(certainty, np.finfo(float).tiny)[:, None]
    center = np.einsum("nk,nki->ni", shares, points[index])
    height = np.einsum("ni,ni->n", vertices - center, normal)
    is_near = (certainty > 0.5) & (np.abs(height) < 2 * around.spacing)
    is_near &= distances[:, 0] < 3 * around.spacing
    return np.asarray(vertices - np.where(is_near, height, 0.0)[:, None] * normal)
