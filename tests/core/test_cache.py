"""Prepared brains on disk: the same results, whatever happens to the folder."""

from __future__ import annotations

import io
import os
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flyreg_core import edits
from flyreg_core.archive import ArchiveError, read_archive, write_archive
from flyreg_core.cache import FOLDER_VARIABLE, Cache, key_of, open_cache
from flyreg_core.cut_height import CutParameters
from flyreg_core.errors import Cancelled, InputError
from flyreg_core.mesh import SurfaceMesh
from flyreg_core.pipeline import Pipeline
from flyreg_core.project import Project

VALUES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**60), 2**60)
    | st.floats(allow_nan=False)
    | st.text(),
    lambda parts: (
        st.tuples(parts, parts)
        | st.lists(parts, max_size=3)
        | st.dictionaries(st.text() | st.tuples(st.text(), st.none()), parts, max_size=3)
    ),
    max_leaves=10,
)


def there_and_back(value):
    file = io.BytesIO()
    write_archive(file, value)
    file.seek(0)
    return read_archive(file)


@pytest.fixture(scope="module")
def kept(demo_project: Project, tmp_path_factory: pytest.TempPathFactory):
    """A cache, the pipeline that prepared the demo into it, and what followed."""
    cache = Cache(tmp_path_factory.mktemp("cache"))
    pipeline = Pipeline(cache)
    return cache, pipeline, pipeline.run(demo_project)


def files_of(cache: Cache) -> list[Path]:
    return sorted(cache.folder.iterdir())


@given(value=VALUES)
def test_plain_values_come_back_as_they_were(value):
    assert there_and_back(value) == value


def test_what_is_shared_stays_shared_and_arrays_cannot_be_changed():
    mesh = SurfaceMesh(np.eye(3), np.array([[0, 1, 2]]))
    first, second, array = there_and_back((mesh, mesh, mesh.vertices))
    assert first is second
    assert first.vertices is array
    assert np.array_equal(array, np.eye(3))
    assert not array.flags.writeable


def test_nothing_but_values_of_the_engine_is_written_or_read():
    @dataclass
    class Foreign:
        part: int

    with pytest.raises(TypeError, match="Foreign"):
        write_archive(io.BytesIO(), Foreign(1))
    with pytest.raises(ArchiveError):
        read_archive(io.BytesIO(b"not an archive"))


def test_a_program_that_finds_prepared_brains_gives_the_same_results(kept, demo_project):
    cache, _, first = kept
    second = Pipeline(cache).run(demo_project)
    assert {"solid", "torus", "flatten", "shape map"}.isdisjoint(
        name for name, seconds in second.seconds.items() if seconds > 0
    )
    assert np.array_equal(second.registration.surface.vertices, first.registration.surface.vertices)
    assert second.registration.residual_um == first.registration.residual_um
    assert second.warnings == first.warnings
    assert second.distances == first.distances


def test_brains_that_are_kept_count_as_prepared_and_others_do_not(kept, demo_project, tmp_path):
    cache, pipeline, _ = kept
    other = replace(demo_project, source=replace(demo_project.source, cut=CutParameters(3.0)))
    for known in (pipeline, Pipeline(cache)):
        assert known.is_prepared(demo_project)
        assert known.is_prepared(edits.set_smoothing(demo_project, 0.5))
        assert not known.is_prepared(other)
    assert not Pipeline(Cache(tmp_path)).is_prepared(demo_project)
    assert not Pipeline().is_prepared(demo_project)


def test_edits_after_opening_are_those_of_brains_prepared_anew(kept, demo_project):
    cache, prepared, _ = kept
    edited = edits.set_brain(
        edits.set_weight(demo_project, "upper-04", 30.0),
        "source",
        replace(demo_project.source, cut=CutParameters(3.0)),
    )
    opened = Pipeline(Cache(cache.folder))
    opened.run(demo_project, measure=False)
    one, other = opened.run(edited), prepared.run(edited)
    assert np.array_equal(one.registration.surface.vertices, other.registration.surface.vertices)


def test_the_same_brain_at_another_place_is_known(kept, demo_project, tmp_path):
    cache, *_ = kept
    copy = tmp_path / Path(demo_project.source.input.path).name
    copy.write_bytes(Path(demo_project.source.input.path).read_bytes())
    moved = replace(demo_project.source.input, path=str(copy), name="my brain")
    elsewhere = replace(demo_project, source=replace(demo_project.source, input=moved))
    results = Pipeline(cache).run(elsewhere, measure=False)
    assert results.seconds["torus"] == 0
    assert results.source.brain.input.name == "my brain"


def test_a_brain_whose_file_has_changed_is_refused_as_ever(kept, demo_project, tmp_path):
    cache, *_ = kept
    changed = tmp_path / "changed.ply"
    changed.write_bytes(Path(demo_project.source.input.path).read_bytes() + b" ")
    other = replace(demo_project.source.input, path=str(changed))
    with pytest.raises(InputError, match="has changed"):
        Pipeline(cache).run(replace(demo_project, source=replace(demo_project.source, input=other)))


@pytest.mark.parametrize("length", [0, 100, 5000])
def test_a_damaged_file_is_as_none_and_makes_room_for_a_new_one(tmp_path, length):
    cache = Cache(tmp_path)
    cache.put("key", (np.arange(1000), "text"))
    (path,) = files_of(cache)
    path.write_bytes(path.read_bytes()[:length])
    assert cache.get("key") is None
    assert files_of(cache) == []
    cache.put("key", 1)
    assert cache.get("key") == 1


def test_a_folder_that_cannot_be_written_is_done_without(tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    cache = Cache(blocked / "cache")
    cache.put("key", 1)
    assert cache.get("key") is None


def test_the_oldest_make_room_and_what_is_read_counts_as_new(tmp_path):
    cache = Cache(tmp_path)
    block = np.zeros(10_000)
    for age, key in enumerate(("a", "b", "c")):
        cache.put(key, block)
        os.utime(tmp_path / f"{key}.prepared", (age, age))
    assert cache.get("a") is not None
    small = Cache(tmp_path, most_bytes=3 * block.nbytes + 3000)
    small.put("d", block)
    assert [cache.get(key) is not None for key in "abcd"] == [True, False, True, True]


def test_the_key_is_of_content_and_parameters_alone(demo_project):
    brain = demo_project.source
    elsewhere = replace(brain, input=replace(brain.input, path="/elsewhere", name="other"))
    finer = replace(brain, cut=CutParameters(1.0))
    changed = replace(brain, input=replace(brain.input, sha256="0"))
    assert key_of("x", brain) == key_of("x", elsewhere)
    assert len({key_of("x", one) for one in (brain, finer, changed)}) == 3


def test_the_folder_is_that_of_the_platform_or_as_told_or_none(monkeypatch, tmp_path):
    monkeypatch.setenv(FOLDER_VARIABLE, "off")
    assert open_cache() is None
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path))
    assert open_cache().folder == tmp_path
    monkeypatch.delenv(FOLDER_VARIABLE)
    assert "flyreg" in str(open_cache().folder)


def test_cancelling_leaves_no_half_written_file(demo_project, tmp_path):
    def cancel(fraction, text):
        raise Cancelled

    cache = Cache(tmp_path)
    with pytest.raises(Cancelled):
        Pipeline(cache).run(demo_project, cancel)
    assert files_of(cache) == []
