"""The curve behind lambda: how badly landmarks foretell each other at each smoothing."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPointF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QSizePolicy, QStyle, QWidget

from flyreg_core.cross_validation import Advice, CrossValidation
from flyreg_gui.sliders import LogScale
from flyreg_gui.theme import Theme, current_theme

HEIGHT, MARGIN = 46, 5
DOT = 3.5
LATE = "before this change"
NOT_YET = "Cross-validation is known when the sliders are at rest"


class SmoothingCurve(QWidget):
    """Draws scores over the scale of the slider below it, the best lambda and the present one."""

    def __init__(self, scale: LogScale) -> None:
        super().__init__()
        self._scale = scale
        self._curve: CrossValidation | None = None
        self._is_late = False
        self._smoothing = 0.0
        self.setAccessibleName("Cross-validation over lambda")
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setToolTip(NOT_YET)

    def sizeHint(self) -> QSize:
        """Return a low strip."""
        return QSize(200, HEIGHT)

    def show_curve(self, curve: CrossValidation | None, smoothing: float) -> None:
        """Show a curve and where lambda is on it; until one is known, the one before, greyed."""
        self._is_late = curve is None
        self._curve, self._smoothing = curve or self._curve, smoothing
        self.setToolTip(self._tip())
        self.update()

    def forget(self) -> None:
        """Show no curve, as before the first is known."""
        self._curve = None

    @property
    def advice(self) -> Advice | None:
        """What the curve on show speaks for, if one is shown."""
        return None if self._curve is None else self._curve.advise(self._smoothing)

    @property
    def is_late(self) -> bool:
        """Tell whether the curve on show is that of before the change that is being made."""
        return self._is_late and self._curve is not None

    def _tip(self) -> str:
        curve = self._curve
        if curve is None:
            return NOT_YET
        tip = (
            "How badly landmarks that are left out are foretold by the others (generalised "
            f"cross-validation): lowest at λ = {curve.best:.3g}; at the present λ "
            f"{curve.error_at(self._smoothing):.2f} times as far off\n"
            f"{curve.advise(self._smoothing).reason}"
        )
        return f"{tip}\n({LATE})" if self.is_late else tip

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the curve, a line at lambda, and a dot at another lambda that the curve speaks for."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        theme = current_theme()
        faint = QColor(*theme.faint)
        painter.setPen(QPen(faint, 1))
        floor = self.height() - MARGIN
        painter.drawLine(QPointF(0, floor), QPointF(self.width(), floor))
        if self._curve is None:
            painter.drawText(self.rect(), Qt.AlignmentFlag.AlignCenter, NOT_YET)
            return
        self._draw_curve(painter, self._curve, theme)

    def _draw_curve(self, painter: QPainter, curve: CrossValidation, theme: Theme) -> None:
        logs, scores = _logs(curve)
        low, high = float(scores.min()), float(scores.max())
        height = self.height() - 2 * MARGIN

        def point(log: float, score: float) -> QPointF:
            share = (score - low) / max(high - low, 1e-12)
            return QPointF(self._x(float(np.exp(log))), MARGIN + height * (1 - 0.9 * share - 0.1))

        now = self._x(self._smoothing)
        painter.setPen(QPen(QColor(*theme.busy), 1.2, Qt.PenStyle.DashLine))
        painter.drawLine(QPointF(now, MARGIN), QPointF(now, self.height() - MARGIN))
        ink = theme.faint if self._is_late else theme.text
        painter.setPen(QPen(QColor(*ink), 1.5))
        points = [point(log, score) for log, score in zip(logs, scores, strict=True)]
        painter.drawPolyline(QPolygonF(points))
        if curve.advise(self._smoothing).smoothing is not None:
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(*(theme.faint if self._is_late else theme.good)))
            painter.drawEllipse(points[int(np.argmin(scores))], DOT, DOT)
        if self._is_late:
            font = self.font()
            font.setItalic(True)
            painter.setFont(font)
            painter.setPen(QColor(*theme.faint))
            painter.drawText(
                self.rect(), Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignTop, LATE
            )

    def _x(self, smoothing: float) -> float:
        """Return where the handle of the slider stands at a smoothing."""
        handle = self.style().pixelMetric(QStyle.PixelMetric.PM_SliderLength)
        return handle / 2 + self._scale.share(smoothing) * (self.width() - handle)


def _logs(curve: CrossValidation) -> tuple[np.ndarray, np.ndarray]:
    return np.log(curve.smoothings), np.log(np.maximum(curve.scores, np.finfo(float).tiny))
