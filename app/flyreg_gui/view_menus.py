"""Menus of the views: sides to look from, ready-made arrangements, and which views are shown."""

from __future__ import annotations

from functools import partial

from PySide6.QtGui import QAction
from PySide6.QtWidgets import QMenu

from flyreg_gui.actions import fill_menu
from flyreg_gui.views.arrangement import LAYOUTS, Arrangement

VIEWS = (
    "&Source",
    "&Target",
    "&Registered on target",
    "&Anterior half, flat",
    "&Posterior half, flat",
)


def add_view_menus(menu: QMenu, actions: dict[str, QAction], arrangement: Arrangement) -> None:
    """Add the submenus to the View menu."""
    sides = menu.addMenu("L&ook from")
    sides.setObjectName("Look from")
    fill_menu(sides, actions)
    arrange = menu.addMenu("A&rrange the views")
    arrange.setObjectName("Arrange the views")
    for layout in LAYOUTS:
        arrange.addAction(layout.title).triggered.connect(
            lambda _on, layout=layout: arrangement.take(layout)
        )
    arrange.addSeparator()
    checks = []
    for number, title in enumerate(VIEWS):
        check = arrange.addAction(title)
        check.setCheckable(True)
        check.triggered.connect(partial(arrangement.set_shown, number))
        checks.append(check)

    def show() -> None:
        for number, check in enumerate(checks):
            check.setChecked(arrangement.is_shown(number))

    arrangement.changed.connect(show)
    show()
