"""Brains given as 100,000 points, in samples drawn at random: how far they are prepared otherwise."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from flyreg_core.brain_files import open_brain, read_brain
from tests.core.test_any_input import POINTS, SAME
from tests.moved import as_torus, vertices_apart

SAMPLES = {"FCWB": 20, "JFRC2": 2, "JRC2018F": 2}


@pytest.mark.parametrize("name", SAMPLES)
def test_samples_of_a_brain_are_prepared_as_the_brain_is(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    raw = read_brain(open_brain(name))
    expected = as_torus(raw)
    mesh = trimesh.Trimesh(raw.vertices, raw.faces, process=False)
    for seed in range(SAMPLES[name]):
        points, face = trimesh.sample.sample_surface(mesh, POINTS, seed=seed)
        for form, columns in (
            ("alone", points),
            ("with normals", np.column_stack([points, raw.face_normals[face]])),
        ):
            header = " ".join(("x", "y", "z", "nx", "ny", "nz")[: columns.shape[1]])
            path = tmp_path / f"{seed}-{columns.shape[1]}.xyz"
            np.savetxt(path, columns, "%.5f", header=header, comments="")
            torus = as_torus(read_brain(open_brain(str(path))))
            away = vertices_apart(torus.surface, expected.surface) / expected.pitch
            beyond = int((away > SAME).sum())
            with capsys.disabled():
                print(f"\n{name} {seed} {form}: at most {away.max():.2f} voxels, {beyond} beyond 2")
            assert name != "FCWB" or beyond == 0
