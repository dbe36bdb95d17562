"""Curves as a picture of lines and words (SVG), for pages, files and the window alike."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

WIDTH, HEIGHT = 560, 260
"""Of one panel, pixels."""
LEFT, RIGHT, TOP, BOTTOM = 74, 16, 30, 50
"""Room around the curves for words, pixels."""
LINE_COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
"""Okabe and Ito's palette, told apart by the colour-blind."""
FEW_TICKS, FEW_DECADES = 6, 3
KEY_WIDTH, KEY_ROW = 150, 15
"""Of the names of the curves, pixels."""
ROOM = 0.06
"""Share of an axis that is left free beyond the values."""


@dataclass(frozen=True)
class Line:
    """One curve; points without a finite value are left out."""

    name: str
    x: tuple[float, ...]
    y: tuple[float, ...]


@dataclass(frozen=True)
class Axis:
    """What runs along one side of a panel."""

    label: str
    is_logarithmic: bool = False
    includes: tuple[float, ...] = ()  # values that are shown in any case


@dataclass(frozen=True)
class Mark:
    """A value on the x axis worth a line across, with what it is."""

    x: float
    text: str


@dataclass(frozen=True)
class Band:
    """A range of the x axis worth a tint, with what it is; an open end is infinite."""

    low: float
    high: float
    text: str


@dataclass(frozen=True)
class Panel:
    """Curves over one pair of axes."""

    title: str
    lines: tuple[Line, ...]
    x: Axis
    y: Axis
    marks: tuple[Mark, ...] = ()
    band: Band | None = None


def draw_panels(
    panels: Sequence[Panel], columns: int = 1, ink: str = "#222222", paper: str | None = None
) -> str:
    """Return an SVG document with panels row by row.

    Parameters
    ----------
    columns : int
        Panels beside one another.
    ink : str
        Colour of axes and words; "currentColor" follows the page that the picture stands in.
    paper : str, optional
        Colour behind everything; None leaves it transparent.
    """
    width, height = WIDTH * columns, HEIGHT * -(-len(panels) // columns)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" '
        f'height="{height}" font-family="sans-serif" font-size="12">'
    ]
    if paper is not None:
        parts.append(f'<rect width="{width}" height="{height}" fill="{paper}"/>')
    for number, panel in enumerate(panels):
        row, column = divmod(number, columns)
        parts.append(f'<g transform="translate({WIDTH * column} {HEIGHT * row})">')
        parts += _Drawing(panel, ink).parts()
        parts.append("</g>")
    return "\n".join([*parts, "</svg>", ""])


@dataclass(frozen=True)
class _Scale:
    """Where values of an axis lie in a panel."""

    low: float
    high: float
    start: float  # pixels
    end: float
    is_logarithmic: bool

    def __call__(self, value: float) -> float:
        low, high, value = (
            (math.log10(self.low), math.log10(self.high), math.log10(max(value, 1e-300)))
            if self.is_logarithmic
            else (self.low, self.high, value)
        )
        share = min(max((value - low) / (high - low), -0.01), 1.01)
        return round(self.start + share * (self.end - self.start), 2)

    @property
    def ticks(self) -> list[float]:
        """Round values between the ends."""
        if self.is_logarithmic:
            low, last = math.log10(self.low), math.floor(math.log10(self.high))
            is_short = last - low <= FEW_DECADES
            first = math.floor(low) if is_short else math.ceil(low)
            powers = range(first, last + 1, max(1, math.ceil((last - first + 1) / FEW_TICKS)))
            parts = (1, 2, 5) if is_short else (1,)
            ticks = [part * 10.0**power for power in powers for part in parts]
            within = [tick for tick in ticks if self.low <= tick <= self.high]
            if len(within) > 1:
                return within
        span = self.high - self.low
        size = 10.0 ** math.floor(math.log10(span / 2))
        between = next(size * n for n in (1, 2, 5, 10) if span / (size * n) <= FEW_TICKS)
        first = math.ceil(self.low / between - 1e-9)
        last = math.floor(self.high / between + 1e-9)
        return [n * between for n in range(first, last + 1)]


def _scale(values: list[float], axis: Axis, start: float, end: float) -> _Scale:
    finite = [v for v in (*values, *axis.includes) if math.isfinite(v)]
    if axis.is_logarithmic:
        finite = [v for v in finite if v > 0]
    low, high = (min(finite), max(finite)) if finite else (0.1, 1.0)
    if axis.is_logarithmic:
        factor = max(high / low, 1.1) ** ROOM
        return _Scale(low / factor, high * factor, start, end, True)
    room = ROOM * (high - low) or max(abs(high), 1.0) * ROOM
    low = low if low == 0 else low - room
    return _Scale(low, high + room, start, end, False)


class _Drawing:
    """One panel as elements of SVG."""

    def __init__(self, panel: Panel, ink: str) -> None:
        self._panel, self._ink = panel, ink
        xs = [value for line in panel.lines for value in line.x] + [mark.x for mark in panel.marks]
        ys = [value for line in panel.lines for value in line.y]
        self._x = _scale(xs, panel.x, LEFT, WIDTH - RIGHT)
        self._y = _scale(ys, panel.y, HEIGHT - BOTTOM, TOP)

    def parts(self) -> list[str]:
        """Return the elements, what lies below first."""
        return [
            *self._band(),
            *self._axes(),
            *self._marks(),
            *self._lines(),
            *self._words(),
            *self._key(),
        ]

    def _band(self) -> list[str]:
        band = self._panel.band
        if band is None:
            return []
        left, right = self._x(band.low), self._x(band.high)
        width = max(right - left, 0.0)
        return [
            f'<rect x="{left}" y="{TOP}" width="{width:.2f}" height="{HEIGHT - TOP - BOTTOM}" '
            'fill="#009e73" fill-opacity="0.14"/>',
            self._text(right - 8, (TOP + HEIGHT - BOTTOM) / 2, band.text, "end"),
        ]

    def _axes(self) -> list[str]:
        parts = []
        for value in self._y.ticks:
            y = self._y(value)
            parts.append(self._rule(LEFT, y, WIDTH - RIGHT, y, 0.18))
            parts.append(self._text(LEFT - 6, y + 4, _number(value), "end"))
        for value in self._x.ticks:
            x = self._x(value)
            parts.append(self._rule(x, HEIGHT - BOTTOM, x, HEIGHT - BOTTOM + 4, 0.8))
            parts.append(self._text(x, HEIGHT - BOTTOM + 17, _number(value), "middle"))
        parts.append(self._rule(LEFT, HEIGHT - BOTTOM, WIDTH - RIGHT, HEIGHT - BOTTOM, 0.8))
        parts.append(self._rule(LEFT, TOP, LEFT, HEIGHT - BOTTOM, 0.8))
        return parts

    def _marks(self) -> list[str]:
        parts = []
        for number, mark in enumerate(self._panel.marks):
            x, y = self._x(mark.x), TOP + 12 + 14 * number
            at_left = x > WIDTH * 0.6
            parts.append(self._rule(x, TOP, x, HEIGHT - BOTTOM, 0.7, dashes="4 3"))
            parts.append(
                self._text(x - 4 if at_left else x + 4, y, mark.text, "end" if at_left else "start")
            )
        return parts

    def _lines(self) -> list[str]:
        parts = []
        for number, line in enumerate(self._panel.lines):
            color = LINE_COLORS[number % len(LINE_COLORS)]
            places = [
                (self._x(x), self._y(y))
                for x, y in zip(line.x, line.y, strict=True)
                if math.isfinite(x) and math.isfinite(y)
            ]
            points = " ".join(f"{x:g},{y:g}" for x, y in places)
            parts.append(
                f'<polyline points="{points}" fill="none" stroke="{color}" stroke-width="2">'
                f"<title>{escape(line.name)}</title></polyline>"
            )
            if len(places) <= 20:
                parts += [
                    f'<circle cx="{x:g}" cy="{y:g}" r="3" fill="{color}"/>' for x, y in places
                ]
        return parts

    def _words(self) -> list[str]:
        middle = (TOP + HEIGHT - BOTTOM) / 2
        return [
            self._text(LEFT, 18, self._panel.title, "start", "bold"),
            self._text((LEFT + WIDTH - RIGHT) / 2, HEIGHT - 12, self._panel.x.label, "middle"),
            f'<g transform="translate(16 {middle:g}) rotate(-90)">'
            f"{self._text(0, 0, self._panel.y.label, 'middle')}</g>",
        ]

    def _key(self) -> list[str]:
        """Return the names of the curves, in the upper corner that they leave free."""
        lines = self._panel.lines
        if len(lines) < 2:
            return []
        low = TOP + KEY_ROW * len(lines)
        places = [
            (self._x(x), self._y(y)) for line in lines for x, y in zip(line.x, line.y, strict=True)
        ]
        high = [x for x, y in places if y < low]
        at_right = sum(x > WIDTH - RIGHT - KEY_WIDTH for x in high)
        at_left = sum(x < LEFT + KEY_WIDTH for x in high)
        side, anchor, inwards = (
            (LEFT + 8, "start", 1) if at_left < at_right else (WIDTH - RIGHT - 6, "end", -1)
        )
        parts = []
        for number, line in enumerate(lines):
            color, y = LINE_COLORS[number % len(LINE_COLORS)], TOP + 12 + KEY_ROW * number
            parts.append(f'<circle cx="{side}" cy="{y - 4}" r="4" fill="{color}"/>')
            parts.append(self._text(side + 8 * inwards, y, line.name, anchor))
        return parts

    def _text(self, x: float, y: float, text: str, anchor: str, weight: str = "normal") -> str:
        return (
            f'<text x="{x:g}" y="{y:g}" text-anchor="{anchor}" font-weight="{weight}" '
            f'fill="{self._ink}">{escape(text)}</text>'
        )

    def _rule(
        self, x: float, y: float, x_end: float, y_end: float, opacity: float, dashes: str = ""
    ) -> str:
        pattern = f' stroke-dasharray="{dashes}"' if dashes else ""
        return (
            f'<line x1="{x:g}" y1="{y:g}" x2="{x_end:g}" y2="{y_end:g}" stroke="{self._ink}" '
            f'stroke-opacity="{opacity:g}"{pattern}/>'
        )


def _number(value: float) -> str:
    """Return a tick's value, short."""
    if value == 0:
        return "0"
    return f"{value:,.6g}" if 1e-4 <= abs(value) < 1e6 else f"{value:.0e}".replace("e-0", "e-")
