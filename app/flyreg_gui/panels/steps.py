"""The left dock: the steps of the method, how brains are prepared, and how far the work is."""

from __future__ import annotations

from PySide6.QtCore import Qt, QTimer, Signal
from PySide6.QtWidgets import (
    QFrame,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QProgressBar,
    QPushButton,
    QScrollArea,
    QSizePolicy,
    QStyle,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from flyreg_gui.panels.preparation import PreparationForm
from flyreg_gui.panels.trimming import TrimmingPanel
from flyreg_gui.panels.tunnels import TunnelsPanel
from flyreg_gui.session import Session
from flyreg_gui.steps import TITLES, State, Step, StepReport, report_steps
from flyreg_gui.theme import Theme, css, current_theme
from flyreg_gui.trim_mode import TrimMode
from flyreg_gui.tunnels import Tunnels

PATIENCE_MS = 500
"""How long work runs before its progress is shown."""
NO_BREAK = "\N{NO-BREAK SPACE}"
"""Keeps a unit on the line of its number."""
SYMBOLS = {
    State.WAITING: "○",
    State.RUNNING: "◐",
    State.DONE: "✓",
    State.READY: "✓",
    State.STALE: "↻",
    State.FAILED: "✕",
}


class StepCard(QFrame):
    """One step: its name, its state, its main numbers, and perhaps what can be done there."""

    def __init__(self, step: Step) -> None:
        super().__init__()
        self._symbol, self._state, self._details = QLabel(), QLabel(), QLabel()
        title = QLabel(f"<b>{step + 1}  {TITLES[step]}</b>")
        self._symbol.setFixedWidth(18)
        self._symbol.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self._details.setWordWrap(True)
        self._details.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self._grid = QGridLayout(self)
        self._grid.setContentsMargins(8, 5, 8, 5)
        self._grid.setVerticalSpacing(2)
        self._grid.setColumnStretch(1, 1)
        self._grid.addWidget(self._symbol, 0, 0)
        self._grid.addWidget(title, 0, 1)
        self._grid.addWidget(self._state, 0, 2)
        self._grid.addWidget(self._details, 1, 1, 1, 2)
        self.report: StepReport | None = None
        self._shown: tuple[StepReport, str, Theme] | None = None

    def add(self, widget: QWidget) -> None:
        """Put something below the numbers."""
        self._grid.addWidget(widget, self._grid.rowCount(), 0, 1, 3)

    def add_row(self, *buttons: QPushButton | QToolButton) -> None:
        """Put buttons below the numbers."""
        row = QHBoxLayout()
        for button in buttons:
            row.addWidget(button)
        row.addStretch(1)
        self._grid.addLayout(row, self._grid.rowCount(), 1, 1, 2)

    def show_report(self, report: StepReport, reason: str, theme: Theme) -> None:
        """Show the state of the step; `reason` says why it failed, if it did."""
        shown = (report, reason, theme)
        if shown == self._shown:
            return
        self._shown = shown
        colors = {
            State.RUNNING: theme.busy,
            State.DONE: theme.good,
            State.READY: theme.good,
            State.STALE: theme.busy,
            State.FAILED: theme.bad,
        }
        color = css(colors.get(report.state, theme.faint))
        self._symbol.setText(SYMBOLS[report.state])
        self._symbol.setStyleSheet(f"color: {color}; font-weight: bold;")
        self._state.setText(report.state.value)
        self._state.setStyleSheet(f"color: {color};")
        failed = report.state is State.FAILED
        details = "\n".join(report.details).replace(" µm", NO_BREAK + "µm")
        self._details.setText(reason if failed else details)
        self._details.setStyleSheet(f"color: {color};" if failed else "")
        self._details.setVisible(bool(self._details.text()))
        self.report = report


class WorkBar(QWidget):
    """What is being done, how far it is, and a way to stop it; hidden while nothing takes long."""

    cancel_asked = Signal()
    again_asked = Signal()

    def __init__(self) -> None:
        super().__init__()
        self._text = QLabel()
        self._text.setWordWrap(True)
        self.bar = QProgressBar()
        self.bar.setRange(0, 1000)
        self.bar.setTextVisible(False)
        self.bar.setAccessibleName("Progress")
        self.cancel_button = QPushButton("Cancel")
        self.again_button = QPushButton("Run again")
        layout = QGridLayout(self)
        layout.setContentsMargins(8, 4, 8, 8)
        layout.addWidget(self._text, 0, 0, 1, 3)
        layout.addWidget(self.bar, 1, 0)
        layout.addWidget(self.cancel_button, 1, 1)
        layout.addWidget(self.again_button, 1, 2)
        layout.setColumnStretch(0, 1)
        policy = self.sizePolicy()
        policy.setRetainSizeWhenHidden(False)
        self.setSizePolicy(policy)
        self.cancel_button.clicked.connect(self.cancel_asked)
        self.again_button.clicked.connect(self.again_asked)
        self._patience = QTimer(self)
        self._patience.setSingleShot(True)
        self._patience.setInterval(PATIENCE_MS)
        self._patience.timeout.connect(self._show_running)
        self.hide()

    def show_progress(self, fraction: float, text: str) -> None:
        """Say how far the work is."""
        # or it is drawn before this returns, and all views with it
        self.bar.setUpdatesEnabled(False)
        self.bar.setValue(round(1000 * fraction))
        self.bar.setUpdatesEnabled(True)
        self._text.setText(f"{text[:1].upper()}{text[1:]}…" if text else "Working…")

    def show_state(self, *, running: bool, stopped: bool) -> None:
        """Take notice of work that began, ended, or was stopped before its end."""
        if running:
            if not self._patience.isActive() and (self.bar.isHidden() or self.isHidden()):
                self._patience.start()
            return
        self._patience.stop()
        self.setVisible(stopped)
        self.bar.setVisible(False)
        self.bar.setValue(0)
        self.cancel_button.setVisible(False)
        self.again_button.setVisible(stopped)
        if stopped:
            self._text.setText("Stopped; what is on show is from before the last change.")

    def _show_running(self) -> None:
        self.again_button.hide()
        self.bar.show()
        self.cancel_button.show()
        self.show()


class StepsPanel(QWidget):
    """All steps from top to bottom, and the progress of the work below them."""

    open_asked = Signal()
    export_asked = Signal()
    save_asked = Signal()

    def __init__(self, session: Session, tunnels: Tunnels, trim: TrimMode) -> None:
        super().__init__()
        self._session, self._tunnels = session, tunnels
        self.cards = [StepCard(step) for step in Step]
        self.form = PreparationForm(session)
        self.tunnels = TunnelsPanel(session, tunnels)
        self.trimming = TrimmingPanel(session, trim)
        self.work = WorkBar()
        self.settings_button, self.tunnels_button = _folder("Settings"), _folder("Tunnels")
        self.open_button = QPushButton("Open…")
        self.export_button, self.save_button = QPushButton("Export mesh…"), QPushButton("Save…")
        self._arrange()
        self._theme = current_theme()
        self._connect()
        self._on_toggled(False)
        self._on_tunnels()
        self._show()

    def _arrange(self) -> None:
        self.cards[Step.BRAINS].add_row(self.open_button)
        self.cards[Step.PREPARE].add_row(self.settings_button, self.tunnels_button)
        self.cards[Step.PREPARE].add(self.tunnels)
        self.cards[Step.PREPARE].add(self.trimming)
        self.cards[Step.PREPARE].add(self.form)
        self.cards[Step.TAKE_AWAY].add_row(self.export_button, self.save_button)
        content = QWidget()
        column = QVBoxLayout(content)
        column.setContentsMargins(0, 4, 0, 4)
        column.setSpacing(0)
        for card in self.cards:
            column.addWidget(card)
        column.addStretch(1)
        scroll = QScrollArea()
        scroll.setWidget(content)
        scroll.setWidgetResizable(True)
        scroll.setFrameShape(QFrame.Shape.NoFrame)
        scroll.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        scroll.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Expanding)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(scroll, 1)
        layout.addWidget(self.work)
        self.setMinimumWidth(content.minimumSizeHint().width() + self._bar_width())

    def _bar_width(self) -> int:
        return self.style().pixelMetric(QStyle.PixelMetric.PM_ScrollBarExtent)

    def _connect(self) -> None:
        session = self._session
        self.settings_button.toggled.connect(self._on_toggled)
        self.tunnels_button.toggled.connect(self._tunnels.set_on)
        self._tunnels.changed.connect(self._on_tunnels)
        self.open_button.clicked.connect(self.open_asked)
        self.export_button.clicked.connect(self.export_asked)
        self.save_button.clicked.connect(self.save_asked)
        self.work.cancel_asked.connect(session.cancel)
        self.work.again_asked.connect(session.run_again)
        session.progressed.connect(self._on_progressed)
        session.state_changed.connect(self._show)
        session.project_changed.connect(self._show)
        session.results_changed.connect(self._show)

    def show_theme(self, theme: Theme) -> None:
        """Take the colours of a theme."""
        self._theme = theme
        self._show()

    def _on_toggled(self, on: bool) -> None:
        self.form.setVisible(on)
        self.settings_button.setArrowType(_arrow(on))

    def _on_tunnels(self) -> None:
        on = self._tunnels.is_on
        self.tunnels.setVisible(on)
        self.tunnels_button.setChecked(on)
        self.tunnels_button.setArrowType(_arrow(on))

    def _on_progressed(self, fraction: float, text: str) -> None:
        self.work.show_progress(fraction, text)
        self._show()

    def _show(self, *_news: object) -> None:
        session, theme = self._session, self._theme
        if session.beside:
            return  # the steps are those of the open project
        reason = session.failure.sentence if session.failure else ""
        for card, report in zip(self.cards, report_steps(session), strict=True):
            card.show_report(report, reason, theme)
        stopped = (
            session.project is not None
            and session.failure is None
            and not session.is_running
            and not session.is_up_to_date
        )
        self.work.show_state(running=session.is_running, stopped=stopped)
        self.export_button.setEnabled(session.is_up_to_date)
        self.save_button.setEnabled(session.project is not None)


def _folder(text: str) -> QToolButton:
    """Return a button that opens and closes what is below it."""
    button = QToolButton()
    button.setText(text)
    button.setCheckable(True)
    button.setAutoRaise(True)
    button.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
    return button


def _arrow(is_open: bool) -> Qt.ArrowType:
    return Qt.ArrowType.DownArrow if is_open else Qt.ArrowType.RightArrow
