"""The menus and the toolbar of the window, filled from the table of actions."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flyreg_resources import landmark_lists
from PySide6.QtCore import Qt
from PySide6.QtGui import QActionGroup, QKeySequence
from PySide6.QtWidgets import QLabel, QMenu, QSizePolicy, QToolBar, QWidget

from flyreg_gui.actions import fill_menu
from flyreg_gui.landmark_mode import KINDS
from flyreg_gui.view_menus import add_marker_menu, add_view_menus

if TYPE_CHECKING:
    from flyreg_gui.main_window import MainWindow


class Menus:
    """The menu bar; recent files are looked up whenever the File menu opens."""

    def __init__(self, window: MainWindow) -> None:
        self._window = window
        self.recent_projects = QMenu("&Recent projects", window)
        self.recent_pairs = QMenu("Recent &brains", window)
        self._make()

    def _make(self) -> None:
        window = self._window
        menus: dict[str, QMenu] = {}
        for name in ("File", "Edit", "Landmarks", "View", "Help"):
            menus[name] = window.menuBar().addMenu(f"&{name}")
            menus[name].setObjectName(name)
        undo = window.session.undo_stack.createUndoAction(window, "&Undo")
        redo = window.session.undo_stack.createRedoAction(window, "&Redo")
        undo.setShortcut("Ctrl+Z")
        redo.setShortcuts([QKeySequence("Ctrl+Shift+Z"), QKeySequence("Ctrl+Y")])
        undo.setIconText("Undo")  # the text in the menu tells what would be undone
        redo.setIconText("Redo")
        window.actions_by_name |= {"undo": undo, "redo": redo}
        menus["Edit"].addActions([undo, redo])
        menus["Edit"].addSeparator()
        actions = window.actions_by_name
        fill_menu(menus["File"], actions, ("save", "export", "quit"))
        fill_menu(menus["Edit"], actions, ("keep_A", "drill", "copy_command", "preferences"))
        fill_menu(menus["Landmarks"], actions, ("accept", "next_unplaced", "import_landmarks"))
        self._fill_presets(menus["Landmarks"])
        fill_menu(
            menus["View"],
            actions,
            ("blink", "link", "home", "focus", "blink_target", "markers", "dark"),
        )
        add_view_menus(menus["View"], actions, window.view_area.arrangement)
        add_marker_menu(menus["View"], actions["own_names"], window.coloring)
        fill_menu(menus["Help"], actions)
        menus["View"].addSeparator()
        for dock in window.docks:
            menus["View"].addAction(dock.toggleViewAction())
        pictures = QMenu("&Pictures", window)
        pictures.setObjectName("Pictures")
        fill_menu(pictures, actions)
        menus["File"].insertMenu(actions["quit"], pictures)
        menus["File"].insertSeparator(actions["quit"])
        menus["File"].insertMenu(actions["demo"], self.recent_pairs)
        menus["File"].insertMenu(actions["demo"], self.recent_projects)
        menus["File"].aboutToShow.connect(self.fill_recent)

    def _fill_presets(self, menu: QMenu) -> None:
        """Offer the lists of landmarks that come with the program, and where new ones lie."""
        window = self._window
        lists = QMenu("Landmarks to &place", window)
        lists.setObjectName("Landmarks to place")
        for path in landmark_lists():
            action = lists.addAction(path.stem.replace("-", " ").capitalize())
            action.triggered.connect(
                lambda _on, path=path: window.landmark_commands.add_template(path)
            )
        menu.insertMenu(window.actions_by_name["template"], lists)
        kinds = QMenu("New landmarks &lie", window)
        group = QActionGroup(kinds)
        for kind in KINDS:
            on_curve = "anywhere on the surface" if kind == "interior" else f"on the {kind} curve"
            action = kinds.addAction(on_curve)
            action.setCheckable(True)
            action.setChecked(kind == window.mode.kind)
            action.triggered.connect(lambda _on, kind=kind: window.mode.set_kind(kind))
            group.addAction(action)
        menu.insertMenu(window.actions_by_name["accept"], kinds)

    def fill_recent(self) -> None:
        """Offer what was opened last and is still there."""
        window = self._window
        self.recent_projects.clear()
        for path in window.preferences.recent_projects:
            action = self.recent_projects.addAction(path.name)
            action.setToolTip(str(path))
            action.triggered.connect(lambda _on, path=path: window.files.open_project_file(path))
        self.recent_pairs.clear()
        for source, target in window.preferences.recent_pairs:
            text = f"{source.short_name} on {target.short_name}"
            action = self.recent_pairs.addAction(text)
            action.setToolTip(f"{source.name}\n{target.name}")
            action.triggered.connect(
                lambda _on, pair=(source, target): window.files.open_recent_pair(*pair)
            )
        self.recent_pairs.setEnabled(not self.recent_pairs.isEmpty())
        self.recent_projects.setEnabled(not self.recent_projects.isEmpty())


def make_toolbar(window: MainWindow) -> QToolBar:
    """Return the toolbar, with the blend slider at its right end."""
    bar = QToolBar("Tools", window)
    bar.setObjectName("tools")
    bar.setMovable(False)
    bar.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextOnly)
    actions = window.actions_by_name
    bar.addActions([actions["open_brains"], actions["save"], actions["export"]])
    bar.addSeparator()
    bar.addActions([actions["undo"], actions["redo"]])
    bar.addSeparator()
    bar.addActions([actions[name] for name in ("landmark_mode", "tunnels", "trim", "link", "home")])
    spring = QWidget()
    spring.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
    bar.addWidget(spring)
    window.blend.setRange(0, 100)
    window.blend.setFixedWidth(140)
    window.blend.setAccessibleName("Blend")
    window.blend.setToolTip("Registered source at the left, target at the right")
    bar.addWidget(QLabel("Registered "))
    bar.addWidget(window.blend)
    bar.addWidget(QLabel(" Target  "))
    window.addToolBar(bar)
    return bar
