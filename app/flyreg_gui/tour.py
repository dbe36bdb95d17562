"""Bubbles that point at the window's parts, in the order in which one works."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from PySide6.QtCore import QEvent, QObject, QPoint, QRect, Qt
from PySide6.QtWidgets import (
    QFrame,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QTabBar,
    QVBoxLayout,
    QWidget,
)

from flyreg_gui.theme import Theme, css, current_theme

if TYPE_CHECKING:
    from flyreg_gui.main_window import MainWindow

WIDTH, GAP = 330, 12


@dataclass(frozen=True)
class Stop:
    """One step of the tour."""

    title: str
    text: str
    target: Callable[[], QWidget]


def stops_of(w: MainWindow) -> tuple[Stop, ...]:
    """Return the stops, in the order in which one works."""
    return (
        Stop(
            "Open two brains",
            "The source is moved onto the target, which stays. Open templates shows the standard "
            "brains of the field; files of your own can also be dragged onto the window. The tour "
            "goes on once two brains are open.",
            lambda: w.start.choices if w.start.isVisible() else w.steps.open_button,
        ),
        Stop(
            "Five linked views",
            "Source, target, the result, and both halves laid flat, as soon as the brains are "
            "prepared: the bar at the lower left tells how far that is. A drag turns all brains "
            "together; what you select in one view is selected in all.",
            lambda: w.view_area,
        ),
        Stop(
            "Landmarks",
            "The program has placed some already: the dots on the brains, the rows of the table. To "
            "add one, press Space and click the same place on the source and on the target. Press "
            "Space again to only look.",
            lambda: w.tool_button("landmark_mode"),
        ),
        Stop(
            "Weights and λ",
            "Click a dot on what matters to you, such as an antennal lobe, then Weights × 2: all "
            "landmarks near it pull harder, and the brains follow. Load… takes surfaces of neuropils "
            "to choose landmarks by. λ, below, lets the map miss landmarks in order to bend less.",
            lambda: w.landmarks.neighbourhood,
        ),
        Stop(
            "See what it did",
            "The Judge tab colours the brains by how far each place was moved, or how far apart the "
            "two surfaces lie. Ctrl+Z takes anything back; the Edit menu keeps weights as A and B, "
            "and the View menu shows these in turn.",
            lambda: _tab_bar(w, "Judge"),
        ),
        Stop(
            "Take it away",
            "Export the registered mesh, save the project, or copy the same registration as a command "
            "or as Python from the Edit menu.",
            lambda: w.steps.export_button,
        ),
    )


def _tab_bar(window: MainWindow, title: str) -> QWidget:
    """Return the bar with the tab of a dock; the window while there is none."""
    for bar in window.findChildren(QTabBar):
        if bar.isVisible() and title in [bar.tabText(tab) for tab in range(bar.count())]:
            return bar
    return window


class Tour(QObject):
    """Shows one stop after the other, beside the work: nothing has to wait for it."""

    def __init__(self, window: MainWindow) -> None:
        super().__init__(window)
        self._window, self._stops = window, stops_of(window)
        self.number: int | None = None  # of the stop on show
        self.ring = QFrame(window)
        self.ring.setObjectName("ring")
        self.ring.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self.bubble = QFrame(window)
        self.bubble.setObjectName("bubble")
        self._title, self._text = QLabel(), QLabel()
        self._text.setWordWrap(True)
        self.back_button, self.next_button = QPushButton("Back"), QPushButton("Next")
        self.end_button = QPushButton("End the tour")
        self.back_button.clicked.connect(lambda: self._go(-1))
        self.next_button.clicked.connect(self._on_next)
        self.end_button.clicked.connect(self.end)
        buttons = QHBoxLayout()
        buttons.addWidget(self.end_button)
        buttons.addStretch(1)
        buttons.addWidget(self.back_button)
        buttons.addWidget(self.next_button)
        layout = self._layout = QVBoxLayout(self.bubble)
        layout.addWidget(self._title)
        layout.addWidget(self._text)
        layout.addLayout(buttons)
        self.ring.hide()
        self.bubble.hide()
        window.installEventFilter(self)
        window.session.project_changed.connect(self._on_project)

    def start(self) -> None:
        """Begin at the first stop."""
        self._window.preferences.has_toured = True
        self.number = 0
        if (center := self._window.centralWidget()) is not None:
            center.installEventFilter(self)
        self._show()

    def end(self) -> None:
        """Take the bubble away."""
        self.number = None
        if (center := self._window.centralWidget()) is not None:
            center.removeEventFilter(self)
        self.ring.hide()
        self.bubble.hide()

    def show_theme(self, theme: Theme) -> None:
        """Take the colours of a theme."""
        ground = "#1d3346" if theme.is_dark else "#f2f8fd"
        edge = css(theme.busy)
        self.bubble.setStyleSheet(
            f"#bubble {{ background: {ground}; border: 2px solid {edge}; border-radius: 8px; }}"
            f"#bubble QLabel {{ color: {css(theme.text)}; }}"
        )
        self.ring.setStyleSheet(f"#ring {{ border: 3px solid {edge}; border-radius: 6px; }}")

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Stay at what is pointed at, and before the views: a click on a dock's tab raises them."""
        if watched is not self._window:
            if event.type() == QEvent.Type.ZOrderChange:
                self._raise()
        elif event.type() in (QEvent.Type.Resize, QEvent.Type.LayoutRequest):
            self._place()
        return False

    @property
    def _is_waiting(self) -> bool:
        """Tell whether two brains must be opened for the tour to have anything to show."""
        return self.number == 0 and self._window.session.project is None

    def _on_next(self) -> None:
        if self._is_waiting:
            self._window.files.open_demo()
        else:
            self._go(1)

    def _on_project(self, _project: object) -> None:
        if self.number == 0:
            self._go(1)

    def _go(self, step: int) -> None:
        number = (self.number or 0) + step
        if number >= len(self._stops):
            self.end()
        else:
            self.number = max(number, 0)
            self._show()

    def _show(self) -> None:
        if self.number is None:
            return
        stop = self._stops[self.number]
        self.show_theme(current_theme())
        self._title.setText(f"<b>{stop.title}</b> &nbsp; {self.number + 1} of {len(self._stops)}")
        self._text.setText(stop.text)
        self.back_button.setEnabled(self.number > 0)
        is_last = self.number == len(self._stops) - 1
        next_text = "Take the demo" if self._is_waiting else "Done" if is_last else "Next"
        self.next_button.setText(next_text)
        self.ring.show()
        self.bubble.show()
        self._raise()
        self._place()
        self.next_button.setFocus()

    def _raise(self) -> None:
        self.ring.raise_()
        self.bubble.raise_()

    def _place(self) -> None:
        if self.number is None:
            return
        around = self._target()
        self.ring.setGeometry(around.adjusted(-4, -4, 4, 4) & self._window.rect())
        self.bubble.setFixedWidth(WIDTH)
        self.bubble.setFixedHeight(self._layout.totalHeightForWidth(WIDTH))
        self.bubble.move(self._beside(around))

    def _target(self) -> QRect:
        """Return where the thing that is pointed at lies in the window."""
        target = self._stops[self.number or 0].target()
        center = self._window.centralWidget()
        if not target.isVisible() and center is not None:
            target = center
        return QRect(target.mapTo(self._window, QPoint(0, 0)), target.size())

    def _beside(self, around: QRect) -> QPoint:
        """Return a place for the bubble below, left of or above what it is about, or within it.

        In the right dock, what is below belongs to it and is to be seen beside the bubble.
        """
        room, size = self._window.rect(), self.bubble.size()
        is_right = around.left() > room.center().x()
        x = min(max(around.center().x() - WIDTH // 2, GAP), room.width() - WIDTH - GAP)
        if not is_right and around.bottom() + GAP + size.height() < room.height():
            return QPoint(x, around.bottom() + GAP)
        if around.left() - GAP - WIDTH > 0:
            y = around.center().y() - size.height() // 2
            return QPoint(around.left() - GAP - WIDTH, min(y, room.height() - size.height() - GAP))
        if around.top() - GAP - size.height() > 0:
            return QPoint(x, around.top() - GAP - size.height())
        return QPoint(x, around.center().y() - size.height() // 2)
