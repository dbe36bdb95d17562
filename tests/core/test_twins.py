"""The twin of a landmark: mirrored in the animal's midplane, on both brains."""

import numpy as np
import pytest

from flyreg_core.frame import LEFT_RIGHT
from flyreg_core.landmarks import LandmarkPair
from flyreg_core.surface_places import find_places
from flyreg_core.twins import twin_name, twin_of


@pytest.fixture
def brain(demo_source):
    return demo_source.flat


def on_surface(brain, number):
    return tuple(brain.dissection.surface.vertices[number].tolist())


@pytest.mark.parametrize(
    ("name", "twin"),
    [
        ("AL_L", "AL_R"),
        ("left calyx", "right calyx"),
        ("tip (R)", "tip (L)"),
        ("Left and right", "Right and left"),
        ("calyx", "calyx mirrored"),
        ("LAL", "LAL mirrored"),
    ],
)
def test_the_twin_has_the_name_of_the_other_side(name, twin):
    assert twin_name(name) == twin


@pytest.mark.parametrize("number", [10, 500, 900])
def test_a_place_on_the_surface_goes_to_the_surface_place_nearest_to_its_mirror_image(
    brain, number
):
    pair = LandmarkPair("a", "AL_L", "interior", None, on_surface(brain, number), None)
    twin = twin_of(pair, brain, brain)
    image = brain.frame.coordinates(np.array(pair.source))
    image[LEFT_RIGHT] *= -1
    surface = brain.dissection.surface
    away = np.linalg.norm(np.array(twin.source) - brain.frame.points(image))
    assert find_places(np.array([twin.source]), surface).apart_um[0] < 1e-9
    assert away <= np.linalg.norm(surface.vertices - brain.frame.points(image), axis=1).min() + 1e-9
    assert twin.target is None
    assert twin.name == "AL_R"


@pytest.mark.parametrize(
    ("kind", "half", "other", "share"),
    [
        ("upper", None, "upper", 0.75),
        ("hole", None, "hole", 0.75),
        ("left", "anterior", "right", 0.25),
        ("right", "posterior", "left", 0.25),
    ],
)
def test_a_place_on_a_curve_goes_to_the_other_side_of_the_animal(brain, kind, half, other, share):
    twin = twin_of(LandmarkPair("a", "a", kind, half, 0.25, 0.25), brain, brain)
    assert (twin.kind, twin.half) == (other, half)
    assert twin.source == twin.target == pytest.approx(share)


def test_the_twin_of_a_twin_is_back_on_the_curve(brain):
    pair = LandmarkPair("a", "tip L", "upper", None, 0.3, 0.4)
    back = twin_of(twin_of(pair, brain, brain), brain, brain)
    assert (back.source, back.target) == (pytest.approx(0.3), pytest.approx(0.4))
    assert back.name == "tip L"
