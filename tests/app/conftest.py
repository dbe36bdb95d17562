"""Fixtures of the window's tests: the user's folders are temporary, and nothing may survive a test."""

from __future__ import annotations

import sys
import threading
from dataclasses import replace
from functools import partialmethod
from pathlib import Path

import pytest

COARSE = 36
"""Voxels across a brain: enough for the demo's shape, and done in seconds."""


@pytest.fixture(autouse=True)
def own_folders(tmp_path, monkeypatch):
    """Settings, cache and log of a test are its own."""
    for name in ("CONFIG", "CACHE", "STATE", "DATA"):
        monkeypatch.setenv(f"XDG_{name}_HOME", str(tmp_path / name.lower()))
    if "PySide6.QtCore" in sys.modules:
        from PySide6.QtCore import QSettings

        settings = str(tmp_path / "config")
        QSettings.setPath(QSettings.Format.NativeFormat, QSettings.Scope.UserScope, settings)


@pytest.fixture(autouse=True)
def mouse_away(request):
    """The display's own pointer is over no window."""
    if "qapp" in request.fixturenames:
        request.getfixturevalue("qapp")
        from tests.app.hands import put_mouse_away

        put_mouse_away()


@pytest.fixture(autouse=True)
def patience(monkeypatch):
    """Whatever is waited for may take as long as it does on a busy machine."""
    if "PySide6.QtWidgets" in sys.modules:
        from pytestqt.qtbot import QtBot

        from tests.app.hands import LONG_MS

        for name in ("waitUntil", "waitSignal", "waitExposed"):
            patient = partialmethod(getattr(QtBot, name), timeout=LONG_MS)
            monkeypatch.setattr(QtBot, name, patient)


@pytest.fixture(autouse=True)
def nothing_survives():
    """No top-level widget, worker thread or plotter outlives its test."""
    yield
    if "PySide6.QtWidgets" not in sys.modules:
        return
    from PySide6.QtCore import QCoreApplication, QEvent
    from PySide6.QtWidgets import QApplication

    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    if QApplication.instance() is not None:
        assert QApplication.topLevelWidgets() == []
    threads = [thread.name for thread in threading.enumerate()]
    assert not [name for name in threads if name.startswith("flyreg")]
    if "pyvista" in sys.modules:
        from pyvista.plotting.plotter import _ALL_PLOTTERS

        assert [plotter for plotter in _ALL_PLOTTERS.values() if not plotter._closed] == []


@pytest.fixture(scope="session")
def demo_files(tmp_path_factory) -> tuple[Path, Path]:
    """The demo pair as files."""
    from flyreg_resources.demo import make_demo_pair

    from flyreg_core.brain_files import write_mesh

    folder = tmp_path_factory.mktemp("demo")
    paths = (folder / "source.ply", folder / "target.ply")
    for path, mesh in zip(paths, make_demo_pair(), strict=True):
        write_mesh(path, mesh, "um")
    return paths


@pytest.fixture(scope="session")
def project(demo_files):
    """The demo pair with coarse voxels."""
    from flyreg_core.brain_files import open_brain
    from flyreg_core.project import Brain, Project

    source, target = (Brain(open_brain(str(path), "um")) for path in demo_files)
    voxels = replace(source.solid, voxels_across=COARSE)
    return Project(replace(source, solid=voxels), replace(target, solid=voxels))


@pytest.fixture(scope="session")
def pipeline():
    """One pipeline for all tests: brains that it has prepared once it remembers."""
    from flyreg_core.pipeline import Pipeline

    return Pipeline()


@pytest.fixture(scope="session")
def results(project, pipeline):
    """What follows from the demo project."""
    return pipeline.run(project)


@pytest.fixture(scope="session")
def memory(pipeline, results):
    """What each stage remembers when it has registered the demo project and nothing else."""
    from flyreg_core.memo import Memo

    memos = [stage for stage in vars(pipeline).values() if isinstance(stage, Memo)]
    return [(memo, list(memo._remembered)) for memo in memos]


@pytest.fixture
def empty_window(qtbot, pipeline):
    """The window as it opens, with nothing in it."""
    from flyreg_gui.main_window import MainWindow
    from PySide6.QtCore import Qt
    from PySide6.QtWidgets import QApplication

    from tests.app.hands import activate

    QApplication.setAttribute(Qt.ApplicationAttribute.AA_DontUseNativeDialogs)
    window = MainWindow(pipeline)
    window.resize(1500, 950)
    window.show()
    qtbot.waitExposed(window)
    activate(qtbot, window)
    yield window
    window.session.undo_stack.setClean()
    window.close()
    window.deleteLater()


@pytest.fixture
def window(qtbot, empty_window, project, memory):
    """The window with the demo project registered, and no trace of what earlier tests ran."""
    from tests.app.hands import settle

    for memo, remembered in memory:
        memo._remembered = list(remembered)
    empty_window.session.open(project)
    settle(qtbot, empty_window)
    return empty_window
