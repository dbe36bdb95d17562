"""Normals of scattered points: their directions from the neighbours, their sides from outside."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from scipy import sparse
from scipy.sparse.csgraph import breadth_first_order, minimum_spanning_tree
from scipy.spatial import cKDTree

from flyreg_core.mesh import Booleans, Floats, Integers

NEIGHBOURS = 12
"""Points around each one that show where the surface runs."""
STRAY = 6.0
"""A point whose neighbours are this many times as far as is usual lies on no surface."""
FIRST_BALL, LAST_BALL = 3.0, 100.0
"""Radius of the smallest ball that is rolled over the points, in spacings; of the largest, um."""
VOXELS_PER_BALL = 2.0
"""Voxels in the ball's radius."""
KEPT_SHARE = 0.7
"""A ball has not fallen through the surface if it leaves this share of what one twice as large does."""
FACING = 0.8
"""Least cosine between a normal and the way to the outside for the point to be seen from there."""
AGREEMENT = 0.9
"""Least share of the seen points on which given normals must agree with the outside."""
WORST_STEP = 0.6
"""Cost of the worst step from a seen point above which a point's side is not known; 0 is none."""


@dataclass(frozen=True, eq=False)
class Neighbourhood:
    """What lies around each of n points."""

    index: Integers  # (n, NEIGHBOURS), nearest first, without the point itself
    distances: Floats  # (n, NEIGHBOURS), micrometres
    areas: Floats  # (n,), of the surface each point stands for, um^2; 0 for a stray one

    @property
    def spacing(self) -> float:
        """Root of the median area, micrometres."""
        return float(np.sqrt(np.median(self.areas)))


@dataclass(frozen=True, eq=False)
class Sight:
    """What of n points is seen from outside."""

    is_seen: Booleans  # (n,)
    cosine: Floats  # (n,), between the normal and the way to the outside


def find_neighbours(points: Floats) -> Neighbourhood:
    """Return the neighbours of (n, 3) distinct points, n > NEIGHBOURS, micrometres."""
    distances, index = nearest_points(points, points, NEIGHBOURS + 1)
    areas = np.pi * distances[:, -1] ** 2 / NEIGHBOURS
    areas[distances[:, -1] > STRAY * np.median(distances[:, -1])] = 0
    return Neighbourhood(index[:, 1:], distances[:, 1:], areas)


def nearest_points(points: Floats, places: Floats, count: int) -> tuple[Floats, Integers]:
    """Return the (k, count) distances and numbers of the points nearest to k places, ascending."""
    distances, index = cKDTree(points).query(places, count, workers=-1)
    return np.asarray(distances), np.asarray(index, dtype=np.int64)


def estimate_directions(points: Floats, around: Neighbourhood) -> tuple[Floats, Floats]:
    """Return unit normals of arbitrary side, and how the neighbours spread.

    Returns
    -------
    normals : (n, 3) float
        The direction in which each point's neighbours spread least.
    variances : (n, 3) float
        The shares of their variance, ascending: 0, 0, 1 on a line, 0, 1/2, 1/2 in a plane.
    """
    near = points[around.index] - points[:, None]
    near -= near.mean(axis=1, keepdims=True)
    variances, directions = np.linalg.eigh(np.matmul(near.transpose(0, 2, 1), near))
    total = np.maximum(variances.sum(axis=1, keepdims=True), np.finfo(float).tiny)
    return np.ascontiguousarray(directions[:, :, 0]), variances / total


def see_from_outside(points: Floats, normals: Floats, around: Neighbourhood) -> Sight:
    """Return which points a ball touches that rolls around the cloud without falling through it.

    The ball is the smallest, of doubling radii, that takes no more from the solid than the next
    one: gaps between the points differ by what the cloud was sampled from. If all balls fall
    through, nothing is outside and no point is seen.
    """
    radius = FIRST_BALL * around.spacing
    sight, volume = _roll_ball(points, normals, radius)
    while radius < LAST_BALL:
        radius *= 2
        wider, wider_volume = _roll_ball(points, normals, radius)
        if volume > KEPT_SHARE * wider_volume > 0:
            break
        sight, volume = wider, wider_volume
    return sight if volume > 0 else Sight(np.zeros(len(points), dtype=bool), sight.cosine)


def _roll_ball(points: Floats, normals: Floats, radius: float) -> tuple[Sight, float]:
    """Return what a ball sees from outside, and the volume that it cannot reach."""
    pitch = radius / VOXELS_PER_BALL
    low, high = points.min(axis=0) - 2 * radius, points.max(axis=0) + 2 * radius
    voxel = np.round((points - low) / pitch).astype(np.int64)
    is_free = np.ones(np.ceil((high - low) / pitch).astype(int) + 1, dtype=bool)
    is_free[tuple(voxel.T)] = False
    regions, _ = scipy.ndimage.label(scipy.ndimage.distance_transform_edt(is_free) * pitch > radius)
    depth, nearest = scipy.ndimage.distance_transform_edt(
        regions != regions[0, 0, 0], return_indices=True
    )
    way = low + pitch * nearest[(slice(None), *voxel.T)].T - points
    length = np.linalg.norm(way, axis=1)
    cosine = np.einsum("ij,ij->i", way, normals) / np.maximum(length, pitch)
    is_seen = (length < radius + 1.5 * pitch) & (np.abs(cosine) > FACING)
    return Sight(is_seen, cosine), float((depth * pitch > radius + pitch).sum() * pitch**3)


def orient_given(normals: Floats, sight: Sight) -> Floats | None:
    """Return given normals turned outwards all together; None if some point in and others out."""
    outwards = float((sight.cosine[sight.is_seen] > 0).mean())
    if outwards >= AGREEMENT:
        return normals
    return -normals if outwards <= 1 - AGREEMENT else None


def orient(points: Floats, directions: Floats, around: Neighbourhood, sight: Sight) -> Floats:
    """Return the normals pointing outwards; 0 where it is not known what is outside.

    Notes
    -----
    Sides spread from the points seen from outside along a minimum spanning tree of the neighbour
    graph, whose edges cost the less the more parallel the normals are and the better the edge runs
    within both tangent planes. So they reach into tunnels and clefts that are narrower than the
    gaps between points, and do not jump from one wall to the other.

    References
    ----------
    Hoppe, DeRose, Duchamp, McDonald, Stuetzle, Surface reconstruction from unorganized points,
    SIGGRAPH 1992, doi:10.1145/133994.134011, section 3.3.
    """
    tree = minimum_spanning_tree(_steps(points, directions, around, sight))
    root = len(points)
    _, found = breadth_first_order(tree, root, directed=False)
    is_reached = found >= 0
    parent: Integers = np.where(is_reached, found, root).astype(np.int64)
    cost = _costs_to_parent(tree, parent)
    toward = np.vstack([directions, np.zeros(3)])
    same = np.einsum("ij,ij->i", toward, toward[parent])
    side = np.where(parent == root, np.append(sight.cosine, 1.0), same)
    side = np.where(side < 0, -1, 1)
    while (parent != root).any():  # each round looks twice as far up the tree
        side, cost = side * side[parent], np.maximum(cost, cost[parent])
        parent = parent[parent]
    is_known = is_reached[:root] & (cost[:root] < WORST_STEP)
    return np.asarray(directions * (side[:root] * is_known)[:, None])


def _steps(
    points: Floats, directions: Floats, around: Neighbourhood, sight: Sight
) -> sparse.csr_array:
    """Return the costs of the steps between neighbours, and from a root n to the seen points."""
    n = len(points)
    start, end = np.repeat(np.arange(n), NEIGHBOURS), around.index.ravel()
    between = np.abs(np.einsum("ij,ij->i", directions[start], directions[end]))
    step = (points[end] - points[start]) / np.repeat(around.distances[:, -1:], NEIGHBOURS, axis=0)
    across = np.abs(np.einsum("ij,ij->i", step, directions[start]))
    across += np.abs(np.einsum("ij,ij->i", step, directions[end]))
    seen = np.flatnonzero(sight.is_seen)
    smallest = 1e-3  # a cost of 0 would be no edge
    costs = [1 - between + across / 2, 0.2 * (1 - np.abs(sight.cosine[seen]))]
    ends = (np.concatenate([start, np.full(len(seen), n)]), np.concatenate([end, seen]))
    return sparse.csr_array((smallest + np.maximum(np.concatenate(costs), 0), ends), (n + 1, n + 1))


def _costs_to_parent(tree: sparse.csr_array, parent: Integers) -> Floats:
    """Return what each node's edge to its parent costs; 0 for the root and what was not reached."""
    edges = tree.tocoo()
    cost = np.zeros(len(parent))
    for child, other in ((edges.row, edges.col), (edges.col, edges.row)):
        is_upwards = parent[child] == other
        cost[child[is_upwards]] = edges.data[is_upwards]
    return cost
