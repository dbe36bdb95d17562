import filecmp
import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flyreg_core import project_file
from flyreg_core.brain_files import template_file
from flyreg_core.cut_height import CutParameters
from flyreg_core.errors import InputError, LandmarkError, ProjectError
from flyreg_core.flatten import FlattenParameters
from flyreg_core.landmarks import LandmarkPair, LandmarkParameters
from flyreg_core.project import Brain, BrainInput, NeuropilFile, Project, Snapshot
from flyreg_core.project_file import load_project, read_notes, save_project
from flyreg_core.simplify import SimplifyParameters
from flyreg_core.smooth import SmoothParameters
from flyreg_core.solid import SolidParameters
from flyreg_core.trim import TrimParameters

CHECKOUT = Path(__file__).parents[2]

PAIR = LandmarkPair("user-a", "a", "interior", None, (1.0, 2.0, 3.0), None, 0.5)
PROJECT = Project(
    source=Brain(BrainInput("a.ply", "/nowhere/a.ply", "0" * 64, "nm", "stated by the user")),
    target=Brain(BrainInput("B", "/nowhere/b.ply", "1" * 64, "um", "template metadata")),
    pairs=(PAIR,),
    weights={"upper-1": 0.25},
    moved={"upper-2": 0.75},
    snapshots={"A": Snapshot({"upper-1": 2.0}, {"user-a": 0.5}, 0.1)},
    view={"camera": (1.5, 0, -2), "shown": True, "theme": None, "panes": {"left": "source"}},
)


def finite(low=None, high=None):
    return st.floats(low, high, allow_nan=False, allow_infinity=False)


def maybe(strategy):
    return st.none() | strategy


def brains():
    parameters = {
        "solid": st.builds(SolidParameters, st.integers(1, 999)),
        "trim": st.builds(TrimParameters, maybe(finite()), maybe(finite())),
        "simplify": st.builds(SimplifyParameters, maybe(st.integers(0, 10**6))),
        "smooth": st.builds(SmoothParameters, st.integers(0, 999)),
        "cut": st.builds(CutParameters, finite()),
        "flatten": st.from_type(FlattenParameters),
    }
    units = st.sampled_from(["nm", "um", "mm"])
    paths = st.text(st.characters(exclude_characters="/\0", exclude_categories=["Cs"]))
    kinds = st.sampled_from(["surface", "point cloud", "label volume"])
    edges = finite(1e-3, 1e3)
    inputs = st.builds(
        BrainInput, st.text(), paths.map("/nowhere/{}".format), st.text(), units, st.text(), kinds,
        maybe(st.tuples(edges, edges, edges)),
    )  # fmt: skip
    return st.builds(Brain, inputs, **parameters)


def landmark_pairs():
    points, shares = st.tuples(finite(), finite(), finite()), finite(0, 1)
    interior = st.builds(
        LandmarkPair, st.text(), st.text(), st.just("interior"), st.none(), maybe(points),
        maybe(points), finite(0), st.just("user"), maybe(st.tuples(*3 * [st.integers(0, 255)])),
    )  # fmt: skip
    boundary = st.builds(
        LandmarkPair, st.text(), st.text(), st.sampled_from(["upper", "lower", "hole"]),
        st.sampled_from([None, "anterior", "posterior"]), maybe(shares), maybe(shares), finite(0),
        st.sampled_from(["boundary", "user"]),
    )  # fmt: skip
    return st.lists(
        interior | boundary, unique_by=(lambda pair: pair.id, lambda pair: pair.name)
    ).map(tuple)


def projects():
    counts, roles = st.integers(0, 99), st.sampled_from(["source", "target"])
    pairing = st.sampled_from(["coordinate", "arc length", "nearest"])
    plain = st.none() | st.booleans() | st.integers() | finite() | st.text()
    free = st.recursive(
        plain, lambda inner: st.lists(inner).map(tuple) | st.dictionaries(st.text(), inner)
    )
    ids = st.lists(st.text()).map(tuple)
    files = st.builds(NeuropilFile, brains().map(lambda brain: brain.input), roles)
    weights = st.dictionaries(st.text(), finite(0), max_size=2)
    snapshots = st.builds(Snapshot, weights, weights, finite(0), ids, ids)
    return st.builds(
        Project,
        brains(),
        brains(),
        st.builds(LandmarkParameters, counts, counts, pairing),
        landmark_pairs(),
        st.dictionaries(st.text(), finite(0)),
        st.dictionaries(st.text(), finite(0, 1)),
        muted=ids,
        solo=ids,
        smoothing=finite(0),
        neuropils=st.lists(files, max_size=2).map(tuple),
        view=st.dictionaries(st.text(), free),
        snapshots=st.dictionaries(st.sampled_from("AB"), snapshots),
    )


def saved(path, project=PROJECT):
    save_project(project, path)
    return path


def changed(path, place, value):
    """Save a project with one entry changed by hand."""
    content = json.loads(saved(path).read_text(encoding="utf-8"))
    *way, last = place
    inner = content
    for key in way:
        inner = inner[key]
    inner[last] = value
    path.write_text(json.dumps(content), encoding="utf-8")
    return path


# Round trips


@settings(deadline=None, max_examples=60)
@given(project=projects())
def test_projects_round_trip(tmp_path_factory, project):
    path = tmp_path_factory.mktemp("project") / "a.flyreg"
    assert load_project(saved(path, project)) == project


def test_a_project_round_trips_field_by_field(tmp_path):
    assert load_project(saved(tmp_path / "a.flyreg")) == PROJECT


def test_equal_projects_give_equal_files(tmp_path):
    other = replace(PROJECT, view=dict(reversed(PROJECT.view.items())))
    one, two = saved(tmp_path / "a.flyreg"), saved(tmp_path / "b.flyreg", other)
    assert filecmp.cmp(one, two, shallow=False)


def test_a_file_name_that_is_no_text_round_trips(tmp_path):
    source = replace(PROJECT.source, input=replace(PROJECT.source.input, path="/nowhere/\udcff"))
    project = replace(PROJECT, source=source)
    assert load_project(saved(tmp_path / "a.flyreg", project)) == project


def test_the_file_says_its_format_and_program(tmp_path):
    content = json.loads(saved(tmp_path / "a.flyreg").read_text(encoding="utf-8"))
    assert content["flyreg"].keys() == {"format", "program"}
    assert content["flyreg"]["format"] == project_file.FORMAT


def test_entries_that_are_missing_have_their_defaults(tmp_path):
    minimal = Project(Brain(PROJECT.source.input), Brain(PROJECT.target.input))
    inputs = {role: {"input": vars(getattr(minimal, role).input)} for role in ("source", "target")}
    path = tmp_path / "a.flyreg"
    path.write_text(json.dumps({"flyreg": {"format": 1}, "project": inputs}))
    assert load_project(path) == minimal


def test_loading_needs_no_mesh_library(tmp_path):
    path = saved(tmp_path / "a.flyreg")
    code = (
        "import sys, pathlib; from flyreg_core.project_file import load_project; "
        f"load_project(pathlib.Path({str(path)!r})); sys.exit('trimesh' in sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=CHECKOUT)


# Where the brains are


def with_source(path, name="a.ply"):
    source = replace(PROJECT.source, input=replace(PROJECT.source.input, path=str(path), name=name))
    return replace(PROJECT, source=source)


def test_a_moved_folder_still_opens(tmp_path):
    before, after = tmp_path / "before", tmp_path / "after"
    (before / "brains").mkdir(parents=True)
    (before / "brains" / "a.ply").touch()
    saved(before / "a.flyreg", with_source(before / "brains" / "a.ply"))
    before.rename(after)
    loaded = load_project(after / "a.flyreg")
    assert Path(loaded.source.input.path) == after / "brains" / "a.ply"


def test_a_file_that_is_still_there_goes_before_the_one_beside_the_project(tmp_path):
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "a.ply").touch()
    path = saved(tmp_path / "one" / "a.flyreg", with_source(tmp_path / "one" / "a.ply"))
    path = path.rename(tmp_path / "two" / "a.flyreg")
    assert Path(load_project(path).source.input.path) == tmp_path / "one" / "a.ply"


def test_a_template_is_found_where_its_package_is_now(tmp_path):
    path = saved(tmp_path / "a.flyreg", with_source("/elsewhere/flybrains/JFRC2.ply", "JFRC2"))
    assert Path(load_project(path).source.input.path) == template_file("JFRC2")


def test_a_missing_brain_keeps_its_place(tmp_path):
    assert load_project(saved(tmp_path / "a.flyreg")).source.input.path == "/nowhere/a.ply"


# Versions


def test_a_newer_format_asks_for_an_update(tmp_path):
    newer = project_file.FORMAT + 1
    sentence = rf"from a newer flyreg \(.*, format {newer}\).* update flyreg"
    with pytest.raises(ProjectError, match=sentence):
        load_project(changed(tmp_path / "a.flyreg", ["flyreg", "format"], newer))


def test_a_brain_of_format_1_is_a_surface(tmp_path):
    path = changed(tmp_path / "a.flyreg", ["flyreg", "format"], 1)
    content = json.loads(path.read_text(encoding="utf-8"))
    for role in ("source", "target"):
        del content["project"][role]["input"]["kind"]
        del content["project"][role]["input"]["voxel_size_um"]
    path.write_text(json.dumps(content), encoding="utf-8")
    assert load_project(path) == PROJECT


@pytest.mark.parametrize("size", [[1, 1, 0], [1, 1, -1]])
def test_a_voxel_has_a_size(tmp_path, size):
    place = ["project", "source", "input", "voxel_size_um"]
    with pytest.raises(InputError, match=r"must be three positive numbers of micrometres, not \("):
        load_project(changed(tmp_path / "a.flyreg", place, size))


def test_a_project_of_format_3_has_no_snapshots(tmp_path):
    path = changed(tmp_path / "a.flyreg", ["flyreg", "format"], 3)
    content = json.loads(path.read_text(encoding="utf-8"))
    del content["project"]["snapshots"]
    path.write_text(json.dumps(content), encoding="utf-8")
    assert load_project(path) == replace(PROJECT, snapshots={})


def test_a_snapshot_with_an_impossible_weight_is_refused(tmp_path):
    place = ["project", "snapshots", "A", "weights", "upper-1"]
    with pytest.raises(LandmarkError, match="the weight of landmark upper-1 must be 0 or"):
        load_project(changed(tmp_path / "a.flyreg", place, -1.0))


def test_notes_are_kept_beside_the_project(tmp_path):
    path = tmp_path / "a.flyreg"
    save_project(PROJECT, path, {"path": None, "time": "now"})
    assert load_project(path) == PROJECT
    assert read_notes(path) == {"path": None, "time": "now"}
    assert read_notes(saved(path)) == {}


def test_an_older_format_is_upgraded_step_by_step(tmp_path, monkeypatch):
    def rename(content):
        project = dict(content["project"])
        project["smoothing"] = project.pop("stiffness")
        return {**content, "project": project}

    path = changed(tmp_path / "a.flyreg", ["project", "stiffness"], 0.5)
    content = json.loads(path.read_text())
    del content["project"]["smoothing"]
    path.write_text(json.dumps(content))
    now = project_file.FORMAT
    monkeypatch.setattr(project_file, "UPGRADES", {now: rename, now + 1: dict})
    monkeypatch.setattr(project_file, "FORMAT", now + 2)
    assert load_project(path) == replace(PROJECT, smoothing=0.5)


def test_an_unknown_older_format_is_refused(tmp_path):
    with pytest.raises(ProjectError, match="has the unknown format 0"):
        load_project(changed(tmp_path / "a.flyreg", ["flyreg", "format"], 0))


@pytest.mark.parametrize("text", ["[]", "{}", '{"flyreg": 1}', '{"flyreg": {"format": "1"}}'])
def test_other_json_is_no_project(tmp_path, text):
    (tmp_path / "a.flyreg").write_text(text)
    with pytest.raises(ProjectError, match="is no flyreg project: it does not say which format"):
        load_project(tmp_path / "a.flyreg")


# Damage, one sentence each


def test_a_missing_project_is_named(tmp_path):
    with pytest.raises(InputError, match=r"there is no file .*a\.flyreg"):
        load_project(tmp_path / "a.flyreg")


def test_damaged_json_is_named_with_the_place(tmp_path):
    path = saved(tmp_path / "a.flyreg")
    path.write_bytes(path.read_bytes()[:300])
    with pytest.raises(ProjectError, match=r"a\.flyreg is damaged \(.* line \d+ column \d+"):
        load_project(path)


@pytest.mark.parametrize(
    ("place", "value", "sentence"),
    [
        (["source"], [], r"project\.source must be names with values, not \[\]"),
        (["source", "input", "unit"], "in", r"source\.input\.unit must be one of nm, um, mm, not"),
        (["source", "input", "sha256"], None, r"source\.input\.sha256 must be a text, not null"),
        (["target", "trim", "left"], "far", r'target\.trim\.left must be a number, not "far"'),
        (
            ["target", "smooth", "passes"],
            1.5,
            r"target\.smooth\.passes must be a whole number, not",
        ),
        (["target", "solid", "voxels_across"], True, "must be a whole number, not true"),
        (["smoothing"], float("nan"), r"project\.smoothing must be a finite number, not NaN"),
        (["smoothing"], 10**400, r"project\.smoothing must be a finite number, not 1000"),
        (["weights"], 1, r"project\.weights must be names with values, not 1"),
        (["weights", "upper-1"], "heavy", r'weights\.upper-1 must be a number, not "heavy"'),
        (["pairs"], {}, r"project\.pairs must be a list, not {}"),
        (["pairs", 0, "weight"], "heavy", r'pairs\[0\]\.weight must be a number, not "heavy"'),
        (["pairs", 0, "source"], [1, 2], r"pairs\[0\]\.source must be a list of 3, not \[1, 2\]"),
        (["pairs", 0, "source"], "left", r'pairs\[0\]\.source must be a number, not "left"'),
        (["smothing"], 1, "project has the unknown entry smothing; delete it"),
    ],
)
def test_a_wrong_value_is_named_with_its_place(tmp_path, place, value, sentence):
    with pytest.raises(ProjectError, match=rf"a\.flyreg cannot be used: .*{sentence}"):
        load_project(changed(tmp_path / "a.flyreg", ["project", *place], value))


def test_a_missing_entry_is_named(tmp_path):
    path = saved(tmp_path / "a.flyreg")
    path.write_text(path.read_text().replace('"sha256"', '"sha"', 1))
    with pytest.raises(
        ProjectError, match=r"project\.\w+\.input has the unknown entry sha; delete"
    ):
        load_project(path)
    content = json.loads(saved(path).read_text())
    del content["project"]["source"]["input"]["sha256"]
    path.write_text(json.dumps(content))
    with pytest.raises(ProjectError, match=r"project\.source\.input lacks the entry sha256"):
        load_project(path)


def test_a_negative_weight_of_a_pair_is_named_with_its_place(tmp_path):
    sentence = r"weight of landmark a must be 0 or a positive number, not -1.0 \(in project.pairs"
    with pytest.raises(LandmarkError, match=sentence):
        load_project(changed(tmp_path / "a.flyreg", ["project", "pairs", 0, "weight"], -1))


def test_a_negative_weight_on_the_boundary_is_named(tmp_path):
    with pytest.raises(LandmarkError, match="weight of landmark upper-1 must be 0 or a positive"):
        load_project(changed(tmp_path / "a.flyreg", ["project", "weights", "upper-1"], -1))


@pytest.mark.parametrize("what", ["id", "name"])
def test_landmarks_that_are_there_twice_are_named(tmp_path, what):
    other = replace(PAIR, **{"id": "user-b", "name": "b", what: getattr(PAIR, what)})
    path = saved(tmp_path / "a.flyreg", replace(PROJECT, pairs=(PAIR, other)))
    with pytest.raises(LandmarkError, match=f"the landmark {what} {getattr(PAIR, what)} is used"):
        load_project(path)


@pytest.mark.parametrize("value", [float("inf"), object()])
def test_a_view_that_json_cannot_hold_is_not_saved(tmp_path, value):
    with pytest.raises(ProjectError, match="the project cannot be saved"):
        save_project(replace(PROJECT, view={"zoom": value}), tmp_path / "a.flyreg")
    assert not list(tmp_path.iterdir())
