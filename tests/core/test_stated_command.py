"""What is not in a file can be said as options of `flyreg register`, or it is told what cannot."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flyreg_core.arguments import make_parser
from flyreg_core.brain_files import open_brain, read_brain, write_mesh
from flyreg_core.cli import _COMMANDS, _project
from flyreg_core.cut_height import CutParameters
from flyreg_core.flatten import FlattenParameters
from flyreg_core.handles import HandleParameters
from flyreg_core.landmarks import LandmarkPair, LandmarkParameters
from flyreg_core.pose import PoseParameters
from flyreg_core.project import Brain, Project
from flyreg_core.simplify import SimplifyParameters
from flyreg_core.smooth import SmoothParameters
from flyreg_core.solid import SolidParameters
from flyreg_core.stated_command import only_in_a_file, stated_words
from flyreg_core.trim import TrimParameters

numbers = st.floats(-1e4, 1e4)
points = st.tuples(numbers, numbers, numbers)
handles = st.builds(
    HandleParameters,
    st.none() | points,
    st.lists(points, max_size=2).map(tuple),
    st.lists(st.tuples(points, points), max_size=2).map(tuple),
)
brains = st.fixed_dictionaries(
    {
        "pose": st.builds(PoseParameters, st.sampled_from([None, "LVP", "RDA"])),
        "trim": st.builds(TrimParameters, st.none() | numbers, st.none() | numbers),
        "handles": handles,
    }
)
shared = st.fixed_dictionaries(
    {
        "solid": st.builds(SolidParameters, st.integers(8, 200)),
        "simplify": st.builds(SimplifyParameters, st.none() | st.integers(100, 9999)),
        "smooth": st.builds(SmoothParameters, st.integers(0, 900)),
        "flatten": st.builds(FlattenParameters, st.none() | st.integers(1, 900)),
    }
)


def read(words: list[str]) -> Project:
    """The project that the command would register."""
    return _project(make_parser(_COMMANDS).parse_args(words[1:]))


def plain(demo_files: tuple[Path, Path]) -> Project:
    return Project(*(Brain(open_brain(str(path), "um")) for path in demo_files))


@settings(deadline=None, max_examples=40)
@given(
    source=brains,
    target=brains,
    both=shared,
    pairing=st.sampled_from(["shape", "coordinate", "arc length", "nearest"]),
    smoothing=st.floats(0, 1e6),
)
def test_the_command_asks_for_the_project_to_the_last_bit(
    demo_files: tuple[Path, Path], source, target, both, pairing, smoothing
) -> None:
    start = plain(demo_files)
    project = replace(
        start,
        source=replace(start.source, **source, **both),
        target=replace(start.target, **target, **both),
        boundary=LandmarkParameters(pairing=pairing),
        smoothing=smoothing,
    )
    assert only_in_a_file(project) == []
    assert read(stated_words(project)) == project


def test_the_unit_is_said_and_places_are_in_it(
    tmp_path: Path, demo_files: tuple[Path, Path]
) -> None:
    start, path = plain(demo_files), tmp_path / "in nm.ply"
    write_mesh(path, read_brain(start.source.input), "nm")
    source = Brain(open_brain(str(path), "nm"), handles=HandleParameters(hole=(1.5, 0.25, -3.0)))
    project = replace(start, source=source)
    words = stated_words(project)
    assert "--source-hole=1500.0,250.0,-3000.0" in words
    assert read(words) == project


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"pairs": (LandmarkPair("a", "a", "upper", None, 0.5, 0.5),)}, "landmarks of your own"),
        ({"weights": {"corner-upper-left": 2.0}}, "weights"),
        ({"muted": ("corner-upper-left",)}, "muted or soloed landmarks"),
        ({"boundary": LandmarkParameters(per_half=3)}, "the numbers of landmarks"),
    ],
)
def test_what_no_option_can_say_is_named(demo_files: tuple[Path, Path], change, told) -> None:
    assert only_in_a_file(replace(plain(demo_files), **change)) == [told]


def test_what_differs_between_the_brains_is_named(demo_files: tuple[Path, Path]) -> None:
    start = plain(demo_files)
    finer = replace(start, source=replace(start.source, solid=SolidParameters(70)))
    moved = replace(start, target=replace(start.target, cut=CutParameters(shift_um=3.0)))
    assert only_in_a_file(finer) == ["preparation settings that differ between the brains"]
    assert only_in_a_file(moved) == ["moved cuts"]
