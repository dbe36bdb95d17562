"""A brain is prepared the same however it lies in its file, however large, mirrored or not."""

import numpy as np
import pytest

from flyreg_core.brain_files import open_brain, read_brain
from flyreg_core.mesh import SurfaceMesh
from tests.moved import Move, as_torus, farthest_apart

BRAINS = ("FCWB", "FAFB14", "JRC2018F")
SEEDS = (10, 1)


@pytest.fixture(scope="module", params=BRAINS)
def original(request):
    """A brain as it was read, and as a torus."""
    raw = read_brain(open_brain(request.param))
    return raw, as_torus(raw)


@pytest.fixture(scope="module", params=SEEDS, ids=["turned", "mirrored"])
def moved(request, original):
    """How a brain was moved, and the torus it then becomes."""
    move = Move.random(request.param)
    return move, as_torus(move.moved(original[0]))


def test_a_moved_brain_becomes_the_same_surface_moved(original, moved):
    _, expected = original
    move, torus = moved
    back = SurfaceMesh(move.undone(torus.surface.vertices), torus.surface.faces)
    assert farthest_apart(back, expected.surface) < expected.pitch


def test_a_moved_brain_has_its_oesophagus_in_the_same_place(original, moved):
    _, expected = original
    move, torus = moved
    center = move.undone(np.array(torus.oesophagus.center_um))
    assert np.linalg.norm(center - expected.oesophagus.center_um) < expected.pitch
    assert torus.chosen_by == expected.chosen_by


def test_a_moved_brain_is_trimmed_in_the_same_places(original, moved):
    _, expected = original
    move, torus = moved
    planes = np.array([torus.planes.right, torus.planes.left]) / move.scale
    if np.linalg.det(move.turn) < 0:  # left and right follow from front and top
        planes = -planes[::-1]
    np.testing.assert_allclose(
        planes, [expected.planes.right, expected.planes.left], atol=expected.pitch / 2
    )
