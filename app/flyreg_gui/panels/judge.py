"""What the brains are coloured by, and how its values are distributed."""

from __future__ import annotations

from PySide6.QtCore import QPoint, QRect, QSignalBlocker, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPolygon
from PySide6.QtWidgets import (
    QComboBox,
    QFormLayout,
    QFrame,
    QLabel,
    QScrollArea,
    QVBoxLayout,
    QWidget,
)

from flyreg_core.project import Role
from flyreg_core.vertex_quantities import QUANTITIES, ROBUST, STATUS_NAMES, Summary
from flyreg_gui import marker_colors
from flyreg_gui.judging import ORIGINS, PLAIN, Judged, Judging, text_of
from flyreg_gui.marker_colors import MarkerColoring
from flyreg_gui.theme import Theme
from flyreg_gui.views.origins import MEANINGS

HEIGHT = 90
CHOICES = (
    (PLAIN, "Nothing: the brains' own colours"),
    (ORIGINS, "Where the surface comes from"),
    *((quantity.name, quantity.title) for quantity in QUANTITIES),
)
NAMES: dict[Role, str] = {"source": "Registered source", "target": "Target"}


class Histogram(QWidget):
    """How much of a surface has which value, each bar in the colour of its value."""

    def __init__(self, role: Role) -> None:
        super().__init__()
        self._role = role
        self._judged: Judged | None = None
        self._theme: Theme | None = None
        self.setFixedHeight(HEIGHT + self.fontMetrics().height() + 4)

    def show_theme(self, theme: Theme) -> None:
        """Take the colours of a theme."""
        self._theme = theme
        self.update()

    def show_judged(self, judged: Judged | None) -> None:
        """Show another quantity, or nothing."""
        self._judged = judged
        self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Draw the bars, their outline, which pale ones need, their base and the range."""
        judged, theme = self._judged, self._theme
        if judged is None or theme is None or self._role not in judged.summaries:
            return
        summary = judged.summaries[self._role]
        with QPainter(self) as painter:
            count, tallest = len(summary.shares), max(float(summary.shares.max()), 1e-12)
            span = judged.high - judged.low or 1.0
            middles = (summary.edges[:-1] + summary.edges[1:]) / 2
            colors = judged.color_map((middles - judged.low) / span)
            outline = [QPoint(0, HEIGHT)]
            for bar, (share, color) in enumerate(zip(summary.shares, colors, strict=True)):
                left, right = (round(edge * self.width() / count) for edge in (bar, bar + 1))
                height = round(float(share) / tallest * HEIGHT)
                painter.fillRect(
                    left, HEIGHT - height, right - left, height, QColor(*map(int, color))
                )
                outline += [QPoint(edge, HEIGHT - height) for edge in (left, right - 1)]
            painter.setPen(QColor(*theme.faint))
            painter.drawPolyline(QPolygon(outline))
            painter.drawLine(0, HEIGHT, self.width(), HEIGHT)
            painter.setPen(QColor(*theme.text))
            line = QRect(0, HEIGHT + 2, self.width(), self.fontMetrics().height())
            unit = judged.quantity.unit
            painter.drawText(line, Qt.AlignmentFlag.AlignLeft, text_of(summary.low, unit))
            painter.drawText(line, Qt.AlignmentFlag.AlignRight, text_of(summary.high, unit))


class JudgePanel(QScrollArea):
    """The choice, a histogram of each brain that has values, and its main numbers."""

    def __init__(self, judging: Judging, coloring: MarkerColoring) -> None:
        super().__init__()
        self._judging = judging
        self.choice = QComboBox()
        self.choice.setAccessibleName("Colour by")
        self.choice.setSizeAdjustPolicy(
            QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon
        )
        for name, title in CHOICES:
            self.choice.addItem(title, name)
        self.marker_choice = QComboBox()
        self.marker_choice.setAccessibleName("Colour landmarks by")
        for name, title, meaning in marker_colors.CHOICES:
            self.marker_choice.addItem(title, name)
            tip = Qt.ItemDataRole.ToolTipRole
            self.marker_choice.setItemData(self.marker_choice.count() - 1, meaning, tip)
        self.note = QLabel()
        self.note.setWordWrap(True)
        self._titles = {role: QLabel(f"<b>{name}</b>") for role, name in NAMES.items()}
        self.histograms = {role: Histogram(role) for role in NAMES}
        self.numbers = {role: QLabel() for role in NAMES}
        content = QWidget()
        layout = QVBoxLayout(content)
        form = QFormLayout()
        form.addRow("Colour by", self.choice)
        form.addRow("Landmarks by", self.marker_choice)
        layout.addLayout(form)
        layout.addWidget(self.note)
        for role in NAMES:
            self.numbers[role].setWordWrap(True)
            for widget in (self._titles[role], self.histograms[role], self.numbers[role]):
                layout.addWidget(widget)
        layout.addStretch(1)
        self.setWidget(content)
        self.setWidgetResizable(True)
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.choice.activated.connect(self._on_activated)
        self.marker_choice.activated.connect(
            lambda row: coloring.choose(self.marker_choice.itemData(row))
        )
        coloring.chosen_changed.connect(
            lambda name: self.marker_choice.setCurrentIndex(self.marker_choice.findData(name))
        )
        judging.chosen_changed.connect(self._show)
        judging.changed.connect(self._show)
        judging.outdated.connect(self._show_note)
        self._show()

    def show_theme(self, theme: Theme) -> None:
        """Take the colours of a theme."""
        for histogram in self.histograms.values():
            histogram.show_theme(theme)

    def _on_activated(self, row: int) -> None:
        self._judging.choose(self.choice.itemData(row))

    def _show_note(self) -> None:
        self.note.setText(_note(self._judging))

    def _show(self, *_news: object) -> None:
        judging = self._judging
        with QSignalBlocker(self.choice):
            self.choice.setCurrentIndex(self.choice.findData(judging.chosen))
        judged = judging.judged
        self._show_note()
        for role in NAMES:
            has_values = judged is not None and role in judged.summaries
            for widget in (self._titles[role], self.histograms[role], self.numbers[role]):
                widget.setVisible(has_values)
            if judged is not None and judged.is_kinds:  # there is no order among them
                self.histograms[role].hide()
            self.histograms[role].show_judged(judged)
            if judged is not None and has_values:
                self.numbers[role].setText(_numbers(judged, judged.summaries[role]))


def _note(judging: Judging) -> str:
    if judging.is_by_origin:
        kinds = "\n".join(f"{name}: {meaning}" for name, meaning in MEANINGS.items())
        return f"What preparing the brains has changed; the legends tell how much.\n\n{kinds}"
    if not judging.is_quantity:
        return (
            "Choose what the brains are coloured by: how far each place was moved, how far apart the "
            "two surfaces lie, how much a place was stretched. Below is then how often each value "
            "occurs."
        )
    if judging.judged is None:
        return "Measured when the sliders are at rest…"
    quantity = judging.judged.quantity
    late = "" if judging.is_up_to_date else " (of the registration before; updating…)"
    if judging.judged.is_kinds:
        return quantity.meaning + late
    beyond = f"Colours span {ROBUST:.0f} % of the surface; the rest has the colours of the ends."
    return f"{quantity.meaning}{late}. {beyond}"


def _numbers(judged: Judged, summary: Summary) -> str:
    if judged.is_kinds:
        last = len(STATUS_NAMES) - 1
        bins = [round(kind / last * (len(summary.shares) - 1)) for kind in range(last + 1)]
        return "\n".join(
            f"{name}: {100 * float(summary.shares[place]):.1f} % of the surface"
            for name, place in zip(STATUS_NAMES, bins, strict=True)
        )
    unit = judged.quantity.unit
    names = ("mean", "RMS", "95 % below", "largest")
    values = (summary.mean, summary.rms, summary.p95, summary.largest)
    if judged.quantity.is_signed:
        names = ("mean", "RMS, either way", "95 % within, either way", "most, either way")
    return "\n".join(
        f"{name} {text_of(value, unit)}" for name, value in zip(names, values, strict=True)
    )
