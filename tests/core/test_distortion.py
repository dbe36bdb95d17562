import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from flyreg_core.color_maps import BLUE_BROWN, VIRIDIS
from flyreg_core.distortion import log_area_ratios, log_dilatations, to_vertices
from flyreg_core.vertex_quantities import quantity_named, summarize

SEEDS = st.integers(0, 2**32 - 1)


def random_triangles(rng, dimension):
    return rng.normal(size=(30, 3, dimension))


def in_space(rng, corners):
    """Triangles of the plane, each turned and shifted somewhere in space."""
    raised = np.concatenate([corners, np.zeros((*corners.shape[:2], 1))], axis=-1)
    turns = Rotation.random(len(corners), random_state=int(rng.integers(2**31)))
    return np.einsum("mij,mkj->mki", turns.as_matrix(), raised) + rng.normal(size=(30, 1, 3))


@given(seed=SEEDS, scale=st.floats(0.01, 100))
def test_similar_triangles_differ_in_area_by_the_square_of_their_scale_and_not_in_angles(
    seed, scale
):
    rng = np.random.default_rng(seed)
    flat = random_triangles(rng, 2)
    placed = in_space(rng, scale * flat)
    np.testing.assert_allclose(log_area_ratios(flat, placed), 2 * np.log2(scale), atol=1e-6)
    # 1 + x²/2 is rounded near x = 0: half the digits are left of a dilatation of 1
    np.testing.assert_allclose(log_dilatations(flat, placed), 0, atol=1e-4)
    mirrored = placed * [1, 1, -1]
    np.testing.assert_allclose(log_dilatations(placed, mirrored), 0, atol=1e-4)


@given(seed=SEEDS)
def test_a_linear_map_stretches_as_its_singular_values_say(seed):
    rng = np.random.default_rng(seed)
    flat, matrix = random_triangles(rng, 2), rng.normal(size=(2, 2))
    long, wide = np.linalg.svd(matrix, compute_uv=False)
    moved = in_space(rng, flat @ matrix.T)
    np.testing.assert_allclose(log_area_ratios(flat, moved), np.log2(long * wide), atol=1e-4)
    np.testing.assert_allclose(log_dilatations(flat, moved), np.log2(long / wide), atol=1e-3)


@pytest.mark.parametrize("shear", [0.1, 1.0, 2.0])
def test_a_shear_keeps_areas_and_stretches_by_the_known_amount(shear):
    flat = np.array([[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]])
    sheared = flat @ np.array([[1.0, shear], [0.0, 1.0]]).T
    assert log_area_ratios(flat, sheared)[0] == pytest.approx(0, abs=1e-12)
    stretch = shear / 2 + np.hypot(1, shear / 2)  # the larger singular value; the other is 1 / it
    assert log_dilatations(flat, sheared)[0] == pytest.approx(2 * np.log2(stretch))


@given(seed=SEEDS)
def test_areas_add_up_over_stages_and_angles_at_most(seed):
    rng = np.random.default_rng(seed)
    first, second, third = (random_triangles(rng, 2) for _ in range(3))
    areas = log_area_ratios(first, second) + log_area_ratios(second, third)
    np.testing.assert_allclose(areas, log_area_ratios(first, third), atol=1e-9)
    angles = log_dilatations(first, second) + log_dilatations(second, third)
    assert (log_dilatations(first, third) <= angles + 1e-6).all()


def test_a_vertex_takes_the_weighted_mean_of_its_faces_and_nothing_without_faces():
    faces = np.array([[0, 1, 2], [2, 1, 3]])
    values = to_vertices(np.array([1.0, 4.0]), faces, np.array([2.0, 1.0]), 5)
    np.testing.assert_allclose(values[:4], [1, 2, 2, 4])
    assert np.isnan(values[4])


@given(seed=SEEDS)
def test_a_summary_counts_areas(seed):
    """A vertex of area 3 counts as three of area 1 do; what has no value does not count."""
    rng = np.random.default_rng(seed)
    values, areas = rng.normal(size=50), rng.integers(1, 5, 50)
    one = summarize(np.append(values, np.nan), np.append(areas, 9.0), quantity_named("spline_area"))
    many = np.repeat(values, areas)
    assert one.mean == pytest.approx(many.mean())
    assert one.rms == pytest.approx(np.sqrt((many**2).mean()))
    assert one.largest == np.abs(many).max()
    assert (np.abs(many) <= one.p95).mean() >= 0.95 - 1e-9
    assert (np.abs(many) < one.p95).mean() <= 0.95 + 1e-9
    assert one.low == -one.high
    assert one.shares.sum() == pytest.approx(1)


def lightness(colors):
    """Of (n, 3) sRGB colours, in Oklab."""
    linear = np.where(
        colors / 255 <= 0.04045, colors / 255 / 12.92, ((colors / 255 + 0.055) / 1.055) ** 2.4
    )
    to_cones = [
        [0.4122214708, 0.5363325363, 0.0514459929],
        [0.2119034982, 0.6806995451, 0.1073969566],
        [0.0883024619, 0.2817188376, 0.6299787005],
    ]
    return np.cbrt(linear @ np.transpose(to_cones)) @ [0.2104542553, 0.7936177850, -0.0040720468]


def test_even_steps_of_a_value_are_even_steps_of_lightness():
    """So they stay in order for the colour-blind and in grey; the signed map goes down to both sides."""
    steps = np.diff(lightness(VIRIDIS(np.linspace(0, 1, 17))))
    assert (steps > 0).all()
    light = lightness(BLUE_BROWN(np.linspace(0, 1, 17)))
    np.testing.assert_allclose(light, light[::-1], atol=0.01)
    np.testing.assert_allclose(np.diff(light)[:8], np.diff(light)[:8].mean(), atol=0.01)
