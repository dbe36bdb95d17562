"""Taking results away: vertex pairs for other programs, and points carried along."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtWidgets import QFileDialog

from flyreg_core.brain_files import UM_PER_UNIT
from flyreg_core.errors import FlyregError
from flyreg_core.point_files import read_points, write_points
from flyreg_core.transform import REACH_UM, carry
from flyreg_core.vertex_pairs import write_vertex_pairs
from flyreg_gui.dialogs import ask_for_saving_path
from flyreg_gui.failures import sentence_for

if TYPE_CHECKING:
    from flyreg_gui.main_window import MainWindow

POINTS_FILTER = "Tables with columns x, y, z (*.csv);;All files (*)"


class TakingAway:
    """What of the File menu needs an up-to-date registration."""

    def __init__(self, window: MainWindow) -> None:
        self._window = window

    def export_vertex_pairs(self) -> None:
        """Ask for a file and write vertex pairs that navis makes a transform of."""
        results = self._window.session.results
        path = self._ask_where("Export vertex pairs", "vertex-pairs.csv")
        if results is None or path is None:
            return
        try:
            count = write_vertex_pairs(path, results)
        except (FlyregError, OSError) as error:
            self._window.show_problem(sentence_for(error))
        else:
            self._window.say(f"Exported {count} vertex pairs to {path}")

    def carry_points(self, *, is_inverse: bool = False) -> None:
        """Ask for a table of points near one brain's surface, and write them on the other brain."""
        results = self._window.session.results
        folder = self._window.preferences.folder
        text, _ = QFileDialog.getOpenFileName(self._window, "Points", folder, POINTS_FILTER)
        if results is None or not text:
            return
        path = Path(text)
        end = self._ask_where("Save the carried points", f"{path.stem}-registered.csv")
        if end is None:
            return
        units = [results.project.source.input.unit, results.project.target.input.unit]
        if is_inverse:
            units.reverse()
        try:
            table = read_points(path)
            moved = carry(table.points * UM_PER_UNIT[units[0]], results, REACH_UM, is_inverse)
            write_points(end, table, moved, UM_PER_UNIT[units[1]])
        except (FlyregError, OSError) as error:
            self._window.show_problem(sentence_for(error))
            return
        outside = int((~moved.is_mapped).sum())
        lost = f"; {outside} lie farther than {REACH_UM:.0f} µm from the surface" if outside else ""
        self._window.say(f"Carried {len(moved.is_mapped)} points to {end}{lost}")

    def _ask_where(self, title: str, name: str) -> Path | None:
        suggestion = Path(self._window.preferences.folder) / name
        return ask_for_saving_path(self._window, title, suggestion, "CSV (*.csv)", ".csv")
