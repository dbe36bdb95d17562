import copy
import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flyreg_core import edits
from flyreg_core.errors import LandmarkError
from flyreg_core.handles import Handle, HandleParameters
from flyreg_core.landmarks import CORNERS, LandmarkPair
from flyreg_core.project import Brain, BrainInput, NeuropilFile, Project
from flyreg_core.smooth import SmoothParameters
from flyreg_core.trim import TrimParameters

BRAIN = Brain(BrainInput("a.ply", "/nowhere/a.ply", "0" * 64, "um", "stated by the user"))
OTHER = replace(BRAIN, smooth=SmoothParameters(7))
ONE = LandmarkPair("u1", "calyx", "interior", None, (1.0, 2.0, 3.0), (4.0, 5.0, 6.0))
TWO = LandmarkPair("u2", "tip", "upper", None, 0.25, 0.5)
PROJECT = Project(BRAIN, BRAIN, pairs=(ONE, TWO), weights={"upper-01": 0.5}, moved={"hole-01": 0.1})

HERE, THERE, AWAY = (1.0, 2.0, 3.0), (4.0, 5.0, 6.0), (7.0, 8.0, 9.0)
TUNNEL = Handle(HERE, 20.0, (0.0, 0.0, 1.0), True, 0.9, True, is_oesophagus=False)
OESOPHAGUS = replace(TUNNEL, center_um=THERE, is_oesophagus=True)

REGIONS = {role: NeuropilFile(BRAIN.input, role) for role in ("source", "target")}

OWN, ROLES, FREE = st.sampled_from(["u1", "u2"]), ["source", "target"], st.floats(0, 9)
SOME = st.lists(st.sampled_from(["u1", "u2", "upper-01", "gone"]))
NEW = st.integers(0, 99).map(lambda k: replace(ONE, id=f"n{k}", name=f"n{k}"))
EDITS = st.one_of(
    st.tuples(st.just(edits.set_weight), OWN | st.just("upper-02"), FREE),
    st.tuples(st.just(edits.set_weights), SOME, FREE),
    st.tuples(st.just(edits.set_each_weight), st.dictionaries(OWN | st.just("upper-01"), FREE)),
    st.tuples(st.just(edits.set_muted), SOME, st.booleans()),
    st.tuples(st.just(edits.set_solo), SOME),
    st.tuples(st.just(edits.merge_pairs), st.lists(NEW, max_size=2)),
    st.tuples(st.just(edits.add_unplaced), st.lists(st.sampled_from(["calyx", "AL_L"]))),
    st.tuples(st.just(edits.recolor_pairs), SOME, st.none() | st.just((1, 2, 3))),
    st.tuples(st.just(edits.add_neuropils), st.sampled_from(ROLES).map(REGIONS.get)),
    st.tuples(st.just(edits.set_smoothing), FREE),
    st.tuples(st.just(edits.add_pair), NEW),
    st.tuples(st.just(edits.remove_pairs), SOME),
    st.tuples(st.just(edits.accept_suggestions), NEW.map(lambda pair: [pair])),
    st.tuples(st.just(edits.rename_pair), OWN, st.text()),
    st.tuples(st.just(edits.place_pair), st.just("lower-01"), st.just("target"), st.floats(-1, 2)),
    st.tuples(st.just(edits.place_pair), st.just("u2"), st.sampled_from(ROLES), st.floats(0, 1)),
    st.tuples(
        st.just(edits.set_oesophagus), st.sampled_from(ROLES), st.sampled_from([HERE, THERE])
    ),
    st.tuples(
        st.just(edits.close_tunnel), st.sampled_from(ROLES), st.sampled_from([TUNNEL, OESOPHAGUS])
    ),
    st.tuples(st.just(edits.add_drill), st.sampled_from(ROLES), st.just(HERE), st.just(THERE)),
    st.tuples(
        st.sampled_from([edits.keep_snapshot, edits.take_snapshot]), st.sampled_from(["A", "B"])
    ),
    st.tuples(st.just(edits.reset_handles), st.sampled_from(ROLES)),
    st.tuples(
        *(st.just(edits.set_trim_plane), st.sampled_from(ROLES)),
        *(st.sampled_from(["right", "left"]), st.none() | st.floats(-9, 9)),
    ),
    st.tuples(st.just(edits.set_cut_shift), st.sampled_from(ROLES), st.floats(-9, 9)),
    st.tuples(st.just(edits.reset_trimming), st.sampled_from(ROLES)),
    st.tuples(st.just(edits.set_brain), st.sampled_from(ROLES), st.just(OTHER)),
)


@given(steps=st.lists(EDITS, max_size=8))
def test_an_edit_makes_a_new_project_and_leaves_the_old_one_for_undo(steps):
    history = [PROJECT]
    copies = [copy.deepcopy(PROJECT)]
    for edit, *arguments in steps:
        try:
            history.append(edit(history[-1], *arguments))
        except LandmarkError:
            continue
        copies.append(copy.deepcopy(history[-1]))
    assert history == copies


def test_the_weight_of_a_pair_of_the_users_own_is_kept_with_it():
    edited = edits.set_weight(PROJECT, "u1", 0.25)
    assert edited == replace(PROJECT, pairs=(replace(ONE, weight=0.25), TWO))


def test_the_weight_of_a_boundary_pair_is_kept_by_its_id():
    assert edits.set_weight(PROJECT, "upper-02", 0.25) == replace(
        PROJECT, weights={"upper-01": 0.5, "upper-02": 0.25}
    )


def test_several_pairs_get_the_same_weight():
    edited = edits.set_weights(PROJECT, ["u2", "upper-01", "hole-03"], 3.0)
    assert [pair.weight for pair in edited.pairs] == [1.0, 3.0]
    assert edited.weights == {"upper-01": 3.0, "hole-03": 3.0}


@pytest.mark.parametrize("weight", [-1.0, math.nan, math.inf])
@pytest.mark.parametrize(("identifier", "name"), [("u1", "calyx"), ("upper-01", "upper-01")])
def test_a_weight_must_be_zero_or_positive(identifier, name, weight):
    words = f"the weight of landmark {name} must be 0 or a positive number, not {weight}"
    with pytest.raises(LandmarkError, match=words):
        edits.set_weight(PROJECT, identifier, weight)


def test_the_smoothing_is_set():
    assert edits.set_smoothing(PROJECT, 0.0) == replace(PROJECT, smoothing=0.0)


@pytest.mark.parametrize("smoothing", [-0.5, math.nan, math.inf])
def test_the_smoothing_must_be_zero_or_positive(smoothing):
    words = f"the smoothing must be 0 or a positive number, not {smoothing}"
    with pytest.raises(LandmarkError, match=words):
        edits.set_smoothing(PROJECT, smoothing)


def test_a_pair_is_added_last():
    new = replace(ONE, id="u3", name="gall")
    assert edits.add_pair(PROJECT, new).pairs == (ONE, TWO, new)


@pytest.mark.parametrize("taken", [{"id": "u1"}, {"name": "calyx"}])
def test_a_pair_with_the_id_or_name_of_another_is_refused(taken):
    new = replace(ONE, **{"id": "u3", "name": "gall", **taken})
    words = "there is a landmark named calyx already; choose another name"
    with pytest.raises(LandmarkError, match=words):
        edits.add_pair(PROJECT, new)


def test_a_pair_of_the_users_own_is_removed_and_a_boundary_pair_is_given_no_weight():
    edited = edits.remove_pairs(PROJECT, ["u1", "hole-02"])
    assert edited == replace(PROJECT, pairs=(TWO,), weights={"upper-01": 0.5, "hole-02": 0.0})


def test_what_is_removed_is_neither_muted_nor_solo_any_longer():
    heard = edits.set_solo(edits.set_muted(PROJECT, ["u1", "upper-01"], True), ["u1", "u2"])
    edited = edits.remove_pairs(heard, ["u1"])
    assert (edited.muted, edited.solo) == (("upper-01",), ("u2",))


@given(identifiers=SOME)
def test_unmuting_what_was_muted_gives_the_project_back(identifiers):
    muted = edits.set_muted(PROJECT, identifiers, True)
    assert all(muted.is_muted(identifier) for identifier in identifiers)
    assert edits.set_muted(muted, identifiers, False) == PROJECT


def test_solo_mutes_all_others_but_the_corners():
    heard = edits.set_solo(PROJECT, ["u1"])
    muted = [i for i in ("u1", "u2", "upper-01", *CORNERS) if heard.is_muted(i)]
    assert muted == ["u2", "upper-01"]
    assert edits.set_solo(heard, []) == PROJECT


def test_a_landmark_of_a_file_moves_the_one_of_its_name_and_keeps_its_id_and_other_end():
    read = LandmarkPair("user-calyx", "calyx", "interior", None, None, (7.0, 8.0, 9.0), 3.0)
    edited = edits.merge_pairs(PROJECT, [read])
    assert edited.pairs == (replace(ONE, target=(7.0, 8.0, 9.0), weight=3.0), TWO)


def test_a_landmark_of_a_file_with_a_new_name_is_added_with_an_id_of_its_own():
    edited = edits.merge_pairs(PROJECT, [replace(ONE, name="new")])
    assert edited.pairs == (ONE, TWO, replace(ONE, id="u1-1", name="new"))


def test_names_that_are_still_to_be_placed_are_added_once():
    edited = edits.add_unplaced(PROJECT, ["AL_L", "calyx", "AL_L"])
    (added,) = edited.pairs[2:]
    assert (added.name, added.source, added.target) == ("AL_L", None, None)


def test_removing_nothing_changes_nothing():
    assert edits.remove_pairs(PROJECT, []) == PROJECT


def test_an_accepted_suggestion_is_the_users_own_and_acts_once():
    suggested = replace(
        ONE, id="suggested-a", name="suggested anterior 3", weight=0.05, origin="suggested"
    )
    edited = edits.accept_suggestions(PROJECT, [suggested])
    own = edited.pairs[-1]
    assert (own.name, own.weight, own.origin) == ("anterior 3", 1.0, "user")
    assert (own.source, own.target) == (suggested.source, suggested.target)
    assert edited.weights["suggested-a"] == 0


def test_the_literal_method_keeps_landmarks_and_everything_else():
    paper = edits.as_in_the_paper(PROJECT)
    assert paper.boundary.pairing == "nearest"
    assert not paper.boundary.is_by_shape
    assert paper.source.flatten.passes == paper.target.flatten.passes == 500
    assert (paper.pairs, paper.weights, paper.smoothing) == (
        PROJECT.pairs,
        PROJECT.weights,
        PROJECT.smoothing,
    )


def test_a_pair_is_renamed():
    assert edits.rename_pair(PROJECT, "u1", "gall").pairs == (replace(ONE, name="gall"), TWO)
    assert edits.rename_pair(PROJECT, "u1", "calyx") == PROJECT


@pytest.mark.parametrize("name", ["", "  ", "\t"])
def test_a_pair_needs_a_name(name):
    with pytest.raises(LandmarkError, match="a landmark needs a name"):
        edits.rename_pair(PROJECT, "u1", name)


def test_two_pairs_cannot_have_one_name():
    words = "there is a landmark named tip already; choose another name"
    with pytest.raises(LandmarkError, match=words):
        edits.rename_pair(PROJECT, "u1", "tip")


def test_either_end_of_a_pair_of_the_users_own_moves():
    assert edits.place_pair(PROJECT, "u1", "source", (7.0, 8.0, 9.0)).pairs[0] == replace(
        ONE, source=(7.0, 8.0, 9.0)
    )
    assert edits.place_pair(PROJECT, "u2", "target", 0.75).pairs[1] == replace(TWO, target=0.75)


@pytest.mark.parametrize(("place", "kept"), [(0.25, 0.25), (-0.5, 0.0), (1.5, 1.0)])
def test_the_target_of_a_boundary_pair_moves_along_its_curve_and_not_beyond(place, kept):
    edited = edits.place_pair(PROJECT, "upper-01", "target", place)
    assert edited == replace(PROJECT, moved={"hole-01": 0.1, "upper-01": kept})


@pytest.mark.parametrize(("role", "place"), [("source", 0.5), ("target", (1.0, 2.0, 3.0))])
def test_a_boundary_pair_moves_in_no_other_way(role, place):
    words = "a boundary landmark moves only along its curve, and only on the target"
    with pytest.raises(LandmarkError, match=words):
        edits.place_pair(PROJECT, "upper-01", role, place)


def test_a_pair_cannot_move_to_a_place_of_another_kind():
    with pytest.raises(LandmarkError, match="landmark calyx is interior but lies at"):
        edits.place_pair(PROJECT, "u1", "target", 0.5)


@pytest.mark.parametrize("role", ["source", "target"])
def test_one_brain_is_changed_and_the_other_stays(role):
    assert edits.set_brain(PROJECT, role, OTHER) == replace(PROJECT, **{role: OTHER})


def handles_after(*steps, role="target"):
    """What is said about the tunnels of a brain after some edits; the other brain stays."""
    project = PROJECT
    for edit, *arguments in steps:
        project = edit(project, role, *arguments)
    handles = edits.brain_of(project, role).handles
    assert project == replace(PROJECT, **{role: replace(BRAIN, handles=handles)})
    return handles


@pytest.mark.parametrize("role", ["source", "target"])
def test_the_user_points_at_the_oesophagus(role):
    assert handles_after((edits.set_oesophagus, HERE), role=role) == HandleParameters(hole=HERE)


def test_a_tunnel_that_was_refused_may_be_pointed_at_later():
    steps = (edits.close_tunnel, TUNNEL), (edits.set_oesophagus, HERE)
    assert handles_after(*steps) == HandleParameters(hole=HERE)


def test_a_tunnel_is_refused_once_however_often_that_is_said():
    steps = 2 * ((edits.close_tunnel, TUNNEL),)
    assert handles_after(*steps) == HandleParameters(closed=(HERE,))


def test_refusing_the_oesophagus_that_the_user_pointed_at_forgets_that():
    steps = (edits.set_oesophagus, THERE), (edits.close_tunnel, OESOPHAGUS)
    assert handles_after(*steps) == HandleParameters(closed=(THERE,))


def test_refusing_another_tunnel_keeps_what_the_user_pointed_at():
    steps = (edits.set_oesophagus, THERE), (edits.close_tunnel, TUNNEL)
    assert handles_after(*steps) == HandleParameters(hole=THERE, closed=(HERE,))


def test_what_is_drilled_becomes_the_oesophagus():
    steps = (edits.set_oesophagus, AWAY), (edits.add_drill, HERE, THERE)
    assert handles_after(*steps) == HandleParameters(drills=((HERE, THERE),))


def test_refusing_what_was_drilled_fills_it_and_refuses_no_other_tunnel():
    steps = (edits.add_drill, HERE, THERE), (edits.close_tunnel, OESOPHAGUS)
    assert handles_after(*steps) == HandleParameters()


def test_the_tunnels_are_left_to_the_program_again():
    steps = (edits.add_drill, HERE, THERE), (edits.close_tunnel, TUNNEL), (edits.reset_handles,)
    assert handles_after(*steps) == HandleParameters()


def test_trim_planes_and_cut_are_placed_and_left_to_the_program_again():
    project = edits.set_trim_plane(PROJECT, "source", "right", -90.0)
    project = edits.set_trim_plane(project, "source", "left", 80.0)
    project = edits.set_cut_shift(project, "source", 5.0)
    cut = replace(BRAIN.cut, shift_um=5.0)
    assert project.source == replace(BRAIN, trim=TrimParameters(-90.0, 80.0), cut=cut)
    assert project.target == BRAIN
    one = edits.set_trim_plane(project, "source", "left", None)
    assert one.source.trim == TrimParameters(-90.0, None)
    assert edits.reset_trimming(project, "source") == PROJECT


def test_a_snapshot_brings_back_weights_and_smoothing_and_nothing_else():
    kept = edits.keep_snapshot(PROJECT, "A")
    assert kept == replace(PROJECT, snapshots=kept.snapshots)
    changed = edits.set_smoothing(edits.set_weights(kept, ["u1", "upper-01"], 7.0), 0.5)
    new = replace(ONE, id="u3", name="gall", weight=3.0)
    later = edits.add_pair(edits.remove_pairs(changed, ["u2"]), new)
    assert edits.take_snapshot(later, "A") == replace(kept, pairs=(ONE, new))


def test_a_snapshot_that_was_never_kept_cannot_be_taken():
    with pytest.raises(LandmarkError, match="nothing is kept as B yet"):
        edits.take_snapshot(PROJECT, "B")
