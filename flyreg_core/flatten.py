"""Stage 5: a half, a ring, laid flat on a strip that closes on itself, no triangle flipped.

Each inner vertex is the mean of its neighbours (Tutte). On a strip whose two edges are the two
boundaries this is one-to-one for any ring without chords; pinned to a rectangle with a hole it is
not. `rectangle` shows the strip as the paper's rectangle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy import sparse
from scipy.sparse.csgraph import breadth_first_order, dijkstra
from scipy.sparse.linalg import SuperLU, splu

from flyreg_core.errors import MeshError
from flyreg_core.mesh import Booleans, FlatMesh, Floats, Integers
from flyreg_core.orientation import orientations, signed_areas
from flyreg_core.progress import Report
from flyreg_core.rectangle import wrapped
from flyreg_core.smooth import averaging_matrix
from flyreg_core.topology import half_edges, unique_edges

SMALLEST_AREA = 1e-300
"""Stands for the area of a face that rounding has flattened."""
LEAST_WEIGHT = 0.1
"""Least weight of a spring by its cotangents; the largest is the inverse."""
STRONGEST_CHANGE = 6.0
"""No round changes a weight by more than this factor's logarithm."""


MOST_EXTRA_ROUNDS = 16
"""As many rounds follow while rounding still turns faces over, in pockets that crowd too much."""


@dataclass(frozen=True)
class FlattenParameters:
    """How the means are found: None solves for them; a number takes that many averaging passes.

    The paper takes about 500 passes, which do not reach the fixed point; triangles may be flipped.
    """

    passes: int | None = None
    rounds: int = 2  # of weighing the means so that areas come out even


@dataclass(frozen=True, eq=False)
class Ring:
    """A half's faces with its two boundaries, each in the direction in which u grows."""

    faces: Integers  # (m, 3)
    outer: Integers  # (b,)
    outer_u: Floats  # (b,), growing by less than half a turn from each to the next, once around
    hole: Integers  # (c,)
    hole_u: Floats  # (c,)

    @property
    def n_vertices(self) -> int:
        """Number of vertices, all of which faces use."""
        return int(self.faces.max()) + 1


@dataclass(frozen=True, eq=False)
class Springs:
    """The net that lays a ring flat: each inner vertex is the weighted mean of its neighbours."""

    edges: Integers  # (e, 2), lower vertex first
    jumps: Integers  # (e,), whole turns added to u of the second end when seen from the first
    weights: Floats  # (e,), positive


def flatten(
    ring: Ring,
    face_areas: Floats,
    parameters: FlattenParameters,
    report: Report,
    vertices: Floats | None = None,
) -> tuple[FlatMesh, Springs]:
    """Return the strip coordinates in which each inner vertex is a mean of its neighbours, and how.

    Parameters
    ----------
    face_areas : (m,) float
        Areas on the surface; where flat faces come out too small, the next round's means are
        weighed so that they grow.
    vertices : (n, 3) float, optional
        Places on the surface; with them the first means are weighed by cotangents, so that the
        pattern of the faces leaves no trace; without, all neighbours count alike.

    Notes
    -----
    Solves L u = sum of jumps, L v = 0 with u and v given on both boundaries (v = 0 on the hole, 1
    outside), L the graph Laplacian. A jump of one turn is charged wherever an edge crosses a path
    of faces from the hole to the outside. Of the ways to twist the strip by whole turns between
    its two edges, the one of least energy is taken. One-to-one by the theorem of Tutte and Floater
    in its form for cylinders. One sparse factorisation.

    References
    ----------
    3.1 D of the paper. Tutte, How to draw a graph, Proc. LMS 13, 1963. Floater, One-to-one piecewise
    linear mappings over triangulations, Math. Comp. 72, 2003. Groiss, Jüttler, Mokriš, 2021 (rings).
    """
    report(0.0, "flattening")
    edges, jumps = edge_jumps(ring)
    u, v = _boundary_values(ring, edges, jumps)
    is_fixed = np.zeros(ring.n_vertices, dtype=bool)
    is_fixed[ring.outer] = is_fixed[ring.hole] = True
    shifts = _corner_shifts(ring.faces, edges, jumps)
    weights = np.ones(len(edges)) if vertices is None else cotangents(ring.faces, edges, vertices)
    springs = Springs(edges, jumps, weights)
    if parameters.passes is not None:
        solved, _ = _least_twisted(springs, *solve_means(springs, is_fixed, u, v))
        u[is_fixed] = solved[is_fixed]
        u, v = _pass_means(ring, edges, jumps, is_fixed, u, v, parameters.passes, report)
        return FlatMesh(np.stack([u, v], axis=1), ring.faces, shifts), springs
    for done in range(parameters.rounds + MOST_EXTRA_ROUNDS + 1):
        report(min(done / (parameters.rounds + 1), 1.0), "flattening")
        u, v = _least_twisted(springs, *solve_means(springs, is_fixed, u, v))
        flat = FlatMesh(np.stack([u, v], axis=1), ring.faces, shifts)
        is_last = done == parameters.rounds + MOST_EXTRA_ROUNDS
        if is_last or (done >= parameters.rounds and (orientations(flat.corners) > 0).all()):
            return flat, springs
        crowding = find_crowding(flat, edges, face_areas)
        springs = Springs(edges, jumps, springs.weights * crowding)
    raise MeshError(f"the number of rounds must be at least 0, not {parameters.rounds}")


def cotangents(faces: Integers, edges: Integers, vertices: Floats) -> Floats:
    """Return for each edge the mean cotangent of the angles opposite to it, at least a little.

    Where the sum is not positive, nothing is guaranteed to be one-to-one, so it is kept above
    `LEAST_WEIGHT`.

    References
    ----------
    Pinkall and Polthier, Computing discrete minimal surfaces and their conjugates, Experimental
    Mathematics 2(1), 1993, doi:10.1080/10586458.1993.10504266.
    """
    n = int(faces.max()) + 1
    total = np.zeros(len(edges))
    for corner in range(3):
        apex, one, other = (vertices[faces[:, (corner + k) % 3]] for k in range(3))
        first, second = one - apex, other - apex
        area = np.linalg.norm(np.cross(first, second), axis=1)
        cotangent = np.einsum("ij,ij->i", first, second) / np.maximum(area, SMALLEST_AREA)
        place = _numbers_of(faces[:, [(corner + 1) % 3, (corner + 2) % 3]], edges, n)
        total += np.bincount(place, cotangent, len(edges))
    return np.clip(total / 2, LEAST_WEIGHT, 1 / LEAST_WEIGHT)


def solve_means(
    springs: Springs, is_fixed: Booleans, u: Floats, v: Floats
) -> tuple[Floats, Floats]:
    """Return u and v with each free vertex the weighted mean of its neighbours; fixed ones as given."""
    acting = ~(is_fixed[springs.edges[:, 0]] & is_fixed[springs.edges[:, 1]])
    i, j = springs.edges[acting].T
    weights, known, n = springs.weights[acting], np.stack([u, v], axis=1), len(is_fixed)
    free = np.flatnonzero(_among(np.concatenate([i, j]), n) & ~is_fixed)
    pull = weights * springs.jumps[acting]
    right = np.zeros((n, 2))
    right[:, 0] = np.bincount(i, pull, n) - np.bincount(j, pull, n)
    for one, other in ((i, j), (j, i)):
        held = is_fixed[other]
        for axis in range(2):
            tension = weights[held] * known[other[held], axis]
            right[:, axis] += np.bincount(one[held], tension, n)
    total = np.asarray(np.bincount(i, weights, n) + np.bincount(j, weights, n), dtype=float)
    solver = factorized(_free_laplacian(i, j, weights, total, free))
    known[free] = solver.solve(right[free])
    return known[:, 0], known[:, 1]


def factorized(positive_definite: sparse.csc_array) -> SuperLU:
    """Return what solves for a symmetric matrix, or one with scaled rows, made from a mesh.

    It needs no pivots, and no wide panels.
    """
    return splu(
        positive_definite,
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        relax=1,
        panel_size=2,
        options={"SymmetricMode": True},
    )


def _free_laplacian(
    i: Integers, j: Integers, weights: Floats, total: Floats, free: Integers
) -> sparse.csc_array:
    """Return the weighted graph Laplacian of edges (i, j), rows and columns of free vertices only."""
    number = np.full(len(total), -1)
    number[free] = np.arange(len(free))
    inner = (number[i] >= 0) & (number[j] >= 0)
    first, second, diagonal = number[i[inner]], number[j[inner]], np.arange(len(free))
    values = np.concatenate([total[free], -weights[inner], -weights[inner]])
    rows = np.concatenate([diagonal, first, second])
    columns = np.concatenate([diagonal, second, first])
    shape = len(free), len(free)
    return sparse.csc_array(sparse.coo_array((values, (rows, columns)), shape))


def mean_matrix(springs: Springs, n_vertices: int) -> tuple[sparse.csr_array, Floats]:
    """Return the (n, n) matrix that takes u and v to weighted means, and what to add to u."""
    i, j = springs.edges.T
    rows, columns = np.concatenate([i, j]), np.concatenate([j, i])
    both = np.concatenate([springs.weights, springs.weights])
    total = np.bincount(rows, both, n_vertices)
    matrix = sparse.csr_array((both / total[rows], (rows, columns)), shape=(n_vertices, n_vertices))
    pull = springs.weights * springs.jumps
    charge = np.bincount(i, pull, n_vertices) - np.bincount(j, pull, n_vertices)
    return matrix, np.asarray(charge / total)


def edge_jumps(ring: Ring) -> tuple[Integers, Integers]:
    """Return the edges, and what to add to u of the second end when seen from the first."""
    edges, _ = unique_edges(ring.faces)
    n = ring.n_vertices
    crossed = _path_of_half_edges(ring)
    jumps = np.zeros(len(edges), dtype=np.int64)
    place = _numbers_of(crossed, edges, n)
    jumps[place] = np.where(crossed[:, 0] < crossed[:, 1], 1, -1)
    around = np.stack([ring.outer, np.roll(ring.outer, -1)], axis=1)
    turns = _jumps_of(around, edges, jumps, n).sum()
    return edges, jumps if turns == 1 else -jumps


def _path_of_half_edges(ring: Ring) -> Integers:
    """Return the half-edges, one per step, through which a path of faces leaves hole for outside.

    Crossing a half-edge (a, b) outwards of its face, a lies on the right.
    """
    m, n = len(ring.faces), ring.n_vertices
    directed = half_edges(ring.faces)
    face = np.tile(np.arange(m), 3)
    key = directed.min(axis=1) * n + directed.max(axis=1)
    order = np.argsort(key)
    one, other = (order[side][np.diff(key[order]) == 0] for side in (np.s_[:-1], np.s_[1:]))
    twin = np.full(len(directed), -1)
    twin[one], twin[other] = other, one
    inner = np.flatnonzero(twin >= 0)
    dual = sparse.coo_array((np.ones(len(inner)), (face[inner], face[twin[inner]])), (m, m))
    on_hole, on_outer = (
        _among(loop, n)[directed].all(axis=1) & (twin < 0) for loop in (ring.hole, ring.outer)
    )
    start = int(face[np.flatnonzero(on_hole)[0]])
    order_reached, before = breadth_first_order(dual.tocsr(), start, directed=False)
    last = int(order_reached[_among(face[on_outer], m)[order_reached]][0])
    first_edge = np.flatnonzero(on_hole & (face == start))[0]
    path = [directed[np.flatnonzero(on_outer & (face == last))[0]]]
    while last != start:
        previous = int(before[last])
        sides = previous + m * np.arange(3)
        leads_on = (twin[sides] >= 0) & (face[twin[sides]] == last)
        path.append(directed[sides[leads_on][-1]])
        last = previous
    path.append(directed[first_edge][::-1])
    return np.array(path)


def _among(chosen: Integers, count: int) -> Booleans:
    """Tell which of the numbers up to `count` are chosen."""
    result = np.zeros(count, dtype=bool)
    result[chosen] = True
    return result


def _jumps_of(directed: Integers, edges: Integers, jumps: Integers, n: int) -> Integers:
    place = _numbers_of(directed, edges, n)
    return np.asarray(np.where(directed[:, 0] < directed[:, 1], jumps[place], -jumps[place]))


def _numbers_of(directed: Integers, edges: Integers, n: int) -> Integers:
    """Return where in the (e, 2) edges, which are in order, each directed edge of them is."""
    firsts = np.searchsorted(edges[:, 0], np.arange(n))
    return _look_up(firsts, np.ascontiguousarray(edges[:, 1]), directed)


@njit(nogil=True, cache=True)
def _look_up(firsts: Integers, ends: Integers, directed: Integers) -> Integers:
    """Go through the few edges that begin where an edge does, to the one that ends where it does."""
    places = np.zeros(len(directed), dtype=np.int64)
    for k in range(len(directed)):
        low, high = min(directed[k, 0], directed[k, 1]), max(directed[k, 0], directed[k, 1])
        place = firsts[low]
        while place < len(ends) and ends[place] != high:
            place += 1
        places[k] = place
    return places


def _corner_shifts(faces: Integers, edges: Integers, jumps: Integers) -> Integers:
    n = int(faces.max()) + 1
    shifts = np.zeros_like(faces)
    for corner in (1, 2):
        shifts[:, corner] = _jumps_of(faces[:, [0, corner]], edges, jumps, n)
    return shifts


def _boundary_values(ring: Ring, edges: Integers, jumps: Integers) -> tuple[Floats, Floats]:
    """Return u and v with both boundaries set, u shifted by whole turns to suit the jumps."""
    u, v = np.zeros(ring.n_vertices), np.zeros(ring.n_vertices)
    for loop, given in ((ring.outer, ring.outer_u), (ring.hole, ring.hole_u)):
        step = wrapped(np.diff(given))
        crossed = _jumps_of(np.stack([loop[:-1], loop[1:]], axis=1), edges, jumps, ring.n_vertices)
        u[loop] = given[0] + np.concatenate([[0.0], np.cumsum(step - crossed)])
    v[ring.outer] = 1.0
    return u, v


def find_crowding(flat: FlatMesh, edges: Integers, face_areas: Floats) -> Floats:
    """Return for each edge how much flat area its faces have for their area on the surface.

    Springs weakened where the flat faces are crowded let them grow (Yoshizawa, Belyaev, Seidel).
    """
    n = int(flat.faces.max()) + 1
    flat_areas = np.maximum(signed_areas(flat.corners), SMALLEST_AREA)
    ratio = np.log(flat_areas / flat_areas.sum()) - np.log(face_areas / face_areas.sum())
    edge = _numbers_of(half_edges(flat.faces), edges, n)
    total = np.bincount(edge, np.tile(ratio, 3), len(edges))
    mean = total / np.bincount(edge, minlength=len(edges))
    return np.asarray(np.exp(np.clip(mean / 2, -STRONGEST_CHANGE, STRONGEST_CHANGE)))


def _least_twisted(springs: Springs, u: Floats, v: Floats) -> tuple[Floats, Floats]:
    """Turn the hole by the whole turns that make the sum of squared edges in u least.

    Adding m turns at the hole adds m (1 - v) to the solution, so the best m is closed form.
    """
    i, j = springs.edges.T
    along, across = u[j] + springs.jumps - u[i], v[i] - v[j]
    pull = springs.weights * across
    turns = np.round(-(pull @ along) / (pull @ across))
    return u + turns * (1 - v), v


def _pass_means(
    ring: Ring,
    edges: Integers,
    jumps: Integers,
    is_fixed: Booleans,
    u: Floats,
    v: Floats,
    passes: int,
    report: Report,
) -> tuple[Floats, Floats]:
    """Take the paper's averaging passes, from where every vertex lies at its nearest boundary."""
    if passes < 0:
        raise MeshError(f"the number of flattening passes must be at least 0, not {passes}")
    n = ring.n_vertices
    matrix = averaging_matrix(ring.faces, n)
    i, j = edges.T
    to_second = np.asarray(matrix[i, j]).ravel()
    to_first = np.asarray(matrix[j, i]).ravel()
    charge = np.bincount(i, to_second * jumps, n) - np.bincount(j, to_first * jumps, n)
    u, v = _nearest_boundary(ring, edges, jumps, u, v)
    fixed_u, fixed_v = u[is_fixed], v[is_fixed]
    for done in range(passes):
        if done % 25 == 0:
            report(done / passes, "flattening")
        u, v = matrix @ u + charge, matrix @ v
        u[is_fixed], v[is_fixed] = fixed_u, fixed_v
    return u, v


def _nearest_boundary(
    ring: Ring, edges: Integers, jumps: Integers, u: Floats, v: Floats
) -> tuple[Floats, Floats]:
    n = ring.n_vertices
    i, j = edges.T
    graph = sparse.coo_array((np.ones(len(edges)), (i, j)), (n, n)).tocsr()
    loops = np.concatenate([ring.outer, ring.hole])
    distance, before, _ = dijkstra(
        graph,
        directed=False,
        indices=loops,
        min_only=True,
        unweighted=True,
        return_predecessors=True,
    )
    inner = np.setdiff1d(np.arange(n), loops)
    inner = inner[np.argsort(distance[inner], kind="stable")]
    steps = np.stack([inner, before[inner]], axis=1)
    for vertex, previous, jump in zip(*steps.T, _jumps_of(steps, edges, jumps, n), strict=True):
        u[vertex], v[vertex] = u[previous] + jump, v[previous]
    return u, v
