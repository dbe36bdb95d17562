"""Undo takes anything back, and redo brings it again: the project, and the very vertices."""

from __future__ import annotations

import inspect

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, example, given, settings
from hypothesis import strategies as st

from flyreg_core import edits

pytest.importorskip("PySide6")
from flyreg_gui.runner import Runner
from flyreg_gui.session import Session
from PySide6.QtWidgets import QApplication

from tests.app.random_edits import WAYS, RandomUser

MOST = 200
ANYHOW = {
    "deadline": None,
    "derandomize": True,
    "phases": [Phase.explicit, Phase.generate],  # the seed tells enough to repeat it
    "suppress_health_check": list(HealthCheck),
}


@settings(max_examples=1, **ANYHOW)
@example(seed=3, count=MOST)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, MOST))
def test_undo_takes_200_edits_of_any_kind_back_and_redo_brings_them_again(
    qtbot, project, pipeline, seed, count
):
    undo_and_redo_everything(qtbot, project, pipeline, seed, count)


def test_the_random_user_knows_every_edit():
    told = [
        name
        for name, edit in inspect.getmembers(edits, inspect.isfunction)
        if edit.__module__ == edits.__name__ and not name.startswith("_") and name != "brain_of"
    ]
    assert set(told) <= set(WAYS)


def undo_and_redo_everything(qtbot, project, pipeline, seed, count):
    """Do so many random edits, take all of them back, do them again; compare at each place.

    The text of a project tells all of it, and tells when an edit changed what was not its own.
    Runs on the way are replaced by newer ones, as under a quick hand. Return the last outcome.
    """
    rng = np.random.default_rng(seed)
    runner = Runner(pipeline)
    session = Session(runner)
    stack, states = session.undo_stack, {0: repr(project)}

    def remember(place):
        states[place] = repr(session.project)

    def outcome():
        """Return the vertices of the newest project, or why there are none."""
        qtbot.waitUntil(lambda: session.is_complete or session.failure is not None)
        if session.failure is not None:
            return session.failure.sentence
        return session.results.registration.surface.vertices.tobytes()

    try:
        session.open(project)
        first = outcome()
        user = RandomUser(session)
        stack.indexChanged.connect(remember)
        while stack.index() < count:
            user.act(rng)
            assert repr(session.project) == states[stack.index()]
            if rng.uniform() < 0.1:
                QApplication.processEvents()  # else runs are replaced before they begin
        stack.indexChanged.disconnect(remember)
        last, done = outcome(), stack.index()
        for place in reversed(range(done)):
            stack.undo()
            assert repr(session.project) == states[place]
        assert session.project == project
        assert outcome() == first
        for place in range(done):
            stack.redo()
            assert repr(session.project) == states[place + 1]
        assert outcome() == last
        return session.project, last
    finally:
        runner.close()
