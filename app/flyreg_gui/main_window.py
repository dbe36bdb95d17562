"""The window: views in the middle, steps on the left, landmarks on the right."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QCloseEvent, QKeyEvent, QKeySequence, QPixmap
from PySide6.QtWidgets import (
    QAbstractButton,
    QDockWidget,
    QLabel,
    QMainWindow,
    QMenu,
    QSizePolicy,
    QSlider,
    QStackedWidget,
    QToolBar,
    QVBoxLayout,
    QWidget,
)

from flyreg_core import edits
from flyreg_core.errors import TopologyError
from flyreg_core.pipeline import Pipeline
from flyreg_core.project import Project
from flyreg_core.results import Results
from flyreg_gui.actions import enable_actions, fill_menu, make_actions
from flyreg_gui.dialogs import HelpWindow
from flyreg_gui.drill_mode import DrillMode
from flyreg_gui.files import FileCommands
from flyreg_gui.landmark_mode import LandmarkMode
from flyreg_gui.modes import Mode, Modes
from flyreg_gui.panels.banner import Banner
from flyreg_gui.panels.landmarks import LandmarksPanel
from flyreg_gui.panels.start import StartPage
from flyreg_gui.panels.steps import StepsPanel
from flyreg_gui.preferences import Preferences
from flyreg_gui.preparing import PreparingPipeline
from flyreg_gui.report_command import ReportCommand
from flyreg_gui.runner import Runner
from flyreg_gui.selection import Selection
from flyreg_gui.session import Session
from flyreg_gui.status import StatusBar
from flyreg_gui.theme import Theme, current_theme
from flyreg_gui.trim_mode import TrimMode
from flyreg_gui.tunnels import Tunnels, guess_of
from flyreg_gui.view_state import read_view_state, view_state
from flyreg_gui.views.graphics import PRINT, samples_per_pixel
from flyreg_gui.views.view_area import ViewArea

BLEND_AT_FIRST = 20
"""How much of the target shows through, in per cent."""

SHOW_TUNNELS = "Show the tunnels"


class MainWindow(QMainWindow):
    """Puts the parts together; what they do to each other goes through the session."""

    def __init__(self, pipeline: Pipeline) -> None:
        super().__init__()
        self.setObjectName("flyreg")
        self.preferences = Preferences()
        self.runner = Runner(PreparingPipeline(pipeline), self)
        self.session = Session(self.runner, self)
        self.selection = Selection(self)
        self.mode = LandmarkMode(self.session, self.selection, self)
        self.tunnels = Tunnels(self.session, self)
        self.drill = DrillMode(self.session, self)
        self.trim = TrimMode(self.session, self)
        self.files = FileCommands(self)
        self.reports = ReportCommand(self)
        self.view_area = ViewArea(
            self.session, self.selection, self.mode, self.tunnels, self.drill, self.trim
        )
        self.steps = StepsPanel(self.session, self.tunnels, self.trim)
        self.landmarks = LandmarksPanel(self.session, self.selection)
        self.banner, self.start = Banner(), StartPage()
        self.blend = QSlider(Qt.Orientation.Horizontal)
        self.actions_by_name = make_actions(self)
        self._shown_failure: object = None
        self._shown_guess: object = None
        self._theme: Theme | None = None  # before the first one is shown
        self._unread_view = False  # of a project whose first results are still to come
        self._make_center()
        self._make_docks()
        self._make_menus()
        self._make_toolbar()
        self.status = StatusBar(self.session)
        self.setStatusBar(self.status)
        modes: dict[str, Mode] = {
            "landmark_mode": self.mode,
            "drill": self.drill,
            "trim": self.trim,
        }
        self.modes = Modes(modes, self.actions_by_name, self.status, self)
        self._spare_buttons()
        self._connect()
        self._show_theme()
        self._show_state()
        self._restore()

    # Construction

    def _make_center(self) -> None:
        self._stack = QStackedWidget()
        self._stack.addWidget(self.start)
        self._stack.addWidget(self.view_area)
        center = QWidget()
        layout = QVBoxLayout(center)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addWidget(self.banner)
        layout.addWidget(self._stack, 1)
        center.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.setCentralWidget(center)
        center.setFocus()  # not the first button, which would take Space
        self.start.show_recent(self.preferences.recent_projects)

    def _make_docks(self) -> None:
        self._docks = []
        for title, widget, area in (
            ("Steps", self.steps, Qt.DockWidgetArea.LeftDockWidgetArea),
            ("Landmarks", self.landmarks, Qt.DockWidgetArea.RightDockWidgetArea),
        ):
            dock = QDockWidget(title, self)
            dock.setObjectName(title)
            dock.setWidget(widget)
            self.addDockWidget(area, dock)
            self._docks.append(dock)
        self.resizeDocks(self._docks, [290, 390], Qt.Orientation.Horizontal)

    def _make_menus(self) -> None:
        menus: dict[str, QMenu] = {}
        for name in ("File", "Edit", "View", "Help"):
            menus[name] = self.menuBar().addMenu(f"&{name}")
            menus[name].setObjectName(name)
        undo = self.session.undo_stack.createUndoAction(self, "&Undo")
        redo = self.session.undo_stack.createRedoAction(self, "&Redo")
        undo.setShortcut("Ctrl+Z")
        redo.setShortcuts([QKeySequence("Ctrl+Shift+Z"), QKeySequence("Ctrl+Y")])
        self.actions_by_name |= {"undo": undo, "redo": redo}
        menus["Edit"].addActions([undo, redo])
        menus["Edit"].addSeparator()
        actions = self.actions_by_name
        fill_menu(menus["File"], actions, ("save", "export", "quit"))
        fill_menu(menus["Edit"], actions, ("landmark_mode",))
        fill_menu(menus["View"], actions, ("link",))
        fill_menu(menus["Help"], actions)
        menus["View"].addSeparator()
        for dock in self._docks:
            menus["View"].addAction(dock.toggleViewAction())
        self._recent_menu = QMenu("&Recent projects", self)
        menus["File"].insertMenu(actions["demo"], self._recent_menu)
        menus["File"].aboutToShow.connect(self._fill_recent)

    def _make_toolbar(self) -> None:
        bar = QToolBar("Tools", self)
        bar.setObjectName("tools")
        bar.setMovable(False)
        bar.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextOnly)
        actions = self.actions_by_name
        actions["landmark_mode"].setIconText("Landmark mode")
        actions["tunnels"].setIconText("Tunnels")
        actions["trim"].setIconText("Trim and cut")
        actions["undo"].setIconText("Undo")
        actions["redo"].setIconText("Redo")
        bar.addActions([actions["open_brains"], actions["save"], actions["export"]])
        bar.addSeparator()
        bar.addActions([actions["undo"], actions["redo"]])
        bar.addSeparator()
        bar.addActions(
            [actions[name] for name in ("landmark_mode", "tunnels", "trim", "link", "home")]
        )
        spring = QWidget()
        spring.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        bar.addWidget(spring)
        self.blend.setRange(0, 100)
        self.blend.setFixedWidth(140)
        self.blend.setAccessibleName("Blend")
        self.blend.setToolTip("Registered source at the left, target at the right")
        bar.addWidget(QLabel("Registered "))
        bar.addWidget(self.blend)
        bar.addWidget(QLabel(" Target  "))
        self.addToolBar(bar)

    def _connect(self) -> None:
        session, files = self.session, self.files
        session.state_changed.connect(self._show_state)
        session.project_changed.connect(self._on_project)
        session.results_changed.connect(self._on_results)
        session.results_changed.connect(self._on_guess)
        self.tunnels.changed.connect(self._on_tunnels)
        self.banner.asked.connect(self._on_help_asked)
        self.steps.tunnels.drill_asked.connect(self.actions_by_name["drill"].toggle)
        self.blend.valueChanged.connect(self._on_blend)
        self.blend.setValue(BLEND_AT_FIRST)
        self.steps.open_asked.connect(files.open_brains)
        self.steps.export_asked.connect(files.export)
        self.steps.save_asked.connect(files.save)
        self.steps.form.applied.connect(self._on_preparation)
        self.landmarks.refused.connect(self.show_problem)
        self.landmarks.look_at_asked.connect(self.view_area.look_at)
        self.start.open_asked.connect(files.open_brains)
        self.start.project_asked.connect(files.open_project)
        self.start.demo_asked.connect(files.open_demo)
        self.start.recent_asked.connect(self._on_recent)

    def _spare_buttons(self) -> None:
        """Keep a click on a button from taking the keyboard, so that Space stays the window's."""
        for button in self.findChildren(QAbstractButton):
            if button.focusPolicy() & Qt.FocusPolicy.ClickFocus:
                button.setFocusPolicy(Qt.FocusPolicy.TabFocus)

    def _restore(self) -> None:
        self.resize(1400, 900)
        remembered = self.preferences.window
        if remembered is not None:
            self.restoreGeometry(remembered[0])
            self.restoreState(remembered[1])

    # What actions do

    def select_all(self) -> None:
        """Select all landmarks."""
        self.selection.select(self.landmarks.model.ids)

    def escape(self) -> None:
        """Abandon what is half made, or else select nothing."""
        if not self.modes.abandon():
            self.selection.clear()
            self.tunnels.choose(None)

    def delete_landmarks(self) -> None:
        """Remove the selected landmarks, or set them to weight 0 where they lie on the boundary."""
        project, chosen = self.session.project, self.selection.ids
        if project is not None and chosen:
            what = "landmark" if len(chosen) == 1 else f"{len(chosen)} landmarks"
            self.session.edit(f"delete {what}", edits.remove_pairs(project, chosen))

    def show_shortcuts(self) -> None:
        """Show what the mouse and the keys do."""
        self._show_help("Mouse and keys", "shortcuts.md")

    def show_method(self) -> None:
        """Show what the program does and where that comes from."""
        self._show_help("About the method", "method.md")

    def show_problem(self, sentence: str) -> None:
        """Show a sentence above the views; an empty one takes it away."""
        self.banner.show_sentence(sentence)

    def say(self, text: str) -> None:
        """Say for a while what was done."""
        self.status.showMessage(text, 6000)

    def view_state(self) -> dict[str, object]:
        """Return what a project file remembers of the window."""
        return view_state(self)

    def picture(self) -> QPixmap:
        """Return a picture of the whole window, the views included."""
        for frame in self.view_area.frames:
            frame.canvas.set_samples(PRINT)
        picture = self.grab()
        for frame in self.view_area.frames:
            frame.canvas.set_samples(samples_per_pixel())
        return picture

    def _show_help(self, title: str, name: str) -> None:
        HelpWindow(title, name, self).show()

    # News

    def _on_project(self, project: Project | None) -> None:
        self._stack.setCurrentIndex(0 if project is None else 1)

    def _on_results(self, results: Results | None) -> None:
        self._show_state()
        view = results.project.view if results is not None else {}
        if results is not None and self._unread_view:
            self._unread_view = False
            read_view_state(self, view)
        elif results is None:
            self._unread_view = True

    def _on_preparation(self, project: Project) -> None:
        self.session.edit("change preparation", project)

    def _on_tunnels(self) -> None:
        self.actions_by_name["tunnels"].setChecked(self.tunnels.is_on)

    def _on_guess(self, results: Results | None) -> None:
        """Say so when the oesophagus of a brain is a guess that was not shown before."""
        guess = guess_of(results) if results is not None else None
        if guess != self._shown_guess:
            self._shown_guess = guess
            if guess is not None:
                self.banner.show_sentence(guess[0], SHOW_TUNNELS)
            elif self.session.failure is None:
                self.show_problem("")

    def _on_help_asked(self) -> None:
        self.tunnels.set_on(True)
        self.banner.hide()

    def _on_blend(self, per_cent: int) -> None:
        self.view_area.set_blend(per_cent / 100)

    def _on_recent(self, path: str) -> None:
        self.files.open_project_file(Path(path))

    def _fill_recent(self) -> None:
        self._recent_menu.clear()
        for path in self.preferences.recent_projects:
            action = self._recent_menu.addAction(path.name)
            action.setToolTip(str(path))
            action.triggered.connect(lambda _on, path=path: self.files.open_project_file(path))
        self._recent_menu.setEnabled(not self._recent_menu.isEmpty())

    def _show_state(self) -> None:
        session = self.session
        met = set()
        if session.project is not None:
            met.add("project")
        if session.brain("source") is not None or session.brain("target") is not None:
            met.add("brains")
        if session.results is not None:
            met.add("results")
        if session.is_up_to_date:
            met.add("current")
        if session.is_complete:
            met.add("measured")
        enable_actions(self.actions_by_name, met)
        self._show_title()
        if session.failure is not self._shown_failure:
            self._shown_failure = session.failure
            self._show_failure()

    def _show_failure(self) -> None:
        failure = self.session.failure
        if failure is None:
            self.show_problem("")
        else:
            is_about_tunnels = isinstance(failure.error, TopologyError)
            self.banner.show_sentence(failure.sentence, SHOW_TUNNELS if is_about_tunnels else "")

    def _show_title(self) -> None:
        session = self.session
        if session.project is None:
            self.setWindowTitle("flyreg")
            return
        name = session.path.name if session.path else "unsaved project"
        self.setWindowTitle(f"{name}[*] - flyreg")
        self.setWindowModified(bool(session.unsaved_changes))

    def _show_theme(self) -> None:
        theme = current_theme()
        if theme is not self._theme:
            self._theme = theme
            self.view_area.show_theme(theme)
            self.banner.show_theme(theme)
            self.steps.show_theme(theme)

    def event(self, event: QEvent) -> bool:
        """Leave Space to a button that the keyboard went to, before the shortcut gets it."""
        if (
            event.type() == QEvent.Type.ShortcutOverride
            and isinstance(event, QKeyEvent)
            and event.key() == Qt.Key.Key_Space
            and isinstance(self.focusWidget(), QAbstractButton)
        ):
            event.accept()
            return True
        return super().event(event)

    def changeEvent(self, event: QEvent) -> None:
        """Follow the system from light to dark and back."""
        super().changeEvent(event)
        if event.type() == QEvent.Type.PaletteChange and self._theme is not None:
            self._show_theme()

    def closeEvent(self, event: QCloseEvent) -> None:
        """Ask about unsaved changes, then end the worker and VTK."""
        if not self.files.may_discard():
            event.ignore()
            return
        self.preferences.save_window(self.saveGeometry(), self.saveState())
        self.reports.close()
        self.runner.close()
        self.view_area.close_canvases()
        event.accept()
