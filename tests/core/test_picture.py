"""Pictures drawn without a window: what is where, what hides what, and the colours of quantities."""

from __future__ import annotations

import io

import matplotlib
import numpy as np
import pytest
from PIL import Image

from flyreg_core.color_maps import VIRIDIS, colors_of
from flyreg_core.frame import BrainFrame
from flyreg_core.mesh import SurfaceMesh
from flyreg_core.picture import (
    MARGIN,
    View,
    axes_of,
    blended,
    draw_flat,
    draw_surface,
    on_background,
    png_bytes,
    view_of,
    views_of,
    webp_bytes,
)
from tests.shapes import sphere, together, torus

RED, BLUE = (200, 30, 30), (30, 30, 200)
FRAME = BrainFrame(np.zeros(3), np.eye(3))
SIZE = (120, 80)


def view_along_z(um_per_pixel: float = 1.0) -> View:
    return View(np.eye(3), np.zeros(3), um_per_pixel)


def ball(center: tuple[float, float, float], radius: float = 10.0) -> tuple[np.ndarray, np.ndarray]:
    vertices, faces = sphere(radius, 4)
    return vertices + center, faces


def place_of(picture: np.ndarray, color: tuple[int, int, int]) -> np.ndarray:
    """Return the mean column and row of what has the hue of a colour."""
    is_shown = (picture[..., 3] > 128) & (picture[..., :3].argmax(axis=-1) == np.argmax(color))
    return np.argwhere(is_shown).mean(axis=0)[::-1]


def test_a_ball_covers_the_area_of_a_disc() -> None:
    picture = draw_surface(SurfaceMesh(*ball((0, 0, 0), 30)), RED, view_along_z(), SIZE)
    assert picture.shape == (80, 120, 4)
    assert picture[..., 3].sum() / 255 == pytest.approx(np.pi * 30**2, rel=0.01)
    assert place_of(picture, RED) == pytest.approx([59.5, 39.5], abs=0.2)


def test_what_is_nearer_hides_what_is_behind_it_whichever_is_drawn_first() -> None:
    near, far = ball((0, 0, 50)), ball((0, 0, -50), 20)
    for first, second, colors in ((near, far, (RED, BLUE)), (far, near, (BLUE, RED))):
        both = SurfaceMesh(*together(first, second))
        painted = np.repeat(np.array(colors, np.uint8), len(both.vertices) // 2, axis=0)
        picture = draw_surface(both, painted, view_along_z(), SIZE)
        assert picture[40, 60, :3].argmax() == 0
        assert picture[40, 75, :3].argmax() == 2


def test_turning_a_surface_inside_out_changes_nothing() -> None:
    vertices, faces = torus()
    outside, inside = SurfaceMesh(vertices, faces), SurfaceMesh(vertices, faces[:, ::-1])
    pictures = [draw_surface(each, RED, view_along_z(6.0), SIZE) for each in (outside, inside)]
    assert np.abs(pictures[0].astype(int) - pictures[1]).max() <= 1


@pytest.mark.parametrize("is_mirrored", [False, True])
def test_views_show_the_animal_as_the_field_draws_it(is_mirrored: bool) -> None:
    frame = FRAME.mirrored() if is_mirrored else FRAME
    left, ventral, posterior = frame.axes
    for side, at_the_right, above, nearest in (
        ("front", left, -ventral, -posterior),
        ("back", -left, -ventral, posterior),
        ("top", left, posterior, -ventral),
    ):
        right, up, towards = axes_of(frame, side)  # type: ignore[arg-type]
        mirrored = -1 if is_mirrored else 1  # the picture is of the file, not of the animal
        assert right == pytest.approx(mirrored * at_the_right)
        assert up == pytest.approx(above)
        assert towards == pytest.approx(nearest)


def test_a_view_shows_everything_and_little_more() -> None:
    points = np.random.default_rng(1).normal(size=(200, 3)) * [300, 100, 50]
    views = views_of(points, FRAME, SIZE)
    assert len({view.um_per_pixel for view in views.values()}) == 1
    for view in views.values():
        pixels = view.pixels(points, SIZE)
        assert (pixels >= 0).all()
        assert (pixels <= SIZE).all()
    front = views["front"].pixels(points, SIZE)
    assert np.ptp(front, axis=0)[0] == pytest.approx(SIZE[0] / MARGIN)


def test_places_in_the_picture_are_where_the_surface_is_drawn() -> None:
    middle = (20.0, -15.0, 3.0)
    surface = SurfaceMesh(*together(ball(middle), ball((-70.0, 40.0, 0.0))))
    view = view_of(surface.vertices, axes_of(FRAME, "back"), SIZE)
    colors = np.repeat(np.array([RED, BLUE], np.uint8), len(surface.vertices) // 2, axis=0)
    picture = draw_surface(surface, colors, view, SIZE)
    assert place_of(picture, RED) + 0.5 == pytest.approx(
        view.pixels(np.array([middle]), SIZE)[0], abs=0.3
    )


def test_flat_triangles_are_as_bright_as_their_colours() -> None:
    plane = np.array([[-1.0, -1.0], [1.0, -1.0], [0.0, 1.0]])
    picture = draw_flat(plane, np.array([[0, 2, 1]]), RED, (2.0, 2.0), (100, 100))
    shown = picture[picture[..., 3] == 255]
    assert (shown[:, :3] == RED).all()
    assert picture[..., 3].sum() / 255 == pytest.approx(100**2 / 2 / MARGIN**2, rel=0.01)


def test_two_pictures_laid_over_each_other_mix_where_both_are() -> None:
    plane = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    left, right = (
        draw_flat(plane * [0.5, 0.5] + [shift, 0], faces, color, (2, 2), (100, 100), samples=1)
        for shift, color in ((-0.2, RED), (0.2, BLUE))
    )
    mixed = blended([left, right], [0.5, 0.5])
    assert tuple(mixed[50, 50]) == (115, 30, 115, 255)
    assert tuple(mixed[50, 24]) == (*RED, 255)
    assert mixed[0, 0, 3] == 0


def test_files_hold_the_picture() -> None:
    picture = draw_surface(SurfaceMesh(*ball((0, 0, 0))), RED, view_along_z(), SIZE)
    assert (np.array(Image.open(io.BytesIO(png_bytes(picture)))) == picture).all()
    small = np.array(Image.open(io.BytesIO(webp_bytes(picture))).convert("RGBA"))
    assert (small[..., 3] == picture[..., 3]).all()
    assert len(webp_bytes(picture)) < len(png_bytes(picture))
    seen = picture[..., 3] == 255
    assert np.abs(small[seen].astype(int) - picture[seen]).mean() < 4
    plain = on_background(picture, (1, 2, 3))
    assert tuple(plain[0, 0]) == (1, 2, 3)
    assert (np.array(Image.open(io.BytesIO(png_bytes(plain)))) == plain).all()


def test_the_colours_of_quantities_are_those_of_viridis() -> None:
    shares = np.linspace(0, 1, 500)
    expected = matplotlib.colormaps["viridis"](shares)[:, :3] * 255
    assert np.abs(VIRIDIS(shares) - expected).max() < 8
    grey = VIRIDIS(shares) @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(grey) > -1).all()
    assert np.ptp(grey) > 180


def test_values_beyond_the_ends_have_the_colours_of_the_ends() -> None:
    colors = colors_of(np.array([-5.0, 1.0, 2.0, 3.0, 9.0]), 1.0, 3.0)
    assert (colors[0] == colors[1]).all()
    assert (colors[3] == colors[4]).all()
    assert (colors_of(np.full(4, 7.0), 7.0, 7.0) == VIRIDIS.anchors[0]).all()
