"""A thousand clicks in each of the five views of the window, at one and two pixels per point.

Run as a program it does so once, at the screen's pixels per point, and prints what went wrong.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
VIEWS = ("source", "target", "registered", "anterior", "posterior")
CLICKS, TURNS = 250, 4


@pytest.mark.parametrize("ratio", ["1", "2"])
def test_a_thousand_clicks_in_each_view_mean_the_face_that_is_drawn_there(ratio):
    run = subprocess.run(
        [sys.executable, "-m", "tests.benchmarks.thorough.test_picking"],
        cwd=ROOT,
        env={**os.environ, "QT_SCALE_FACTOR": ratio, "PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        check=False,
    )
    print(run.stdout)
    expected = [f"{view}: {CLICKS * TURNS} clicks, 0 mispicks" for view in VIEWS]
    assert run.stdout.splitlines() == [f"pixels per point {ratio}", *expected], run.stderr


def main() -> int:
    """Click all over the window with the demo in it, from four sides."""
    from flyreg_gui.main_window import MainWindow
    from flyreg_resources.demo import make_demo_pair
    from PySide6.QtWidgets import QApplication

    from flyreg_core.brain_files import open_brain, write_mesh
    from flyreg_core.pipeline import Pipeline
    from flyreg_core.project import Brain, Project
    from tests.app.picks import window_mispicks

    app = QApplication(sys.argv[:1])
    window = MainWindow(Pipeline())
    window.resize(1200, 800)
    window.show()
    with tempfile.TemporaryDirectory() as folder:
        brains = []
        for name, mesh in zip(("source.ply", "target.ply"), make_demo_pair(), strict=True):
            write_mesh(Path(folder) / name, mesh, "um")
            brains.append(Brain(open_brain(str(Path(folder) / name), "um")))
        window.session.open(Project(*brains))
        while not window.session.is_complete:
            app.processEvents()
    print(f"pixels per point {window.devicePixelRatioF():g}")
    wrong: dict[str, list[str]] = {view: [] for view in VIEWS}
    for turn in range(TURNS):
        window.view_area.source.canvas.renderer.GetActiveCamera().Azimuth(70)
        window.view_area.source.canvas.renderer.GetActiveCamera().Elevation(15)
        window.view_area.source.canvas.camera_moved.emit()
        app.processEvents()
        for view in VIEWS:
            wrong[view] += window_mispicks(window, view, CLICKS, turn)
    for view, mispicks in wrong.items():
        print(f"{view}: {CLICKS * TURNS} clicks, {len(mispicks)} mispicks", *mispicks[:3])
    window.session.undo_stack.setClean()
    window.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
