"""Colours: light and dark follow the system; markers stay apart for the colour-blind."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QGuiApplication, QPalette
from PySide6.QtWidgets import QApplication

from flyreg_core import color_maps

Color = tuple[int, int, int]
Scheme = Literal["system", "light", "dark"]

SOURCE: Color = color_maps.SOURCE
TARGET: Color = color_maps.TARGET

KIND_COLORS: dict[str, Color] = {  # Okabe and Ito's palette
    "upper": (0, 114, 178),
    "lower": (213, 94, 0),
    "left": (0, 158, 115),
    "right": (204, 121, 167),
    "hole": (120, 80, 20),
    "interior": (240, 228, 66),
}
OFF: Color = (140, 140, 140)
"""Landmarks of weight 0, whatever their kind."""

OESOPHAGUS: Color = (0, 190, 130)
TUNNEL: Color = (240, 160, 0)
"""Tunnels that could be the oesophagus; the others are grey like what is off."""

TRIM: Color = (213, 94, 0)
CUT: Color = (0, 158, 115)
"""The trim planes, and the sheet that divides the halves."""

NEUROPILS: tuple[Color, ...] = (  # Okabe and Ito's palette without its black
    (213, 94, 0),
    (0, 158, 115),
    (204, 121, 167),
    (240, 228, 66),
    (0, 114, 178),
    (230, 159, 0),
    (86, 180, 233),
)


@dataclass(frozen=True)
class Theme:
    """What differs between light and dark."""

    is_dark: bool
    background: Color  # of the views
    text: Color
    faint: Color  # outlines, captions
    selected: Color
    good: Color
    busy: Color
    bad: Color


LIGHT = Theme(
    is_dark=False,
    background=(250, 250, 250),
    text=(30, 30, 30),
    faint=(120, 120, 125),
    selected=(200, 0, 90),
    good=(0, 120, 85),
    busy=(0, 95, 160),
    bad=(180, 50, 20),
)
DARK = Theme(
    is_dark=True,
    background=(32, 33, 36),
    text=(235, 235, 235),
    faint=(150, 150, 155),
    selected=(255, 90, 170),
    good=(70, 200, 150),
    busy=(110, 185, 240),
    bad=(255, 140, 100),
)


def current_theme() -> Theme:
    """Return the theme that goes with the palette, which follows the system's colour scheme."""
    palette = QGuiApplication.palette()
    ground, ink = (
        palette.color(palette.ColorRole.Window),
        palette.color(palette.ColorRole.WindowText),
    )
    return DARK if ground.lightness() < ink.lightness() else LIGHT


def set_scheme(scheme: Scheme) -> None:
    """Have the whole program light or dark, or as the system is.

    Where the platform cannot be asked for a scheme (Linux without a desktop's own Qt plugin), the
    palette is changed instead.
    """
    hints = QGuiApplication.styleHints()
    if scheme == "system":
        hints.unsetColorScheme()
        QApplication.setPalette(QPalette())
        return
    wanted = Qt.ColorScheme.Dark if scheme == "dark" else Qt.ColorScheme.Light
    hints.setColorScheme(wanted)
    if hints.colorScheme() != wanted or current_theme().is_dark != (scheme == "dark"):
        QApplication.setPalette(_palette(*(DARK_PALETTE if scheme == "dark" else LIGHT_PALETTE)))


LIGHT_PALETTE = ("#efefef", "#ffffff", "#1e1e1e", "#787878", "#2f6fb2", "#0b57a4")
DARK_PALETTE = ("#2b2c2f", "#3a3b40", "#ebebeb", "#8a8a8e", "#3d7fc4", "#8ab8ea")
"""Window, base of tables and fields, text, text of what is off, selection, links."""


def _palette(ground: str, base: str, text: str, faint: str, selection: str, link: str) -> QPalette:
    palette = QPalette(QColor(ground), QColor(ground))  # Qt finds the shades of buttons
    role, group = QPalette.ColorRole, QPalette.ColorGroup
    for place, color in (
        *((part, text) for part in (role.WindowText, role.Text, role.ButtonText)),
        *((part, base) for part in (role.Base, role.ToolTipBase)),
        *((part, text) for part in (role.ToolTipText, role.BrightText)),
        (role.AlternateBase, ground),
        (role.PlaceholderText, faint),
        (role.Highlight, selection),
        (role.HighlightedText, "#ffffff"),
        (role.Accent, selection),
        (role.Link, link),
        (role.LinkVisited, link),
    ):
        palette.setColor(place, QColor(color))
    for part in (role.WindowText, role.Text, role.ButtonText, role.Highlight, role.Accent):
        palette.setColor(group.Disabled, part, QColor(faint))
    return palette


def css(color: Color) -> str:
    """Return a colour as Qt's style sheets and rich text write it."""
    return "#{:02x}{:02x}{:02x}".format(*color)


def unit(color: Color) -> tuple[float, float, float]:
    """Return a colour as VTK writes it: three numbers from 0 to 1."""
    return color[0] / 255, color[1] / 255, color[2] / 255
