"""Twenty moves of each brain: all are printed, none may prepare it otherwise."""

import numpy as np
import pytest

from flyreg_core.brain_files import open_brain, read_brain
from flyreg_core.mesh import SurfaceMesh
from tests.moved import Move, as_torus, farthest_apart

MOVES = 20


@pytest.mark.parametrize("name", ["FCWB", "FAFB14", "JRC2018F"])
def test_a_brain_is_prepared_the_same_however_it_was_moved(name, capsys):
    raw = read_brain(open_brain(name))
    expected = as_torus(raw)
    away = []
    for seed in range(MOVES):
        move = Move.random(seed)
        torus = as_torus(move.moved(raw))
        back = SurfaceMesh(move.undone(torus.surface.vertices), torus.surface.faces)
        center = move.undone(np.array(torus.oesophagus.center_um))
        away.append(
            [
                farthest_apart(back, expected.surface),
                np.linalg.norm(center - expected.oesophagus.center_um),
            ]
        )
        with capsys.disabled():
            surface, hole = np.array(away[-1]) / expected.pitch
            print(f"{name} {seed}: surface {surface:.2g}, oesophagus {hole:.2g} voxels apart")
    assert np.max(away) < expected.pitch
