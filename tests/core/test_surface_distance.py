import numpy as np
import pymeshlab
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from flyreg_core.errors import Cancelled
from flyreg_core.mesh import SurfaceMesh
from flyreg_core.progress import ignore
from flyreg_core.surface_distance import (
    PERCENTILES,
    distances_of_vertices,
    distances_to_surface,
    measure_distances,
    sample_surface,
)
from tests.shapes import box, sphere, together, torus

SEEDS = st.integers(0, 2**32 - 1)
SAMPLES = 5_000


def square(height, side=10.0, offset=0.0):
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]]) * side + [offset, 0, height]
    return SurfaceMesh(corners, np.array([[0, 1, 2], [0, 2, 3]]))


def measured(a, b):
    return measure_distances(a, b, ignore, SAMPLES)


def random_surface(seed):
    vertices, faces = torus(around=9, across=7)
    rng = np.random.default_rng(seed)
    return SurfaceMesh(vertices + rng.normal(scale=40, size=vertices.shape), faces)


def distance_to_triangle(point, corners):
    """By the closest point of the plane if it is inside, else of the three sides."""
    a, b, c = corners
    normal = np.cross(b - a, c - a)
    foot = point - normal * (normal @ (point - a)) / (normal @ normal)
    inside = all(np.cross(q - p, foot - p) @ normal >= 0 for p, q in ((a, b), (b, c), (c, a)))
    candidates = [foot] if inside else []
    for p, q in ((a, b), (b, c), (c, a)):
        along = np.clip((point - p) @ (q - p) / ((q - p) @ (q - p)), 0, 1)
        candidates.append(p + along * (q - p))
    return min(np.linalg.norm(point - candidate) for candidate in candidates)


def test_a_surface_is_no_distance_from_itself():
    surface = SurfaceMesh(*torus())
    result = measured(surface, surface)
    for summary in (result.a_to_b, result.b_to_a):
        assert summary.hausdorff_um <= 1e-9 * surface.diagonal
        assert summary.mean_um <= summary.rms_um <= summary.hausdorff_um


def test_parallel_squares_are_their_distance_apart():
    result = measured(square(0.0), square(3.0))
    for summary in (result.a_to_b, result.b_to_a):
        assert summary.mean_um == pytest.approx(3.0)
        assert summary.rms_um == pytest.approx(3.0)
        assert summary.hausdorff_um == pytest.approx(3.0)


def test_a_square_beside_another_is_as_far_as_integrals_say():
    # the distance runs evenly from 5 to 15
    result = measured(square(0.0, offset=15.0), square(0.0))
    assert result.a_to_b.mean_um == pytest.approx(10.0, abs=0.05)
    assert result.a_to_b.rms_um == pytest.approx(np.sqrt((15**3 - 5**3) / 30), abs=0.05)
    assert result.a_to_b.hausdorff_um == pytest.approx(15.0)


def test_the_two_directions_differ_where_one_surface_reaches_farther():
    small, large = square(1.0, side=4.0), square(0.0, side=10.0)
    result = measured(small, large)
    assert result.a_to_b.hausdorff_um == pytest.approx(1.0)
    assert result.b_to_a.hausdorff_um == pytest.approx(np.sqrt(36 + 36 + 1))


def test_what_is_known_of_a_square_beside_another_is_met_within_the_stated_error():
    # the distance runs evenly from 5 to 15: each percentile is known, and so is the spread
    result = measured(square(0.0, offset=15.0), square(0.0)).a_to_b
    assert result.standard_error_um == pytest.approx(10 / np.sqrt(12 * SAMPLES), rel=0.05)
    assert abs(result.mean_um - 10.0) < 3 * result.standard_error_um
    for percent, found in zip(PERCENTILES, result.percentiles_um, strict=True):
        assert found == pytest.approx(5 + percent / 10, abs=0.2)


def test_a_shifted_cube_is_as_far_as_geometry_says():
    half, shift = 50.0, 10.0
    cube = SurfaceMesh(*box((2 * half,) * 3))
    moved = SurfaceMesh(*box((2 * half,) * 3, (shift, 0.0, 0.0)))
    ahead = shift  # the side that goes first leaves the other cube
    inside = half / 3 * (1 - (1 - shift / half) ** 3)  # the last side lies in it, nearer to its rim
    slid = shift**2 / (4 * half)  # four slide along themselves, partly over the end
    result = measured(moved, cube)
    for summary in (result.a_to_b, result.b_to_a):
        assert summary.hausdorff_um == pytest.approx(shift)
        away = summary.mean_um - (ahead + inside + 4 * slid) / 6
        assert abs(away) < 3 * summary.standard_error_um
        assert summary.standard_error_um < 0.07


def test_exchanging_the_surfaces_exchanges_the_directions():
    a, b = random_surface(1), random_surface(2)
    one, other = measured(a, b), measured(b, a)
    assert (one.a_to_b, one.b_to_a) == (other.b_to_a, other.a_to_b)
    assert one.diagonal_um == pytest.approx(np.linalg.norm(np.ptp(b.vertices, axis=0)))
    assert other.diagonal_um == pytest.approx(np.linalg.norm(np.ptp(a.vertices, axis=0)))


def test_concentric_spheres_are_the_difference_of_their_radii_apart():
    inner, outer = (SurfaceMesh(*sphere(radius, rounds=5)) for radius in (90.0, 100.0))
    result = measured(inner, outer)
    height = np.einsum("ij,ij->i", outer.vertices[outer.faces[:, 0]], outer.face_normals)
    least = (height / outer.face_areas / 2).min() / 10  # faces lie deeper than their corners
    assert least == pytest.approx(10, abs=0.02)
    for summary in (result.a_to_b, result.b_to_a):
        lengths = (summary.mean_um, summary.rms_um, *summary.percentiles_um, summary.hausdorff_um)
        for length in lengths:
            assert least <= length <= 10 + 1e-9


@given(seed=SEEDS)
@settings(max_examples=10)
def test_each_distance_is_to_the_closest_point_of_all_triangles(seed):
    surface = random_surface(seed)
    points = np.random.default_rng(seed).normal(scale=200, size=(10, 3))
    triangles = surface.vertices[surface.faces]
    expected = [min(distance_to_triangle(point, t) for t in triangles) for point in points]
    found = distances_to_surface(points, surface, ignore)
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-9)


def by_meshlab(a, b, samples):
    """What MeshLab, which descends from METRO, finds with points drawn at random by area."""
    meshes = pymeshlab.MeshSet()
    for surface in (a, b):
        meshes.add_mesh(pymeshlab.Mesh(surface.vertices, surface.faces.astype(np.int32)))
    return meshes.get_hausdorff_distance(
        sampledmesh=0,
        targetmesh=1,
        samplenum=samples,
        samplevert=samples == 0,
        sampleface=samples > 0,
        maxdist=pymeshlab.PercentageValue(100),
    )


@pytest.mark.parametrize("direction", ["forth", "back"])
def test_the_figures_are_those_of_meshlab_within_half_a_per_cent(direction):
    a, b = random_surface(1), random_surface(2)
    if direction == "back":
        a, b = b, a
    own = measure_distances(a, b, ignore, 100_000).a_to_b
    other = by_meshlab(a, b, 600_000)
    assert own.mean_um == pytest.approx(other["mean"], rel=0.005)
    assert own.rms_um == pytest.approx(other["RMS"], rel=0.005)
    farthest = max(other["max"], by_meshlab(a, b, 0)["max"])
    assert own.hausdorff_um == pytest.approx(farthest, rel=0.005)


def test_the_summary_is_that_of_distances_by_another_library():
    a, b = random_surface(1), random_surface(2)
    points = sample_surface(a, SAMPLES, a.tree.face)
    _, away, _ = trimesh.proximity.closest_point(
        trimesh.Trimesh(b.vertices, b.faces, process=False), np.vstack([points, a.vertices])
    )
    result = measured(a, b).a_to_b
    assert result.mean_um == pytest.approx(away[:SAMPLES].mean())
    assert result.rms_um == pytest.approx(np.sqrt(np.mean(away[:SAMPLES] ** 2)))
    assert result.hausdorff_um == pytest.approx(away.max())


@given(seed=SEEDS)
@settings(max_examples=20)
def test_no_point_is_farther_than_from_the_nearest_vertex(seed):
    surface = random_surface(seed)
    points = np.random.default_rng(seed).normal(scale=200, size=(200, 3))
    nearest, _ = cKDTree(surface.vertices).query(points)
    assert (distances_to_surface(points, surface, ignore) <= nearest + 1e-9).all()


def test_the_mean_does_not_depend_on_how_densely_a_surface_is_meshed():
    coarse, target = SurfaceMesh(*box()), SurfaceMesh(*sphere(400.0, rounds=4))
    mesh = trimesh.Trimesh(*box(), process=False).subdivide().subdivide()
    uneven = together((mesh.vertices, mesh.faces))
    one = measured(coarse, target).a_to_b.mean_um
    assert measured(SurfaceMesh(*uneven), target).a_to_b.mean_um == pytest.approx(one, rel=0.005)


@given(seed=SEEDS)
@settings(max_examples=20)
def test_each_face_has_samples_in_proportion_to_its_area(seed):
    surface = random_surface(seed)
    order = surface.tree.face
    points = sample_surface(surface, SAMPLES, order)
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    share = np.cumsum(surface.face_areas[order]) / surface.face_areas.sum()
    # face by face in order, so the first n faces hold their share of the points to within one
    corners = order[np.searchsorted(share, (np.arange(SAMPLES) + 0.5) / SAMPLES)]
    on = trimesh.triangles.points_to_barycentric(mesh.triangles[corners], points)
    assert (np.abs(on).max(axis=1) < np.inf).all()
    inside = (on > -1e-6).all(axis=1)
    assert inside.mean() > 1 - 2 * len(surface.faces) / SAMPLES


def test_colours_of_vertices_tell_the_distance_of_the_faces_around_them():
    large, small = square(0.0, side=20.0), square(3.0, side=20.0)
    assert distances_of_vertices(small, large, ignore) == pytest.approx([3.0] * 4)
    ball = SurfaceMesh(*sphere(100.0, rounds=5))
    fine = SurfaceMesh(*sphere(100.0, rounds=2))  # its corners lie on the ball, its faces within
    away = distances_of_vertices(fine, ball, ignore)
    areas = np.bincount(fine.faces.reshape(-1), np.repeat(fine.face_areas / 3, 3))
    mean = measure_distances(fine, ball, ignore, SAMPLES).a_to_b.mean_um
    assert areas @ away / areas.sum() == pytest.approx(mean, rel=0.1)
    assert away.min() > 1.0


def test_vertices_without_faces_have_the_colour_of_no_distance():
    a = square(3.0)
    stray = SurfaceMesh(np.vstack([a.vertices, [[0, 0, 1000.0]]]), a.faces)
    assert distances_of_vertices(stray, square(0.0), ignore) == pytest.approx([3.0] * 4 + [0.0])


def test_samples_lie_on_the_surface():
    surface = random_surface(3)
    points = sample_surface(surface, 1000)
    assert distances_to_surface(points, surface, ignore).max() < 1e-9 * surface.diagonal


def test_samples_are_spread_evenly_within_a_face():
    points = sample_surface(square(0.0, side=1.0), 20_000)
    counts, _, _ = np.histogram2d(points[:, 0], points[:, 1], bins=4)
    assert counts == pytest.approx(20_000 / 16, rel=0.15)


def test_vertices_that_no_face_uses_do_not_count():
    a, b = square(0.0), square(3.0)
    stray = SurfaceMesh(np.vstack([a.vertices, [[0, 0, 1000.0]]]), a.faces)
    assert measured(stray, b).a_to_b.hausdorff_um == pytest.approx(3.0)


def test_the_same_call_gives_the_same_figures():
    a, b = random_surface(1), random_surface(2)
    assert measured(a, b) == measured(a, b)


def test_measuring_can_be_cancelled():
    def report(fraction, text):
        if fraction >= 0.5:
            raise Cancelled

    with pytest.raises(Cancelled):
        measure_distances(square(0.0), square(1.0), report, SAMPLES)
