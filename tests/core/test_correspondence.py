from dataclasses import replace

import numpy as np
import pytest
import trimesh

from flyreg_core.boundary import Curve
from flyreg_core.correspondence import (
    FlatBrain,
    boundary_pairs,
    flat_place,
    place_landmarks,
    with_decisions,
)
from flyreg_core.cut import PIECES
from flyreg_core.errors import LandmarkError
from flyreg_core.landmarks import HALVES, LandmarkPair, LandmarkParameters
from flyreg_core.rectangle import HEIGHT, HOLE, WIDTH, to_plane, wrapped

PAIRINGS = ["coordinate", "arc length", "nearest"]
CORNERS = [f"corner-{curve}-{side}" for curve in ("upper", "lower") for side in ("right", "left")]


@pytest.fixture(scope="module")
def source(demo_source) -> FlatBrain:
    return demo_source.flat


@pytest.fixture(scope="module")
def target(demo_target) -> FlatBrain:
    return demo_target.flat


def interior(name, source_point, target_point):
    ends = (tuple(map(float, point)) for point in (source_point, target_point))
    return LandmarkPair(name, name, "interior", None, *ends)


def in_pieces(brain, piece):
    """The vertices of one piece that no other piece has."""
    dissection = brain.dissection
    others = dissection.surface.faces[dissection.piece_of_face != PIECES.index(piece)]
    return np.setdiff1d(dissection.faces_of(piece), others)


def on_curve(pairs, curve, half):
    corners = set(CORNERS)
    return [p for p in pairs if (p.kind, p.half) == (curve, half) and p.id not in corners]


@pytest.mark.parametrize("pairing", PAIRINGS)
def test_every_pair_has_its_own_id_and_name(source, target, pairing):
    pairs = boundary_pairs(source, target, LandmarkParameters(pairing=pairing))
    assert len({pair.id for pair in pairs}) == len({pair.name for pair in pairs}) == len(pairs)
    assert all(pair.origin == "boundary" and pair.weight == 1 and pair.is_placed for pair in pairs)


@pytest.mark.parametrize(("per_seam", "per_side"), [(1, 0), (5, 2), (9, 3)])
def test_there_are_as_many_pairs_as_asked_for_and_the_corners(source, target, per_seam, per_side):
    pairs = boundary_pairs(source, target, LandmarkParameters(per_seam, per_side, "arc length"))
    assert len(pairs) == 4 + 3 * per_seam + 4 * per_side
    for curve in ("upper", "lower", "hole"):
        assert len(on_curve(pairs, curve, None)) == per_seam
    for side in ("left", "right"):
        for half in HALVES:
            assert len(on_curve(pairs, side, half)) == per_side


@pytest.mark.parametrize("pairing", PAIRINGS)
def test_corners_go_with_corners(source, target, pairing):
    pairs = {p.id: p for p in boundary_pairs(source, target, LandmarkParameters(pairing=pairing))}
    for identifier in CORNERS:
        end = 1.0 if identifier.endswith("left") else 0.0
        assert (pairs[identifier].source, pairs[identifier].target) == (end, end)


@pytest.mark.parametrize("pairing", PAIRINGS)
def test_a_brain_is_paired_with_itself_place_by_place(source, pairing):
    for pair in boundary_pairs(source, source, LandmarkParameters(pairing=pairing)):
        assert pair.target == pytest.approx(pair.source, abs=1e-12)


def test_by_arc_length_the_shares_are_equal_and_even(source, target):
    pairs = boundary_pairs(source, target, LandmarkParameters(4, 1, "arc length"))
    assert all(pair.source == pair.target for pair in pairs)
    assert [p.source for p in on_curve(pairs, "upper", None)] == pytest.approx([0.2, 0.4, 0.6, 0.8])
    assert [p.source for p in on_curve(pairs, "hole", None)] == pytest.approx([0, 0.25, 0.5, 0.75])
    assert [p.source for p in on_curve(pairs, "left", "posterior")] == pytest.approx([0.5])


@pytest.mark.parametrize("curve", ["upper", "lower"])
def test_by_coordinate_partners_lie_equally_far_from_right_to_left(source, target, curve):
    pairs = on_curve(boundary_pairs(source, target, LandmarkParameters()), curve, None)
    away = {}
    for pairing in ("coordinate", "arc length"):
        pairs = on_curve(
            boundary_pairs(source, target, LandmarkParameters(pairing=pairing)), curve, None
        )
        progress = []
        for brain, end in ((source, "source"), (target, "target")):
            line = brain.curves[curve, None]
            places = line.at(np.array([getattr(pair, end) for pair in pairs]))
            x = brain.frame.coordinates(places)[:, 0]
            first, last = brain.frame.coordinates(line.points[[0, -1]])[:, 0]
            progress.append((x - first) / (last - first))
        away[pairing] = np.abs(progress[0] - progress[1]).max()
    assert away["coordinate"] < 0.5 * away["arc length"]


@pytest.mark.parametrize("pairing", ["coordinate", "arc length"])
def test_partners_follow_each_other_along_the_curve(source, target, pairing):
    pairs = boundary_pairs(source, target, LandmarkParameters(30, 10, pairing))
    for curve, half in source.curves:
        targets = [pair.target for pair in on_curve(pairs, curve, half)]
        assert (np.diff(targets) > 0).all()
        assert curve == "hole" or 0 < targets[0] < targets[-1] < 1


def test_a_curve_that_turns_back_still_advances(source, target):
    points = np.array([[0.0, 0, 0], [3, 0, 0], [1, 1, 0], [2, 2, 0], [4, 0, 0]])
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    curve = Curve(np.arange(5), along / along[-1], points)
    turning = replace(target, curves={**target.curves, ("upper", None): curve})
    pairs = on_curve(boundary_pairs(source, turning, LandmarkParameters(50, 0)), "upper", None)
    assert (np.diff([pair.target for pair in pairs]) > 0).all()


@pytest.mark.parametrize("key", [("upper", None), ("left", "anterior"), ("hole", None)])
def test_by_nearness_each_source_vertex_has_the_nearest_target_vertex(source, target, key):
    pairs = boundary_pairs(source, target, LandmarkParameters(pairing="nearest"))
    choices = target.curves[key].share
    for pair in on_curve(pairs, *key):
        away = choices - pair.source
        away = np.abs(wrapped(away) if key[0] == "hole" else away)
        chosen = pair.target - pair.source
        chosen = abs(float(wrapped(np.array(chosen)))) if key[0] == "hole" else abs(chosen)
        assert chosen == pytest.approx(away.min(), abs=1e-12)
    ends = source.curves[key]
    assert len(on_curve(pairs, *key)) == len(ends.vertices) - (1 if ends.is_closed else 2)


def test_nearness_on_the_hole_does_not_depend_on_where_its_list_of_vertices_starts(source):
    hole = source.curves["hole", None]
    by = len(hole.vertices) // 3
    around = np.roll(np.arange(len(hole.vertices) - 1), -by)
    around = np.append(around, around[0])
    share = hole.share[around] + (np.arange(len(around)) >= len(around) - 1 - by)
    turned = Curve(hole.vertices[around], share, hole.points[around])
    other = replace(source, curves={**source.curves, ("hole", None): turned})
    pairs = boundary_pairs(source, other, LandmarkParameters(pairing="nearest"))
    for pair in on_curve(pairs, "hole", None):
        assert wrapped(np.array(pair.target - pair.source)) == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize(("per_seam", "per_side"), [(0, 3), (9, -1)])
def test_too_few_pairs_are_refused(source, target, per_seam, per_side):
    words = (
        "at least one landmark per seam and none per side are needed, not "
        f"{per_seam} and {per_side}"
    )
    with pytest.raises(LandmarkError, match=words):
        boundary_pairs(source, target, LandmarkParameters(per_seam, per_side))


def test_ids_do_not_depend_on_the_brains_or_the_way_of_pairing(source, target):
    one = boundary_pairs(source, target, LandmarkParameters(pairing="coordinate"))
    other = boundary_pairs(target, source, LandmarkParameters(pairing="arc length"))
    assert [pair.id for pair in one] == [pair.id for pair in other]


def test_decisions_change_the_pairs_they_name_and_no_others(source, target):
    pairs = boundary_pairs(source, target, LandmarkParameters())
    decided = with_decisions(pairs, {"upper-01": 0.5, "gone": 3.0}, {"lower-02": 0.125})
    for before, after in zip(pairs, decided, strict=True):
        expected = {"upper-01": {"weight": 0.5}, "lower-02": {"target": 0.125}}.get(before.id, {})
        assert after == replace(before, **expected)


@pytest.mark.parametrize("half", HALVES)
def test_a_vertex_is_placed_where_it_lies_in_the_rectangle(source, half):
    flat = source.halves[half]
    vertices = in_pieces(source, half)[::97]
    points = source.dissection.surface.vertices[vertices]
    marks = place_landmarks(
        source, source, tuple(interior(str(k), p, p) for k, p in zip(vertices, points, strict=True))
    )
    own = np.searchsorted(flat.vertex_of, vertices)
    for mark, point, place in zip(marks, points, flat.plane[own], strict=True):
        assert set(mark.plane) == {half}
        assert mark.plane[half][0] == pytest.approx(place, abs=1e-9)
        assert mark.plane[half][1] == pytest.approx(place, abs=1e-9)
        assert mark.source_point == pytest.approx(point)


@pytest.mark.parametrize("half", HALVES)
def test_a_point_within_a_face_lies_at_its_share_of_the_corners_on_the_strip(source, half):
    rng = np.random.default_rng(1)
    flat, dissection = source.halves[half], source.dissection
    faces = np.flatnonzero(dissection.piece_of_face == PIECES.index(half))
    for own in rng.choice(len(faces), 20, replace=False):
        weights = rng.dirichlet(np.ones(3))
        point = weights @ dissection.surface.vertices[dissection.surface.faces[faces[own]]]
        places = flat.plane[flat.faces[own]]
        place = flat_place(flat, dissection, int(faces[own]), point)
        u, v = weights @ flat.flat.corners[own]
        assert place == pytest.approx(to_plane(u, flat.law.beta(v)), abs=1e-9)
        low, high = places.min(axis=0), places.max(axis=0)
        assert ((place > low - 0.02) & (place < high + 0.02)).all()


def test_a_point_beside_the_surface_moves_to_the_nearest_point_of_it(source, target):
    start = np.add(source.dissection.surface.vertices.mean(axis=0), [0, -300, 0])
    mark = place_landmarks(source, target, (interior("a", start, start),))[0]
    for brain, found in ((source, mark.source_point), (target, mark.target_point)):
        surface = brain.dissection.surface
        mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
        nearest, _, _ = trimesh.proximity.closest_point(mesh, start[None])
        assert found == pytest.approx(nearest[0], abs=1e-6)


def test_ends_on_different_halves_do_not_act(source):
    points = source.dissection.surface.vertices
    front, back = (points[in_pieces(source, half)[50]] for half in HALVES)
    marks = place_landmarks(
        source, source, (interior("a", front, back), interior("b", back, front))
    )
    assert [dict(mark.plane) for mark in marks] == [{}, {}]
    assert marks[0].target_point == pytest.approx(back)


def test_what_the_trim_planes_cut_off_does_not_act(source):
    points = source.dissection.surface.vertices
    cap = points[in_pieces(source, "left cap")[0]]
    front = points[in_pieces(source, "anterior")[50]]
    pairs = (interior("a", cap, cap), interior("b", front, cap), interior("c", cap, front))
    assert [dict(mark.plane) for mark in place_landmarks(source, source, pairs)] == [{}, {}, {}]


def test_a_pair_without_both_ends_is_left_out(source, target):
    half_placed = LandmarkPair("a", "a", "interior", None, (0.0, 0.0, 0.0), None)
    assert place_landmarks(source, target, (half_placed,)) == ()
    assert place_landmarks(source, target, ()) == ()


def test_a_pair_on_a_shared_curve_acts_in_both_halves_as_mirror_images(source, target):
    pair = LandmarkPair("a", "a", "upper", None, 0.25, 0.5)
    plane = place_landmarks(source, target, (pair,))[0].plane
    assert set(plane) == set(HALVES)
    assert plane["anterior"][0] == pytest.approx([-WIDTH / 4, HEIGHT / 2])
    assert plane["posterior"][0] == pytest.approx([WIDTH / 4, HEIGHT / 2])
    assert plane["anterior"][1] == pytest.approx([0, HEIGHT / 2], abs=1e-12)


def test_a_pair_on_the_side_of_one_half_acts_there_only(source, target):
    pair = LandmarkPair("a", "a", "left", "posterior", 0.5, 0.25)
    plane = place_landmarks(source, target, (pair,))[0].plane
    assert set(plane) == {"posterior"}
    assert plane["posterior"][0] == pytest.approx([-WIDTH / 2, 0], abs=1e-12)
    assert plane["posterior"][1] == pytest.approx([-WIDTH / 2, HEIGHT / 4])


def test_a_pair_on_the_hole_lies_on_its_rim(source, target):
    pair = LandmarkPair("a", "a", "hole", None, 0.0, 0.5)
    mark = place_landmarks(source, target, (pair,))[0]
    assert mark.plane["anterior"][0] == pytest.approx([0, HOLE * HEIGHT / 2], abs=1e-12)
    assert mark.plane["anterior"][1] == pytest.approx([0, -HOLE * HEIGHT / 2], abs=1e-12)
    assert mark.source_point == pytest.approx(source.curves["hole", None].at(np.array([0.0]))[0])
    assert mark.target_point == pytest.approx(target.curves["hole", None].at(np.array([0.5]))[0])
