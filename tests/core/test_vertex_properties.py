import numpy as np
import pytest

from flyreg_core.landmarks import HALVES
from flyreg_core.pipeline import Pipeline
from flyreg_core.vertex_properties import INFLUENCE_WIDTH, weight_influence


def test_the_influence_of_weights_is_the_sum_of_what_each_landmark_has(demo_project):
    results = Pipeline().run(demo_project, measure=False)
    expected = np.zeros(len(results.source.surface.vertices))
    for half in HALVES:
        flat = results.source.halves[half]
        for mark in results.landmarks:
            if half in mark.plane:
                away = np.linalg.norm(flat.plane - mark.plane[half][0], axis=1)
                faded = np.exp(-((away / INFLUENCE_WIDTH) ** 2) / 2)
                np.add.at(expected, flat.vertex_of, mark.weight * faded)
    assert expected.max() > 0
    assert weight_influence(results) == pytest.approx(expected, rel=1e-9, abs=1e-12)
