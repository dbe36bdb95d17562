"""Points near one surface carried to another that has the same faces."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flyreg_core.mesh import SurfaceMesh
from flyreg_core.transform import transform_points
from tests.shapes import sphere, torus


@given(seed=st.integers(0, 2**32 - 1))
def test_a_rigid_move_of_the_surface_moves_points_alike(seed: int) -> None:
    rng = np.random.default_rng(seed)
    start = SurfaceMesh(*torus())
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    end = SurfaceMesh(start.vertices @ turn.T + [5, -7, 11], start.faces)
    points = start.vertices[rng.integers(len(start.vertices), size=20)] * 1.01
    moved = transform_points(points, start, end)
    assert moved.is_mapped.all()
    nearest_vertex = np.abs(moved.points - (points @ turn.T + [5, -7, 11])).max()
    assert nearest_vertex < 0.5  # normals are interpolated, so off the surface it is not exact


def test_points_on_the_surface_go_to_the_same_place_of_the_same_face() -> None:
    start = SurfaceMesh(*sphere(100.0))
    end = SurfaceMesh(start.vertices * [1, 2, 3] + 4, start.faces)
    middles = start.vertices[start.faces].mean(axis=1)
    moved = transform_points(middles, start, end)
    assert np.allclose(moved.points, end.vertices[end.faces].mean(axis=1))


def test_the_signed_distance_from_the_surface_is_kept() -> None:
    start = SurfaceMesh(*sphere(100.0, 4))
    end = SurfaceMesh(start.vertices * 2, start.faces)
    for offset in (-3.0, 4.0):
        moved = transform_points(start.vertices * (1 + offset / 100), start, end)
        assert np.allclose(np.linalg.norm(moved.points, axis=1), 200 + offset, atol=0.1)


def test_there_and_back_is_where_it_started() -> None:
    start = SurfaceMesh(*sphere(100.0, 4))
    end = SurfaceMesh(start.vertices * [1.5, 1.2, 0.9], start.faces)
    there = transform_points(start.vertices, start, end)
    assert np.allclose(transform_points(there.points, end, start).points, start.vertices)


@pytest.mark.parametrize(("reach", "is_mapped"), [(4.0, False), (6.0, True)])
def test_points_beyond_reach_are_left_out_and_none_is_dropped(
    reach: float, is_mapped: bool
) -> None:
    start = SurfaceMesh(*sphere(100.0, 4))
    moved = transform_points(np.array([[105.0, 0, 0], [100.0, 0, 0]]), start, start, reach)
    assert moved.is_mapped.tolist() == [is_mapped, True]
    assert np.isnan(moved.points[0]).all() != is_mapped
