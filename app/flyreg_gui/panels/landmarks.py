"""The right dock: the table of landmarks, the weight of the selected ones, and lambda."""

from __future__ import annotations

from collections.abc import Iterable

from PySide6.QtCore import (
    QItemSelection,
    QItemSelectionModel,
    QPoint,
    QSortFilterProxyModel,
    Qt,
    QTimer,
    Signal,
)
from PySide6.QtWidgets import (
    QComboBox,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from flyreg_core import edits
from flyreg_core.cross_validation import Advice
from flyreg_core.errors import FlyregError
from flyreg_core.landmarks import LandmarkPair
from flyreg_core.project import Project
from flyreg_gui.elided_label import ElidedLabel
from flyreg_gui.landmark_table import ID_ROLE, SORT_ROLE, LandmarkTable, format_weight
from flyreg_gui.panels.neighbourhood import NeighbourhoodBar
from flyreg_gui.panels.smoothing_curve import KINDS, NOT_YET, SmoothingCurve
from flyreg_gui.panels.weight_column import LandmarkTableView
from flyreg_gui.selection import Selection
from flyreg_gui.session import Session
from flyreg_gui.sliders import SMOOTHING_SCALE, WEIGHT_SCALE, LogSlider

SELECT_ROWS = (
    QItemSelectionModel.SelectionFlag.ClearAndSelect | QItemSelectionModel.SelectionFlag.Rows
)
GAP = 8
"""Pixels between a label and what it names."""
MANY = 3
"""Up to how many selected landmarks are named."""
BETWEEN_NUMBERS_MS = 500
"""How long the numbers of all landmarks stand while a hand moves: drawing them takes longer than all
else that follows one move, and nobody reads them faster."""


class LandmarksPanel(QWidget):
    """Shows the landmarks down, sends weights and lambda up."""

    refused = Signal(str)  # an edit that cannot be made, and why
    look_at_asked = Signal(str)  # id of a landmark
    menu_asked = Signal(QPoint)  # where on the screen

    def __init__(self, session: Session, selection: Selection) -> None:
        super().__init__()
        self._session, self._selection = session, selection
        self.model = LandmarkTable(self)
        self._sorted = QSortFilterProxyModel(self)
        self._sorted.setSourceModel(self.model)
        self._sorted.setSortRole(SORT_ROLE)
        self.table = LandmarkTableView()
        self.table.setModel(self._sorted)
        self.table.arrange_columns()
        self.table.horizontalHeader().setSortIndicator(-1, Qt.SortOrder.AscendingOrder)
        self.table.setAccessibleName("Landmarks")
        self.weight_slider = LogSlider(WEIGHT_SCALE)
        self.weight_slider.setAccessibleName("Weight of the selected landmarks")
        self.smoothing_slider = LogSlider(SMOOTHING_SCALE)
        self.smoothing_slider.setAccessibleName("Smoothing lambda")
        self._weight_label, self._weight_value = ElidedLabel(), QLabel()
        self._smoothing_value = QLabel()
        self.curve = SmoothingCurve(SMOOTHING_SCALE)
        self.curve_choice = QComboBox()
        self.curve_choice.setAccessibleName("Curve of lambda")
        self.curve_choice.setToolTip("What is drawn above the slider of λ")
        for kind, title in KINDS:
            self.curve_choice.addItem(title, kind)
        self.neighbourhood = NeighbourhoodBar()
        self.accept_button = QPushButton("Accept suggestions")
        self.accept_button.setToolTip(
            "Make the selected suggestions landmarks of your own; Delete drops them instead"
        )
        self.best_button = QPushButton()
        self._is_showing = False
        self._results = session.results  # whose numbers are on show
        self._pause = QTimer(self)
        self._pause.setSingleShot(True)
        self._pause.setInterval(BETWEEN_NUMBERS_MS)
        self._arrange()
        self._connect()
        self._on_project(session.project)

    def _arrange(self) -> None:
        self.smoothing_slider.setToolTip(
            "Left: the spline passes through every landmark. Right: it bends less and less."
        )
        smoothing = QHBoxLayout()
        smoothing.setSpacing(GAP)
        smoothing.addWidget(QLabel("Smoothing"))
        smoothing.addWidget(self.curve_choice)
        smoothing.addStretch(1)
        sliders = QGridLayout()
        sliders.setVerticalSpacing(2)
        sliders.addWidget(self._weight_label, 0, 0)
        sliders.addLayout(smoothing, 4, 0)
        for row, (value, slider) in enumerate(
            (
                (self._weight_value, self.weight_slider),
                (self._smoothing_value, self.smoothing_slider),
            )
        ):
            value.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
            sliders.addWidget(value, 4 * row, 1)
            sliders.addWidget(slider, 4 * row + 2, 0, 1, 2)
        sliders.addWidget(self.neighbourhood, 3, 0, 1, 2)
        sliders.addWidget(self.curve, 5, 0, 1, 2)
        sliders.setColumnStretch(0, 1)
        buttons = QHBoxLayout()
        buttons.addWidget(self.accept_button)
        buttons.addWidget(self.best_button)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(4, 4, 4, 8)
        self.setMinimumWidth(360)
        layout.addWidget(self.table, 1)
        layout.addLayout(sliders)
        layout.addLayout(buttons)

    def _connect(self) -> None:
        session, table = self._session, self.table
        table.weight_drag_started.connect(session.begin_gesture)
        table.weight_dragged.connect(self._on_row_dragged)
        table.weight_drag_ended.connect(session.end_gesture)
        table.weights.typed.connect(self._on_row_dragged)
        table.names.renamed.connect(self._on_renamed)
        table.doubleClicked.connect(lambda index: self.look_at_asked.emit(index.data(ID_ROLE)))
        table.selectionModel().selectionChanged.connect(self._on_rows_selected)
        for slider in (self.weight_slider, self.smoothing_slider):
            slider.sliderPressed.connect(session.begin_gesture)
            slider.sliderReleased.connect(session.end_gesture)
        self.weight_slider.edited.connect(self._on_weight)
        self.smoothing_slider.edited.connect(self._on_smoothing)
        table.setContextMenuPolicy(Qt.ContextMenuPolicy.CustomContextMenu)
        table.customContextMenuRequested.connect(
            lambda place: self.menu_asked.emit(table.viewport().mapToGlobal(place))
        )
        self.best_button.clicked.connect(self._on_best)
        self.curve_choice.activated.connect(
            lambda row: self.curve.show_kind(self.curve_choice.itemData(row))
        )
        self._selection.changed.connect(self._on_selection)
        session.project_changed.connect(self._on_project)
        session.results_changed.connect(self._on_results)
        self._pause.timeout.connect(self._show_numbers)

    # The user's hand

    def _on_row_dragged(self, identifier: str, weight: float) -> None:
        chosen = self._selection.ids
        self._set_weights(chosen if identifier in chosen else (identifier,), weight)

    def _on_weight(self, weight: float) -> None:
        self._set_weights(self._selection.ids, weight)

    def _set_weights(self, ids: Iterable[str], weight: float) -> None:
        names, chosen = self._names(ids), tuple(ids)
        project = self._session.project
        if project is not None and chosen:
            changed = edits.set_weights(project, chosen, weight)
            self._session.edit(f"change weight of {names}", changed)

    def _on_smoothing(self, smoothing: float) -> None:
        project = self._session.project
        if project is not None:
            self._session.edit("change smoothing", edits.set_smoothing(project, smoothing))

    def _on_best(self) -> None:
        suggested = self._suggested_smoothing()
        if suggested is not None:
            self._on_smoothing(suggested)

    @property
    def suggested(self) -> list[LandmarkPair]:
        """The selected suggestions that are in use."""
        return [pair for pair in self.chosen if pair.origin == "suggested" and pair.weight > 0]

    @property
    def chosen(self) -> list[LandmarkPair]:
        """The selected pairs, in the order in which they were selected."""
        pairs = (self.model.pair_of(identifier) for identifier in self._selection.ids)
        return [pair for pair in pairs if pair is not None]

    def _suggested_smoothing(self) -> float | None:
        """Return the smoothing that cross-validation speaks for, once the newest results are judged."""
        project, results = self._session.project, self._session.results
        if project is None or results is None or results.judgement is None:
            return None
        return results.judgement.cross_validation.advise(project.smoothing).smoothing

    def _on_renamed(self, identifier: str, name: str) -> None:
        project = self._session.project
        if project is None:
            return
        try:
            self._session.edit("rename landmark", edits.rename_pair(project, identifier, name))
        except FlyregError as error:
            self.refused.emit(str(error))

    def _on_rows_selected(self, _selected: QItemSelection, _deselected: QItemSelection) -> None:
        if not self._is_showing:
            rows = self.table.selectionModel().selectedRows()
            chosen = [str(index.data(ID_ROLE)) for index in rows]
            kept = [identifier for identifier in self._selection.ids if identifier in chosen]
            self._selection.select([*kept, *chosen])

    # What is shown

    def _on_project(self, project: Project | None) -> None:
        self.model.show(project, self._results)
        self._selection.keep(self.model.ids)
        self.smoothing_slider.setEnabled(project is not None)
        self.neighbourhood.setEnabled(self._session.results is not None)
        self.curve.setVisible(project is not None)
        self.curve_choice.setVisible(project is not None)
        if project is not None:
            self.smoothing_slider.show_value(project.smoothing)
            self._smoothing_value.setText(f"λ = {format_smoothing(project.smoothing)}")
            results = self._session.results
            if results is None:
                self.curve.forget()
            judged = None if results is None else results.judgement
            self.curve.show_curve(judged, project.smoothing)
        self._show_advice(self.curve.advice if project is not None else None)
        self._on_selection()

    def _show_advice(self, advice: Advice | None) -> None:
        """Offer the smoothing that cross-validation speaks for, or say that it speaks for none."""
        self.best_button.setEnabled(self._suggested_smoothing() is not None)
        self.best_button.setToolTip(NOT_YET if advice is None else advice.reason)
        if advice is None:
            self.best_button.setText("λ by cross-validation")
        elif advice.smoothing is None:
            self.best_button.setText("No better λ known")
        else:
            self.best_button.setText(f"Take λ = {format_smoothing(advice.smoothing)}")

    def _on_results(self, _results: object) -> None:
        if not (self._pause.isActive() and self._session.is_in_gesture and self._is_late):
            self._show_numbers()

    @property
    def _is_late(self) -> bool:
        """Tell whether what is measured at rest is marked as old already."""
        return self._results is not None and self._results.judgement is None

    def _show_numbers(self) -> None:
        """Show what the newest results tell of the landmarks."""
        if self._results is not self._session.results:
            self._results = self._session.results
            self._on_project(self._session.project)
            self._pause.start()

    def _on_selection(self) -> None:
        chosen = self._selection.ids
        self._show_selected_rows()
        self.weight_slider.setEnabled(bool(chosen))
        self.accept_button.setEnabled(bool(self.suggested))
        names = self._names(chosen)
        self._weight_label.set_text(
            f"Weight of {names}" if chosen else "Weight: no landmark is selected"
        )
        weights = [pair.weight for pair in self.chosen]
        if not weights:
            self._weight_value.clear()
            self.weight_slider.show_value(1.0)  # what was selected last says nothing any more
            self.weight_slider.setToolTip("Select landmarks, in the table or in a view")
            return
        weight = weights[-1]
        self.weight_slider.show_value(weight)
        inverse = f"W⁻¹ entry {1 / weight:.4g}" if weight else "left out of the spline"
        self.weight_slider.setToolTip(f"{names}: {inverse}")
        mixed = "" if len(set(weights)) == 1 else " (others differ)"
        self._weight_value.setText(format_weight(weight) + mixed)

    def _show_selected_rows(self) -> None:
        chosen = set(self._selection.ids)
        model, shown = self._sorted, self.table.selectionModel()
        selected = {str(index.data(ID_ROLE)) for index in shown.selectedRows()}
        if selected == chosen:
            return
        self._is_showing = True
        rows = QItemSelection()
        for row in range(model.rowCount()):
            index = model.index(row, 0)
            if index.data(ID_ROLE) in chosen:
                rows.select(index, index)
                if index.data(ID_ROLE) == self._selection.current:
                    self.table.scrollTo(index)
        shown.select(rows, SELECT_ROWS)
        self._is_showing = False

    def _names(self, ids: Iterable[str]) -> str:
        pairs = (self.model.pair_of(identifier) for identifier in ids)
        names = [pair.short_name for pair in pairs if pair is not None]
        return ", ".join(names) if len(names) <= MANY else f"{len(names)} landmarks"


def format_smoothing(smoothing: float) -> str:
    """Return lambda as the user reads it."""
    return f"{smoothing:.3g}"
