"""Undo brings back the very vertices, whatever was done since."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from flyreg_core import edits

pytest.importorskip("PySide6")
from flyreg_gui.runner import Runner
from flyreg_gui.session import Session

from tests.app.hands import LONG_MS

IDS = st.sampled_from(["upper-02", "lower-03", "hole-04", "left-01"])
QUICK_EDITS = st.one_of(
    st.tuples(st.just(edits.set_smoothing), st.floats(1e-6, 10)),
    st.tuples(st.just(edits.set_weights), st.lists(IDS), st.floats(0.01, 100)),
    st.tuples(st.just(edits.remove_pairs), st.lists(IDS)),
    st.tuples(st.just(edits.place_pair), IDS, st.just("target"), st.floats(0.2, 0.8)),
)
"""What leaves the brains as they were prepared."""


@settings(deadline=None, max_examples=4, derandomize=True, suppress_health_check=list(HealthCheck))
@given(steps=st.lists(QUICK_EDITS, min_size=1, max_size=6))
def test_as_many_undos_as_steps_restore_the_very_vertices(qtbot, project, results, pipeline, steps):
    runner = Runner(pipeline)
    session = Session(runner)
    try:
        session.open(project)
        for edit, *arguments in steps:
            session.edit(edit.__name__, edit(session.project, *arguments))
        settled = lambda: session.is_complete or session.failure  # noqa: E731
        qtbot.waitUntil(settled, timeout=LONG_MS)
        while session.undo_stack.canUndo():
            session.undo_stack.undo()
        qtbot.waitUntil(lambda: session.is_complete, timeout=LONG_MS)
        np.testing.assert_array_equal(
            session.results.registration.surface.vertices, results.registration.surface.vertices
        )
    finally:
        runner.close()
