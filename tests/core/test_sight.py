import numpy as np
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from flyreg_core.mesh import SurfaceMesh
from flyreg_core.sight import look

SEEDS = st.integers(0, 2**32 - 1)


def first_of_all_faces(surface, start, direction):
    """The first face on a line and its distance, by solving for each face (another route)."""
    a, b, c = (surface.vertices[surface.faces[:, i]] for i in range(3))
    system = np.stack([b - a, c - a, np.broadcast_to(-direction, a.shape)], axis=-1)
    solution = np.linalg.solve(system, (start - a)[..., None])[..., 0]
    v, w, distance = solution.T
    distance = np.where((v >= 0) & (w >= 0) & (v + w <= 1), distance, np.inf)
    face = int(np.argmin(distance))
    return face, float(distance[face])


def random_surface(rng):
    mesh = trimesh.creation.icosphere(subdivisions=3)
    bumps = 1 + 0.3 * np.sin(rng.uniform(1, 5, 3) * mesh.vertices).sum(axis=1)
    return SurfaceMesh(mesh.vertices * bumps[:, None] * 100, mesh.faces)


@settings(max_examples=8)
@given(seed=SEEDS)
def test_a_line_of_sight_meets_the_first_of_all_faces(seed):
    rng = np.random.default_rng(seed)
    surface = random_surface(rng)
    start = rng.normal(size=3)
    start *= 500 / np.linalg.norm(start)
    goals = rng.uniform(-150, 150, (20, 3))
    for goal in goals:
        direction = (goal - start) / np.linalg.norm(goal - start)
        seen = look(surface, start, direction)
        face, distance = first_of_all_faces(surface, start, direction)
        if seen is None:
            assert distance == np.inf
            continue
        assert abs(seen.distance - distance) < 1e-6
        assert seen.face == face
        assert seen.is_front
        np.testing.assert_allclose(seen.point, start + distance * direction, atol=1e-6)
        corners = surface.vertices[surface.faces[seen.face]]
        np.testing.assert_allclose(seen.barycentric @ corners, seen.point, atol=1e-9)


def test_looked_at_from_inside_or_behind_a_clip_a_surface_shows_its_back():
    surface = random_surface(np.random.default_rng(1))
    ahead = np.array([0.0, 0.0, 1.0])
    before = look(surface, np.array([0.0, 0.0, -1000.0]), ahead)
    behind_the_clip = look(surface, np.array([0.0, 0.0, -1000.0]), ahead, nearest=1000.0)
    assert before is not None
    assert behind_the_clip is not None
    assert before.is_front
    assert not behind_the_clip.is_front
    assert before.distance < 1000 < behind_the_clip.distance
    assert look(surface, np.array([0.0, 0.0, -1000.0]), ahead, farthest=500.0) is None


def test_no_line_slips_between_faces():
    """Lines through the vertices and the middles of the edges of a closed surface all meet it."""
    surface = random_surface(np.random.default_rng(2))
    middles = surface.vertices[surface.faces[:, :2]].mean(axis=1)
    for goal in np.concatenate([surface.vertices, middles])[::7]:
        direction = goal / np.linalg.norm(goal)
        seen = look(surface, np.zeros(3), direction, nearest=0.0)
        assert seen is not None
        assert abs(seen.distance - np.linalg.norm(goal)) < 1e-6
