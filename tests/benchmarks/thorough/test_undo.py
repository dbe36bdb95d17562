"""Undo and redo of 200 edits of any kind, many times, and against a pipeline that knows nothing."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flyreg_core.errors import FlyregError
from flyreg_core.pipeline import Pipeline
from tests.app.conftest import *  # noqa: F403 - the window's fixtures

pytest.importorskip("PySide6")
from tests.app.test_undo import ANYHOW, MOST, undo_and_redo_everything


@settings(max_examples=20, **ANYHOW)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(MOST // 2, MOST))
def test_undo_and_redo_end_where_the_edited_project_leads_by_itself(
    qtbot, project, pipeline, seed, count
):
    edited, outcome = undo_and_redo_everything(qtbot, project, pipeline, seed, count)
    try:
        anew = Pipeline().run(edited).registration.surface.vertices
    except FlyregError:
        assert isinstance(outcome, str)
    else:
        np.testing.assert_array_equal(np.frombuffer(outcome).reshape(-1, 3), anew)
