"""Menus of the views: sides to look from, ready-made arrangements, and which views are shown."""

from __future__ import annotations

from functools import partial

from PySide6.QtGui import QAction, QActionGroup
from PySide6.QtWidgets import QMenu

from flyreg_gui.actions import fill_menu
from flyreg_gui.marker_colors import CHOICES, MarkerColoring
from flyreg_gui.views.arrangement import LAYOUTS, Arrangement

VIEWS = (
    "&Source",
    "&Target",
    "&Registered on target",
    "&Anterior half, flat",
    "&Posterior half, flat",
)


def add_view_menus(menu: QMenu, actions: dict[str, QAction], arrangement: Arrangement) -> None:
    """Add the submenus to the View menu, before what brings the views back to how they were."""
    sides = QMenu("L&ook from", menu)
    sides.setObjectName("Look from")
    fill_menu(sides, actions)
    arrange = QMenu("A&rrange the views", menu)
    arrange.setObjectName("Arrange the views")
    for submenu in (sides, arrange):
        menu.insertMenu(actions["home"], submenu)
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


def add_marker_menu(menu: QMenu, before: QAction, coloring: MarkerColoring) -> None:
    """Add the choice of what landmarks are coloured by."""
    colors = QMenu("Colour landmarks b&y", menu)
    colors.setObjectName("Colour landmarks by")
    group = QActionGroup(colors)
    by_name = {}
    for name, title, meaning in CHOICES:
        action = colors.addAction(title)
        action.setCheckable(True)
        action.setChecked(name == coloring.chosen)
        action.setStatusTip(meaning)
        action.triggered.connect(lambda _on, name=name: coloring.choose(name))
        by_name[name] = group.addAction(action)
    coloring.chosen_changed.connect(lambda name: by_name[name].setChecked(True))
    menu.insertMenu(before, colors)
