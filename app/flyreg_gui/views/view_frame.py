"""A canvas with its title; a double click on the title gives it the whole area."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from PySide6.QtCore import QRect, Qt, Signal
from PySide6.QtGui import QActionGroup, QMouseEvent
from PySide6.QtWidgets import (
    QFrame,
    QHBoxLayout,
    QLabel,
    QMenu,
    QToolButton,
    QVBoxLayout,
)

from flyreg_gui.elided_label import ElidedLabel
from flyreg_gui.judging import Judged
from flyreg_gui.theme import Color, Theme, css
from flyreg_gui.views.canvas import Canvas
from flyreg_gui.views.color_scale import ColorScale, Scale
from flyreg_gui.views.graphics import is_put_together_alone

NAMES_WIDTH, NAMES_HEIGHT = 0.4, 0.25
"""Shares of a view that names may cover."""
NAMES_SIZE = 0.85
"""Of the usual size of letters."""


class TitleBar(QFrame):
    """The strip above a canvas: a colour key, the title, what is on show, the maximise button."""

    double_clicked = Signal()
    chosen = Signal(int)  # which of the things that were offered

    def __init__(self, title: str, color: Color | None) -> None:
        super().__init__()
        self._title, self._detail = QLabel(f"<b>{title}</b>"), ElidedLabel()
        self.button = QToolButton()
        self.button.setText("⤢")
        self.button.setAutoRaise(True)
        self.button.setToolTip("Maximise or restore this view (or double-click the title)")
        self.button.setAccessibleName(f"Maximise {title}")
        layout = QHBoxLayout(self)
        layout.setContentsMargins(6, 2, 2, 2)
        layout.setSpacing(4)
        if color is not None:
            key = QFrame()
            key.setFixedSize(11, 11)
            key.setStyleSheet(f"background: {css(color)}; border-radius: 2px;")
            layout.addWidget(key)
        layout.addWidget(self._title)
        layout.addWidget(self._detail, 1)
        self.choice = QToolButton()
        self.choice.setText("▾")
        self.choice.setAutoRaise(True)
        self.choice.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self.choice.setAccessibleName(f"What to show of the {title.lower()}")
        self.choice.hide()
        layout.addWidget(self.choice)
        layout.addWidget(self.button)
        for button in (self.choice, self.button):  # the name of the brain needs the room
            button.setFixedWidth(button.fontMetrics().height() + 2)
        self.button.clicked.connect(self.double_clicked)

    def show_theme(self, theme: Theme) -> None:
        """Take the colours of a theme."""
        self._detail.setStyleSheet(f"color: {css(theme.faint)};")
        self.choice.setStyleSheet(  # a style sheet keeps the colour of the palette it first saw
            f"QToolButton {{ color: {css(theme.text)}; }}"
            "QToolButton::menu-indicator { image: none; }"
        )

    def offer(self, texts: Sequence[str], tip: str) -> None:
        """Let the user choose what is shown; the first is shown at first."""
        menu, group = QMenu(self.choice), QActionGroup(self)
        for number, text in enumerate(texts):
            action = menu.addAction(text)
            action.setCheckable(True)
            action.setChecked(number == 0)
            group.addAction(action)
            action.triggered.connect(lambda _on, number=number: self.chosen.emit(number))
        self.choice.setMenu(menu)
        self.choice.setToolTip(tip)
        self.choice.show()

    def set_detail(self, text: str, tip: str = "") -> None:
        """Say what is on show, beside the title; cut off where there is no room."""
        self._detail.set_text(text)
        self._detail.setToolTip(tip or text)

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Ask for the whole area."""
        self.double_clicked.emit()
        event.accept()


class NameList(QLabel):
    """Names and their colours, in the upper right corner; what has no room is counted."""

    def __init__(self, parent: QFrame) -> None:
        super().__init__(parent)
        self.key: tuple[tuple[Color, str], ...] = ()
        self.setTextFormat(Qt.TextFormat.RichText)
        font = self.font()
        font.setPointSizeF(NAMES_SIZE * font.pointSizeF())
        self.setFont(font)
        self.hide()

    def show_key(self, key: Sequence[tuple[Color, str]]) -> None:
        """Show these names, or nothing."""
        self.key = tuple(key)
        self.setToolTip("\n".join(name for _, name in self.key))
        self.setVisible(bool(self.key))

    def fit_into(self, room: QRect) -> None:
        """Show as many names as fit, none longer than fits."""
        if not self.key:
            return
        metrics = self.fontMetrics()
        most = max(1, int(NAMES_HEIGHT * room.height() / metrics.lineSpacing()))
        shown = self.key if len(self.key) <= most else self.key[: max(most - 1, 1)]
        width = int(NAMES_WIDTH * room.width())
        rows = [
            f"<span style='color: {css(color)};'>■</span> "
            + escape(metrics.elidedText(name, Qt.TextElideMode.ElideMiddle, width))
            for color, name in shown
        ]
        more = len(self.key) - len(shown)
        self.setText("<br>".join([*rows, *([f"… {more} more"] if more else [])]))
        self.adjustSize()
        self.move(room.right() - self.width() - 6, room.y() + 6)
        self.raise_()


class ViewFrame(QFrame):
    """A titled canvas. Before there is something to draw, a note says what will be there."""

    maximise_asked = Signal()

    def __init__(
        self, title: str, note: str, color: Color | None, canvas_type: type[Canvas]
    ) -> None:
        super().__init__()
        self.setFrameShape(QFrame.Shape.StyledPanel)
        self.title = TitleBar(title, color)
        self.canvas = canvas_type(self)
        self.canvas.setAccessibleName(title)
        self._note = QLabel(note, self)
        self._note.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self._note.setWordWrap(True)
        self._note.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self._caption = QLabel(self)
        self._caption.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self._caption.setWordWrap(True)
        self._caption.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self._caption.hide()
        self.legend = QLabel(self)
        self.legend.setTextFormat(Qt.TextFormat.RichText)
        self.legend.hide()
        self._key: tuple[tuple[Color, str, str], ...] = ()  # what the legend says
        self.names = NameList(self)
        self.scale, self.marker_scale = ColorScale(self), ColorScale(self)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addWidget(self.title)
        layout.addWidget(self.canvas, 1)
        self.title.double_clicked.connect(self.maximise_asked)
        self.canvas.resized.connect(self._place_note)
        if is_put_together_alone():
            self.setAttribute(Qt.WidgetAttribute.WA_DontCreateNativeAncestors)
            self.setAttribute(Qt.WidgetAttribute.WA_NativeWindow)

    def show_theme(self, theme: Theme) -> None:
        """Take the colours of a theme; the canvas takes its own."""
        self.title.show_theme(theme)
        self.scale.show_theme(theme)
        self.marker_scale.show_theme(theme)
        self._note.setStyleSheet(f"color: {css(theme.faint)};")
        self._caption.setStyleSheet(
            f"background: {css(theme.background)}; color: {css(theme.text)}; padding: 3px;"
        )
        for legend in (self.legend, self.names):
            legend.setStyleSheet(
                f"background: {css(theme.background)}; color: {css(theme.text)};"
                f"border: 1px solid {css(theme.faint)}; padding: 2px 4px;"
            )

    def show_legend(self, key: Sequence[tuple[Color, str, str]]) -> None:
        """Say what colours mean, each with a tip; nothing takes the legend away."""
        if tuple(key) == self._key:
            return
        self._key = tuple(key)
        rows = [f"<span style='color: {css(color)};'>■</span> {text}" for color, text, _ in key]
        self.legend.setText("<br>".join(rows))
        self.legend.setToolTip("\n".join(f"{text}: {meaning}" for _, text, meaning in key))
        self.legend.setVisible(bool(key))
        self._place_note()

    def show_names(self, key: Sequence[tuple[Color, str]]) -> None:
        """Name what is drawn in colours of its own, as far as there is room; nothing takes it away."""
        if tuple(key) != self.names.key:
            self.names.show_key(key)
            self._place_note()

    def show_scale(self, judged: Judged | None) -> None:
        """Say by a bar what colours mean, or take it away."""
        if judged is not self.scale.judged:
            self.scale.show_judged(judged)
            self._place_note()

    def show_marker_scale(self, scale: Scale | None) -> None:
        """Say by a bar what the colours of landmarks mean, or take it away."""
        if scale is not self.marker_scale.judged:
            self.marker_scale.show_judged(scale)
            self._place_note()

    def set_empty(self, empty: bool) -> None:
        """Show or hide the note."""
        self._note.setVisible(empty)

    def set_caption(self, text: str) -> None:
        """Say something at the foot of what is drawn, or nothing."""
        if text != self._caption.text():
            self._caption.setText(text)
            self._caption.setVisible(bool(text))
            self._place_note()

    def _place_note(self) -> None:
        self._note.setGeometry(self.canvas.geometry().adjusted(12, 12, -12, -12))
        self._note.raise_()
        self._place_caption()
        self.names.fit_into(self.canvas.geometry())
        for scale in (self.scale, self.marker_scale):
            scale.fit_into(self.canvas.width() - 12)
        self.legend.adjustSize()
        corner = self.canvas.geometry().bottomLeft()
        self.legend.move(corner.x() + 6, corner.y() - self.legend.height() - 6)
        self.legend.raise_()
        self.scale.move(corner.x() + 6, corner.y() - self.scale.height() - 6)
        self.scale.raise_()
        below = [each for each in (self.legend, self.scale) if not each.isHidden()]
        floor = min([corner.y(), *(each.y() for each in below)])
        self.marker_scale.move(corner.x() + 6, floor - self.marker_scale.height() - 6)
        self.marker_scale.raise_()

    def _place_caption(self) -> None:
        room = self.canvas.geometry().adjusted(6, 6, -6, -6)
        height = self._caption.heightForWidth(room.width())
        self._caption.setGeometry(room.x(), room.bottom() - height, room.width(), height)
        self._caption.raise_()
