"""All actions of the window in one table, menu by menu."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QMenu

from flyreg_gui.actions.edit_actions import EDIT_ACTIONS
from flyreg_gui.actions.file_actions import FILE_ACTIONS
from flyreg_gui.actions.help_actions import HELP_ACTIONS
from flyreg_gui.actions.landmark_actions import LANDMARK_ACTIONS
from flyreg_gui.actions.view_actions import VIEW_ACTIONS
from flyreg_gui.blink import NAMES
from flyreg_gui.preparing import ROLES
from flyreg_gui.session import Session

if TYPE_CHECKING:
    from flyreg_gui.main_window import MainWindow

SPECS = (*FILE_ACTIONS, *EDIT_ACTIONS, *LANDMARK_ACTIONS, *VIEW_ACTIONS, *HELP_ACTIONS)


def make_actions(window: MainWindow) -> dict[str, QAction]:
    """Return the actions by name, each ready to be triggered."""
    actions = {}
    for spec in SPECS:
        action = QAction(spec.text, window)
        action.setObjectName(spec.name)
        action.setShortcuts([QKeySequence(key) for key in spec.keys])
        if spec.short:
            action.setIconText(spec.short)
        if spec.tip:
            action.setToolTip(spec.tip)
            action.setStatusTip(spec.tip)
        if spec.is_on is None:
            action.triggered.connect(lambda _on, do=spec.do: do(window))
        else:
            action.setCheckable(True)
            action.setChecked(spec.is_on)
            action.toggled.connect(lambda on, do=spec.do: do(window, on))
        actions[spec.name] = action
    return actions


def fill_menu(menu: QMenu, actions: dict[str, QAction], breaks: tuple[str, ...] = ()) -> None:
    """Put the actions of a menu into it, with a line before each of `breaks`."""
    for spec in SPECS:
        if spec.menu == menu.objectName():
            if spec.name in breaks:
                menu.addSeparator()
            menu.addAction(actions[spec.name])


def needs_met(session: Session) -> set[str]:
    """Return what there is now of what actions need."""
    project = session.project
    kept = project.snapshots if project is not None else {}
    has_brain = any(session.brain(role) is not None for role in ROLES)
    met = {
        "project": project is not None,
        "neuropils": project is not None and bool(project.neuropils),
        "brains": has_brain,
        "results": session.results is not None,
        "current": session.is_up_to_date,
        "measured": session.is_complete,
        "snapshots": session.results is not None and all(name in kept for name in NAMES),
    }
    return {name for name, is_met in met.items() if is_met} | {f"snapshot {name}" for name in kept}


def enable_actions(actions: dict[str, QAction], met: set[str]) -> None:
    """Grey out what cannot be done now."""
    for spec in SPECS:
        actions[spec.name].setEnabled(not spec.needs or spec.needs in met)
