import numpy as np
import pytest
from flyreg_resources.demo import deform
from scipy.spatial.distance import pdist

from flyreg_core.boundary_map import LEAST_ADVANCE
from flyreg_core.brain_files import open_brain
from flyreg_core.cut import PIECES
from flyreg_core.errors import LandmarkError
from flyreg_core.landmarks import HALVES
from flyreg_core.lay_over import find_partners, lay_over
from flyreg_core.lift import build_locators, lift
from flyreg_core.preparation import Preparation
from flyreg_core.progress import ignore
from flyreg_core.project import Brain, Project
from flyreg_core.rectangle import wrapped
from flyreg_core.suggestions import STRONGEST, suggest_pairs
from flyreg_core.surface_distance import distances_to_surface
from flyreg_core.unfold import count_flipped


@pytest.fixture(scope="module")
def to_target(demo_shape_map):
    return demo_shape_map


@pytest.fixture(scope="module")
def laid(demo_source, demo_target, to_target):
    return lay_over(demo_source.flat, demo_target.flat, to_target, ignore)


@pytest.mark.parametrize("half", HALVES)
def test_no_face_is_flipped(laid, half):
    assert count_flipped(laid.halves[half].flat) == 0


@pytest.mark.parametrize("half", HALVES)
def test_what_lies_in_one_place_is_the_same_anatomy(demo_source, demo_target, laid, half):
    """Lifted from where it lies, a vertex is nearer to the truth than laid flat by itself."""
    grid = build_locators(demo_target.flat).halves[half]
    other = demo_target.flat.halves[half]
    vertex_of = laid.halves[half].vertex_of
    truth = deform(demo_source.surface.vertices[vertex_of])
    errors = [
        np.linalg.norm(
            lift(flat.halves[half].flat.uv, other, grid, demo_target.surface.vertices) - truth,
            axis=1,
        ).mean()
        for flat in (demo_source.flat, laid)
    ]
    assert errors[1] < errors[0] / 2


def test_shares_grow_along_each_curve_and_corners_stay(demo_source, laid):
    for key, curve in laid.curves.items():
        assert (np.diff(curve.share) > 0).all()
        assert (
            np.diff(curve.share).min()
            >= 0.9 * LEAST_ADVANCE * np.diff(demo_source.flat.curves[key].share).min()
        )
        if not curve.is_closed:
            assert curve.share[[0, -1]] == pytest.approx([0, 1], abs=1e-12)
        else:
            assert curve.share[-1] - curve.share[0] == pytest.approx(1)


def test_partners_lie_on_the_target(demo_source, demo_target, to_target):
    surface = demo_source.surface
    partners, _ = find_partners(
        surface.vertices, surface.vertex_normals, demo_target.flat, to_target
    )
    assert distances_to_surface(partners.points, demo_target.surface, ignore).max() < 1e-9
    assert partners.barycentric.sum(axis=1) == pytest.approx(np.ones(len(partners.points)))
    away = np.linalg.norm(to_target(surface.vertices) - partners.points, axis=1)
    assert away == pytest.approx(partners.apart_um, abs=1e-9)


def test_suggestions_are_right_spread_out_and_weaker_than_a_user(laid, demo_target, to_target):
    pairs = suggest_pairs(laid, demo_target.flat, to_target, 40)
    assert 40 < len(pairs) <= 80
    assert len({pair.id for pair in pairs}) == len(pairs)
    assert all(0 < pair.weight <= STRONGEST < 1 for pair in pairs)
    sources = np.array([pair.source for pair in pairs])
    away = np.linalg.norm(np.array([pair.target for pair in pairs]) - deform(sources), axis=1)
    before = np.linalg.norm(sources - deform(sources), axis=1)
    assert away.mean() < before.mean() / 2
    for half in HALVES:
        own = sources[[half in pair.id for pair in pairs]]
        assert pdist(own).min() > 20


def test_no_suggestions_are_made_if_none_are_asked_for(laid, demo_target, to_target):
    assert suggest_pairs(laid, demo_target.flat, to_target, 0) == ()
    with pytest.raises(LandmarkError, match="must be at least 0, not -1"):
        suggest_pairs(laid, demo_target.flat, to_target, -1)


@pytest.fixture(scope="module")
def hard_pair():
    """A source, the target that leads it, and the map: light and electron microscopy."""
    brains = [Brain(open_brain(name)) for name in ("JRC2018F", "FAFB14")]
    pair = Preparation().prepare_pair(Project(*brains), ignore)
    return pair.source, pair.target, pair.to_target


@pytest.mark.parametrize("half", HALVES)
def test_where_much_is_folded_the_rest_of_the_half_stays_with_its_partners(hard_pair, half):
    """Two thousand faces of a half are turned over by partners that contradict each other."""
    source, target, to_target = hard_pair
    own = source.flat.halves[half]
    points = source.surface.vertices[own.vertex_of]
    partners, is_sure = find_partners(
        points, source.flat.normals[own.vertex_of], target.flat, to_target
    )
    flat = target.flat.halves[half].flat
    of_half = target.flat.dissection.piece_of_face[partners.face] == PIECES.index(half)
    is_sure &= of_half & (partners.apart_um < 3 * np.median(partners.apart_um))
    corners = flat.corners[target.flat.dissection.own_face[partners.face[is_sure]]]
    there = np.einsum("ij,ijk->ik", partners.barycentric[is_sure], corners)
    off = there - own.flat.uv[is_sure]
    off[:, 0] = wrapped(off[:, 0])
    n_before = len(source.surface.vertices) - len(
        source.flat.added
    )  # what divides edges lies on them
    was_there = own.vertex_of[is_sure] < n_before
    assert (np.abs(off[was_there]).max(axis=1) < 1e-6).mean() > 0.8
