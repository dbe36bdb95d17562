"""All actions of the window in one table: text, keys, menu, and what they do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QMenu

if TYPE_CHECKING:
    from flyreg_gui.main_window import MainWindow

SEPARATOR = ""


@dataclass(frozen=True)
class ActionSpec:
    """One line of the table."""

    name: str
    menu: str
    text: str
    keys: tuple[str, ...]
    do: Callable[[MainWindow], object] | Callable[[MainWindow, bool], object]
    tip: str = ""
    is_on: bool | None = None  # None: not a switch
    needs: str = ""  # "project", "brains", "results", "current", "measured": greyed out without


SPECS = (
    ActionSpec(
        "open_brains", "File", "Open &brains…", ("Ctrl+N",), lambda w: w.files.open_brains()
    ),
    ActionSpec(
        "open_project", "File", "&Open project…", ("Ctrl+O",), lambda w: w.files.open_project()
    ),
    ActionSpec("demo", "File", "Open the &demo", (), lambda w: w.files.open_demo()),
    ActionSpec(
        "save", "File", "&Save project", ("Ctrl+S",), lambda w: w.files.save(), needs="project"
    ),
    ActionSpec(
        "save_as",
        "File",
        "Save project &as…",
        ("Ctrl+Shift+S",),
        lambda w: w.files.save_as(),
        needs="project",
    ),
    ActionSpec(
        "export",
        "File",
        "&Export registered mesh…",
        ("Ctrl+E",),
        lambda w: w.files.export(),
        needs="current",
    ),
    ActionSpec(
        "report",
        "File",
        "Save &report…",
        (),
        lambda w: w.reports.save(),
        "Write a web page with pictures and all figures, and the project that repeats it",
        needs="measured",
    ),
    ActionSpec(
        "screenshot", "File", "Save a &picture…", ("Alt+S",), lambda w: w.files.save_picture()
    ),
    ActionSpec("quit", "File", "&Quit", ("Ctrl+Q",), lambda w: w.close()),
    ActionSpec(
        "select_all",
        "Edit",
        "Select &all landmarks",
        ("Ctrl+A",),
        lambda w: w.select_all(),
        needs="results",
    ),
    ActionSpec("escape", "Edit", "Select &nothing", ("Esc",), lambda w: w.escape()),
    ActionSpec(
        "delete",
        "Edit",
        "Delete land&marks",
        ("Del", "Backspace"),
        lambda w: w.delete_landmarks(),
        "Removes landmarks of your own; sets those on the boundary to weight 0",
        needs="results",
    ),
    ActionSpec(
        "landmark_mode",
        "Edit",
        "&Landmark mode",
        ("Space",),
        lambda w, on: w.mode.set_on(on),
        "Click a place on the source and the same place on the target to make a landmark (Space)",
        is_on=False,
        needs="results",
    ),
    ActionSpec(
        "drill",
        "Edit",
        "&Drill a channel",
        ("D",),
        lambda w, on: w.drill.set_on(on),
        "Click where the oesophagus opens at the front of a brain, then at its back (D)",
        is_on=False,
        needs="brains",
    ),
    ActionSpec(
        "trim",
        "Edit",
        "Adjust &trimming and cut",
        ("P",),
        lambda w, on: w.trim.set_on(on),
        "Drag the planes that cut the optic lobes off, and the cut between the halves (P)",
        is_on=False,
        needs="brains",
    ),
    ActionSpec(
        "tunnels",
        "View",
        "Show &tunnels",
        ("T",),
        lambda w, on: w.tunnels.set_on(on),
        "Show the tunnels through the brains, and say which one is the oesophagus (T)",
        is_on=False,
        needs="brains",
    ),
    ActionSpec(
        "origins",
        "View",
        "Where the surface &comes from",
        ("O",),
        lambda w, on: w.view_area.set_by_origin(on),
        "Show in colours what was filled, drilled, trimmed or bridged (O)",
        is_on=False,
        needs="results",
    ),
    ActionSpec(
        "link",
        "View",
        "&Link cameras",
        ("Ctrl+L",),
        lambda w, on: w.view_area.link.set_on(on),
        "Turn all three brains together (Ctrl+L)",
        is_on=True,
    ),
    ActionSpec(
        "home",
        "View",
        "&Reset views",
        ("R",),
        lambda w: w.view_area.go_home(),
        "Show everything as at first: the brains from the front (R)",
        needs="brains",
    ),
    ActionSpec("shortcuts", "Help", "Mouse and &keys", ("F1",), lambda w: w.show_shortcuts()),
    ActionSpec("method", "Help", "About the &method", (), lambda w: w.show_method()),
)


def make_actions(window: MainWindow) -> dict[str, QAction]:
    """Return the actions by name, each ready to be triggered."""
    actions = {}
    for spec in SPECS:
        action = QAction(spec.text, window)
        action.setObjectName(spec.name)
        action.setShortcuts([QKeySequence(key) for key in spec.keys])
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


def enable_actions(actions: dict[str, QAction], met: set[str]) -> None:
    """Grey out what cannot be done now."""
    for spec in SPECS:
        actions[spec.name].setEnabled(not spec.needs or spec.needs in met)
