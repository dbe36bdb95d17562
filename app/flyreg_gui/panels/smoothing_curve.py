"""The curves behind lambda: how well landmarks are foretold, and what bending their residual costs."""

from __future__ import annotations

from typing import Literal

import numpy as np
from PySide6.QtCore import QPointF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QSizePolicy, QStyle, QWidget

from flyreg_core.cross_validation import Advice
from flyreg_core.judgement import Judgement
from flyreg_core.mesh import Floats
from flyreg_gui.sliders import LogScale
from flyreg_gui.theme import Theme, current_theme

Kind = Literal["foretold", "bending"]

KINDS: tuple[tuple[Kind, str], ...] = (
    ("foretold", "How well landmarks are foretold"),
    ("bending", "Residual against bending"),
)
"""What can be shown, and what it is called."""
HEIGHT, MARGIN = 46, 5
ROOM = 0.1
"""Share of the height that stays free above and below the scores."""
DOT = 3.5
LATE = "before this change"
NOT_YET = "Cross-validation is known when the sliders are at rest"


class SmoothingCurve(QWidget):
    """Draws one of two curves of lambda, with the present lambda and the one to take instead.

    Scores stand over the scale of the slider below. Bending energy stands over the residual, which
    grows with lambda to the right too.
    """

    def __init__(self, scale: LogScale) -> None:
        super().__init__()
        self._scale = scale
        self._kind: Kind = "foretold"
        self._judgement: Judgement | None = None
        self._is_late = False
        self._smoothing = 0.0
        self.setAccessibleName("Cross-validation over lambda")
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setToolTip(NOT_YET)

    def sizeHint(self) -> QSize:
        """Return a low strip."""
        return QSize(200, HEIGHT)

    def show_kind(self, kind: Kind) -> None:
        """Show the other curve."""
        self._kind = kind
        is_foretold = kind == "foretold"
        self.setAccessibleName(
            "Cross-validation over lambda" if is_foretold else "Bending energy over residual"
        )
        self.setToolTip(self._tip())
        self.update()

    def show_curve(self, judgement: Judgement | None, smoothing: float) -> None:
        """Show the curves and where lambda is on them; until they are known, those before, greyed."""
        self._is_late = judgement is None
        self._judgement, self._smoothing = judgement or self._judgement, smoothing
        self.setToolTip(self._tip())
        self.update()

    def forget(self) -> None:
        """Show no curve, as before the first is known."""
        self._judgement = None

    @property
    def advice(self) -> Advice | None:
        """What the curve on show speaks for, if one is shown."""
        known = self._judgement
        return None if known is None else known.cross_validation.advise(self._smoothing)

    @property
    def is_late(self) -> bool:
        """Tell whether the curve on show is that of before the change that is being made."""
        return self._is_late and self._judgement is not None

    def _tip(self) -> str:
        if self._judgement is None:
            return NOT_YET
        foretold = self._kind == "foretold"
        tip = (
            self._foretold_tip(self._judgement) if foretold else self._bending_tip(self._judgement)
        )
        return f"{tip}\n({LATE})" if self.is_late else tip

    def _foretold_tip(self, judgement: Judgement) -> str:
        curve = judgement.cross_validation
        return (
            "How badly landmarks that are left out are foretold by the others (generalised "
            f"cross-validation): lowest at λ = {curve.best:.3g}; at the present λ "
            f"{curve.error_at(self._smoothing):.2f} times as far off\n"
            f"{curve.advise(self._smoothing).reason}"
        )

    def _bending_tip(self, judgement: Judgement) -> str:
        curve, advised = judgement.trade_off, judgement.cross_validation.advise(self._smoothing)
        lines = [
            "From left to right λ grows: the spline misses its landmarks by more (root mean square, "
            "by weight, before the halves are sewn), and bends less from top to bottom (bending "
            "energy wᵀKw, which has no unit). Past the corner a larger λ gains little.",
            f"At the present λ = {self._smoothing:.3g}: {_in_words(*curve.at(self._smoothing))}",
        ]
        if advised.smoothing is not None:
            there = _in_words(*curve.at(advised.smoothing))
            lines.append(f"By cross-validation λ = {advised.smoothing:.3g}: {there}")
        return "\n".join(lines)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the curve, a line at lambda, and a dot at another lambda that the curve speaks for."""
        with QPainter(self) as painter:
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            theme = current_theme()
            faint = QColor(*theme.faint)
            painter.setPen(QPen(faint, 1))
            floor = self.height() - MARGIN
            painter.drawLine(QPointF(0, floor), QPointF(self.width(), floor))
            if self._judgement is None:
                painter.drawText(self.rect(), Qt.AlignmentFlag.AlignCenter, NOT_YET)
            elif self._kind == "foretold":
                self._draw_foretold(painter, self._judgement, theme)
            else:
                self._draw_bending(painter, self._judgement, theme)

    def _draw_foretold(self, painter: QPainter, judgement: Judgement, theme: Theme) -> None:
        curve = judgement.cross_validation
        scores = np.log(np.maximum(curve.scores, np.finfo(float).tiny))
        across = [self._x(float(smoothing)) for smoothing in curve.smoothings]
        heights = ROOM + (1 - ROOM) * _shares(scores, float(scores.min()))
        self._draw(painter, across, heights, self._x(self._smoothing), judgement, theme)

    def _draw_bending(self, painter: QPainter, judgement: Judgement, theme: Theme) -> None:
        curve = judgement.trade_off
        width = self.width() - 2 * MARGIN
        now, energy = curve.at(self._smoothing)
        most = max(float(curve.residuals_um[-1]), np.finfo(float).tiny)
        across = [MARGIN + width * float(residual) / most for residual in curve.residuals_um]
        heights = _shares(curve.energies, 0.0)
        self._draw(painter, across, heights, MARGIN + width * now / most, judgement, theme)
        if not self._is_late:
            self._write(painter, _in_words(now, energy), theme.text)

    def _draw(
        self,
        painter: QPainter,
        across: list[float],
        heights: Floats,
        now: float,
        judgement: Judgement,
        theme: Theme,
    ) -> None:
        """Draw a curve whose heights are shares of the strip's."""
        floor, height = self.height() - MARGIN, self.height() - 2 * MARGIN
        painter.setPen(QPen(QColor(*theme.busy), 1.2, Qt.PenStyle.DashLine))
        painter.drawLine(QPointF(now, MARGIN), QPointF(now, floor))
        painter.setPen(QPen(QColor(*(theme.faint if self._is_late else theme.text)), 1.5))
        points = [
            QPointF(x, floor - height * share)
            for x, share in zip(across, heights.tolist(), strict=True)
        ]
        painter.drawPolyline(QPolygonF(points))
        curve = judgement.cross_validation
        if curve.advise(self._smoothing).smoothing is not None:
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(*(theme.faint if self._is_late else theme.good)))
            painter.drawEllipse(points[int(np.argmin(curve.scores))], DOT, DOT)
        if self._is_late:
            font = self.font()
            font.setItalic(True)
            painter.setFont(font)
            self._write(painter, LATE, theme.faint)

    def _write(self, painter: QPainter, text: str, ink: tuple[int, int, int]) -> None:
        """Write in the upper right corner, over a piece of ground if the curve runs there."""
        corner = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignTop
        painter.fillRect(painter.boundingRect(self.rect(), corner, text), self.palette().window())
        painter.setPen(QColor(*ink))
        painter.drawText(self.rect(), corner, text)

    def _x(self, smoothing: float) -> float:
        """Return where the handle of the slider stands at a smoothing."""
        handle = self.style().pixelMetric(QStyle.PixelMetric.PM_SliderLength)
        return handle / 2 + self._scale.share(smoothing) * (self.width() - handle)


def _shares(values: Floats, low: float) -> Floats:
    """Return values as shares of the way from `low` to the highest one."""
    return np.asarray((values - low) / max(float(values.max()) - low, 1e-12))


def _in_words(residual_um: float, energy: float) -> str:
    return f"residual {residual_um:.2g} µm, bending {energy:.2g}"
