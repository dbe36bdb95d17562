"""What simplifying and smoothing cost the shape of the brains on show, as curves."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import QByteArray, QSize, Qt
from PySide6.QtSvgWidgets import QSvgWidget
from PySide6.QtWidgets import (
    QComboBox,
    QHBoxLayout,
    QLabel,
    QProgressBar,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from flyreg_core.brain_files import voxel_edge_um
from flyreg_core.distortion_curves import DistortionCurves, draw_curves, find_curves
from flyreg_core.progress import Report
from flyreg_core.results import PreparedBrain, Results
from flyreg_gui.failures import sentence_for
from flyreg_gui.theme import css, current_theme
from flyreg_gui.work import Work
from flyreg_gui.working_dialog import WorkingDialog

SIZE = QSize(1000, 464)


class CurvesDialog(WorkingDialog):
    """Computes the curves of one brain at a time, and shows them with what is recommended."""

    def __init__(self, results: Results, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle("What simplifying and smoothing cost")
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.setModal(True)
        self._brains = {"Source": results.source, "Target": results.target}
        self._known: dict[str, DistortionCurves] = {}
        self.brain = QComboBox()
        for role, prepared in self._brains.items():
            self.brain.addItem(f"{role}: {prepared.brain.input.name}", role)
        self.picture = QSvgWidget()
        self.picture.setMinimumSize(SIZE)
        self.picture.renderer().setAspectRatioMode(Qt.AspectRatioMode.KeepAspectRatio)
        self.reasons = QLabel()
        self.reasons.setWordWrap(True)
        self.reasons.setTextFormat(Qt.TextFormat.PlainText)
        self.bar = QProgressBar()
        self.bar.setRange(0, 100)
        self.bar.setAccessibleName("How far the curves are measured")
        self.cancel_button, self.close_button = QPushButton("Cancel"), QPushButton("Close")
        self._arrange()
        self.brain.currentIndexChanged.connect(self._on_chosen)
        self.cancel_button.clicked.connect(self._on_cancel)
        self.close_button.clicked.connect(self.close)
        self._on_chosen()

    def _arrange(self) -> None:
        below = QHBoxLayout()
        below.addWidget(self.bar, 1)
        below.addWidget(self.cancel_button)
        below.addStretch(0)
        below.addWidget(self.close_button)
        layout = QVBoxLayout(self)
        layout.addWidget(self.brain, 0, Qt.AlignmentFlag.AlignLeft)
        layout.addWidget(self.picture, 1)
        layout.addWidget(self.reasons)
        layout.addLayout(below)

    def _on_chosen(self) -> None:
        self._end()
        role = self.brain.currentData()
        if role in self._known:
            self._show(self._known[role])
            return
        self.picture.load(QByteArray())
        self.reasons.setText("Each curve is measured on the main brain, as it is prepared now.")
        self.bar.setValue(0)
        work = Work(partial(_curves_of, self._brains[role]), self)
        work.progressed.connect(self._on_progressed)
        work.finished.connect(self._on_finished)
        work.failed.connect(self._on_failed)
        work.stopped.connect(self._on_stopped)
        self._work = work
        self._show_busy(True)
        work.start()

    def _on_cancel(self) -> None:
        if self._work is not None:
            self._work.cancel()

    def _on_progressed(self, fraction: float, text: str) -> None:
        if self.sender() is self._work:
            self.bar.setValue(round(100 * fraction))

    def _on_finished(self, curves: DistortionCurves) -> None:
        if self.sender() is self._work:
            self._end()
            self._known[self.brain.currentData()] = curves
            self._show(curves)

    def _on_failed(self, error: Exception) -> None:
        if self.sender() is self._work:
            self._end()
            self.reasons.setText(sentence_for(error))

    def _on_stopped(self) -> None:
        if self.sender() is self._work:
            self._end()
            self.reasons.setText("Cancelled; choose a brain to measure it again.")

    def _show(self, curves: DistortionCurves) -> None:
        svg = draw_curves(curves, ink=css(current_theme().text))
        self.picture.load(QByteArray(svg.encode()))
        self.reasons.setText(
            f"Recommended for simplification: {curves.simplification.reason}.\n"
            f"Recommended for smoothing: {curves.smoothing.reason}."
        )

    def _show_busy(self, busy: bool) -> None:
        self.bar.setVisible(busy)
        self.cancel_button.setVisible(busy)


def _curves_of(prepared: PreparedBrain, report: Report) -> DistortionCurves:
    edge = voxel_edge_um(prepared.brain.input)
    return find_curves(prepared.torus.surface, edge, report)
