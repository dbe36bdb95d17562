"""The window: views in the middle, steps on the left, landmarks on the right."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from PySide6.QtCore import QEvent, QPoint, QSize, Qt
from PySide6.QtGui import QCloseEvent, QPixmap
from PySide6.QtWidgets import (
    QAbstractButton,
    QComboBox,
    QMainWindow,
    QMenu,
    QSlider,
    QStackedWidget,
    QVBoxLayout,
    QWidget,
)

from flyreg_core import edits
from flyreg_core.pipeline import Pipeline
from flyreg_core.project import Project
from flyreg_core.results import Results
from flyreg_gui.actions import enable_actions, make_actions, needs_met
from flyreg_gui.autosave import Autosave
from flyreg_gui.banner_news import BannerNews
from flyreg_gui.blink import Blink
from flyreg_gui.carried_neuropils import CarriedNeuropils
from flyreg_gui.comparison_dialog import ComparisonCommand
from flyreg_gui.dock_icons import show_dock_icons
from flyreg_gui.docks import make_docks
from flyreg_gui.drill_mode import DrillMode
from flyreg_gui.drops import Drops
from flyreg_gui.files import FileCommands
from flyreg_gui.garbage import GarbageCollector
from flyreg_gui.help_window import HelpWindow, help_pages
from flyreg_gui.judging import ORIGINS, PLAIN, STATUS, Judging
from flyreg_gui.keymap import Keymap
from flyreg_gui.landmark_commands import LandmarkCommands
from flyreg_gui.landmark_mode import LandmarkMode
from flyreg_gui.marker_colors import MarkerColoring
from flyreg_gui.menus import Menus, make_toolbar
from flyreg_gui.modes import Mode, Modes
from flyreg_gui.neuropils import Neuropils
from flyreg_gui.panels.banner import Banner
from flyreg_gui.panels.fold_alarm import FoldAlarm
from flyreg_gui.panels.judge import JudgePanel
from flyreg_gui.panels.landmarks import LandmarksPanel
from flyreg_gui.panels.recovery import RecoveryBar
from flyreg_gui.panels.start import StartPage
from flyreg_gui.panels.steps import StepsPanel
from flyreg_gui.pictures import PictureCommands
from flyreg_gui.preferences import Preferences
from flyreg_gui.preferences_dialog import PreferencesDialog
from flyreg_gui.preparing import PreparingPipeline
from flyreg_gui.report_command import ReportCommand
from flyreg_gui.runner import Runner
from flyreg_gui.selection import Selection
from flyreg_gui.session import Session, with_view
from flyreg_gui.status import StatusBar
from flyreg_gui.taking_away import TakingAway
from flyreg_gui.theme import Scheme, Theme, current_theme, set_scheme
from flyreg_gui.tour import Tour
from flyreg_gui.trim_mode import TrimMode
from flyreg_gui.tunnels import Tunnels
from flyreg_gui.typing_first import TypingFirst
from flyreg_gui.view_commands import ViewCommands
from flyreg_gui.view_state import read_view_state, view_state
from flyreg_gui.views.graphics import PRINT, samples_per_pixel
from flyreg_gui.views.neuropil_views import NeuropilViews
from flyreg_gui.views.view_area import ViewArea

BLEND_AT_FIRST = 20
"""How much of the target shows through, in per cent."""

USUAL_SIZE = (1400, 900)
"""Of the window as it first opens, where the screen is large enough."""


class MainWindow(QMainWindow):
    """Puts the parts together; what they do to each other goes through the session."""

    def __init__(self, pipeline: Pipeline) -> None:
        super().__init__()
        self.setObjectName("flyreg")
        self.preferences = Preferences()
        preparing = PreparingPipeline(pipeline, self)
        self.runner = Runner(preparing, self)
        self.session = Session(self.runner, self)
        preparing.brain_read.connect(self.session.take_read)
        self.selection = Selection(self)
        self.mode = LandmarkMode(self.session, self.selection, self)
        self.tunnels = Tunnels(self.session, self)
        self.drill = DrillMode(self.session, self)
        self.trim = TrimMode(self.session, self)
        self.judging = Judging(self.session, self)
        self.coloring = MarkerColoring(self.session, self)  # before what shows its colours
        self.files = FileCommands(self)
        self.neuropils = Neuropils(self.session, self)
        self.carried = CarriedNeuropils(self.session, self.neuropils, self)
        self.landmark_commands = LandmarkCommands(self)
        self.taking_away = TakingAway(self)
        self.pictures = PictureCommands(self)
        self.drops = Drops(self)
        GarbageCollector(self.session, self)
        self.autosave = Autosave(self.session, lambda p: with_view(p, self.view_state()), self)
        self.recovery = RecoveryBar(self)
        self.blink = Blink(self.session, self.say, self)
        self.reports = ReportCommand(self)
        self.comparing = ComparisonCommand(self)
        self.view_area = ViewArea(
            *(self.session, self.selection, self.mode, self.tunnels, self.drill, self.trim),
            *(self.judging, self.coloring),
        )
        self.neuropil_views = NeuropilViews(
            self.neuropils, self.carried, self.view_area.frames_of_brains
        )
        self.view_commands = ViewCommands(self.view_area, self.selection)
        self.steps = StepsPanel(self.session, self.tunnels, self.trim)
        self.landmarks = LandmarksPanel(self.session, self.selection)
        self.judge = JudgePanel(self.judging, self.coloring)
        self.banner, self.start = Banner(), StartPage()
        BannerNews(self.session, self.tunnels, self.banner, self)
        self.fold_alarm = FoldAlarm(self.session)
        self.blend = QSlider(Qt.Orientation.Horizontal)
        self.actions_by_name = make_actions(self)
        self._theme: Theme | None = None  # before the first one is shown
        self._unread_view = False  # of a project whose first results are still to come
        self._make_center()
        self.docks = make_docks(self)
        self.menus = Menus(self)
        self.keymap = Keymap(self.actions_by_name, self.preferences)
        self._tools = make_toolbar(self)
        self.tour = Tour(self)
        self.status = StatusBar(self.session)
        self.setStatusBar(self.status)
        modes: dict[str, Mode] = {
            "landmark_mode": self.mode,
            "drill": self.drill,
            "trim": self.trim,
        }
        self.modes = Modes(modes, self.actions_by_name, self.status, self)
        self._spare_buttons()
        self._typing_first = TypingFirst(self)
        self._connect()
        self._show_theme()
        self._show_state()
        self._restore()

    # Construction

    def _make_center(self) -> None:
        self._stack = QStackedWidget()
        self._stack.addWidget(self.start)
        self._stack.addWidget(self.view_area)
        center = self._center = QWidget()
        layout = QVBoxLayout(center)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addWidget(self.recovery)
        layout.addWidget(self.banner)
        layout.addWidget(self.fold_alarm)
        layout.addWidget(self._stack, 1)
        center.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.setCentralWidget(center)
        center.setFocus()  # not the first button, which would take Space
        self.start.show_recent(self.preferences.recent_projects, self.preferences.recent_pairs)

    def _connect(self) -> None:
        session, files = self.session, self.files
        session.state_changed.connect(self._show_state)
        session.project_changed.connect(self._on_project)
        session.results_changed.connect(self._on_results)
        self.tunnels.changed.connect(self._on_tunnels)
        self.judging.chosen_changed.connect(self._on_judging_chosen)
        self.judging.changed.connect(
            lambda: self.blend.setDisabled(self.judging.is_of_source_alone)
        )
        self.fold_alarm.places_asked.connect(
            lambda on: self.judging.choose(STATUS if on else PLAIN)
        )
        self.coloring.colored.connect(self.landmarks.model.show_colors)
        self.steps.tunnels.drill_asked.connect(self.actions_by_name["drill"].toggle)
        self.autosave.set_seconds(self.preferences.autosave_seconds)
        self.autosave.failed.connect(self.show_problem)
        self.blink.refused.connect(self.show_problem)
        self.blink.changed.connect(
            lambda: self.actions_by_name["blink"].setChecked(self.blink.is_on)
        )
        self.blend.valueChanged.connect(self._on_blend)
        self.blend.setValue(BLEND_AT_FIRST)
        for slider in (self.blend, self.view_area.cut_bar.place):
            slider.sliderPressed.connect(partial(self.view_area.set_moving, True))
            slider.sliderReleased.connect(partial(self.view_area.set_moving, False))
        self.steps.open_asked.connect(files.open_brains)
        self.steps.export_asked.connect(files.export)
        self.steps.save_asked.connect(files.save)
        self.steps.form.applied.connect(self._on_preparation)
        self.landmarks.refused.connect(self.show_problem)
        self.landmarks.accept_button.clicked.connect(self.actions_by_name["accept"].trigger)
        self.landmarks.model.ticked.connect(self.landmark_commands.set_acting)
        self.landmarks.menu_asked.connect(self._on_menu_asked)
        self.landmarks.neighbourhood.asked.connect(self.landmark_commands.weigh_near)
        self.landmarks.neighbourhood.load_asked.connect(self.landmark_commands.load_neuropils)
        self.neuropils.changed.connect(self._on_neuropils)
        self.view_area.brains_shown.connect(self.neuropil_views.show)
        self.neuropils.refused.connect(self.show_problem)
        self.landmarks.look_at_asked.connect(self.view_area.look_at)
        self.view_area.pointer.moved.connect(self.status.show_place)
        self.view_area.lightened.connect(self.status.show_lightness)
        self.view_area.lightened.connect(self.runner.pace)
        self.view_area.turns.over.connect(self.runner.begin_next)
        self.start.open_asked.connect(files.open_brains)
        self.start.project_asked.connect(files.open_project)
        self.start.demo_asked.connect(files.open_demo)
        self.start.recent_asked.connect(self._on_recent)
        self.start.templates_asked.connect(files.open_templates)
        self.start.recent_pair_asked.connect(files.open_recent_pair)

    def _spare_buttons(self) -> None:
        """Keep a click on a button or choice from taking the keyboard: keys stay the window's."""
        for kind in (QAbstractButton, QComboBox):
            for widget in self.findChildren(kind):
                if widget.focusPolicy() & Qt.FocusPolicy.ClickFocus:
                    widget.setFocusPolicy(Qt.FocusPolicy.TabFocus)

    def _restore(self) -> None:
        self.resize(QSize(*USUAL_SIZE).boundedTo(self.screen().availableSize()))
        remembered = self.preferences.window
        if remembered is not None:
            self.restoreGeometry(remembered[0])
            self.restoreState(remembered[1])
        self.view_area.arrangement.restore(self.preferences.views)

    # What actions do

    def select_all(self) -> None:
        """Select all landmarks."""
        self.selection.select(self.landmarks.model.ids)

    def escape(self) -> None:
        """Abandon what is half made, or else select nothing; the keys are the window's again."""
        self._center.setFocus()
        if self.blink.is_on:
            self.blink.set_on(False)
        elif not self.modes.abandon():
            self.selection.clear()
            self.tunnels.choose(None)

    def delete_landmarks(self) -> None:
        """Remove the selected landmarks, or set them to weight 0 where they lie on the boundary."""
        project, chosen = self.session.project, self.selection.ids
        if project is not None and chosen:
            what = "landmark" if len(chosen) == 1 else f"{len(chosen)} landmarks"
            self.session.edit(f"delete {what}", edits.remove_pairs(project, chosen))

    def show_help(self, title: str) -> None:
        """Show a page of the help beside the work."""
        HelpWindow(help_pages(self.keymap.as_markdown()), title, self).show()

    def tool_button(self, name: str) -> QWidget:
        """Return the button of an action in the toolbar."""
        return self._tools.widgetForAction(self.actions_by_name[name])

    def show_preferences(self) -> None:
        """Show the preferences beside the work."""
        PreferencesDialog(self).show()

    def toggle_dark(self) -> None:
        """Turn the window dark, or light again."""
        self.set_scheme("light" if current_theme().is_dark else "dark")

    def set_scheme(self, scheme: Scheme) -> None:
        """Turn the program light, dark, or as the system is, and remember that."""
        self.preferences.scheme = scheme
        set_scheme(scheme)

    def set_autosave_seconds(self, seconds: int) -> None:
        """Say how long a change may wait until it is kept, and remember that."""
        self.preferences.autosave_seconds = seconds
        self.autosave.set_seconds(seconds)

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

    def _on_menu_asked(self, place: QPoint) -> None:
        menu = QMenu(self)
        names = ("accept", "mirror", "mute", "solo", "recolor", "delete")
        menu.addActions([self.actions_by_name[name] for name in names])
        menu.exec(place)
        menu.deleteLater()

    def _on_neuropils(self) -> None:
        self.landmarks.neighbourhood.show_names(list(self.neuropils.by_name))

    def _on_tunnels(self) -> None:
        self.actions_by_name["tunnels"].setChecked(self.tunnels.is_on)

    def _on_judging_chosen(self, name: str) -> None:
        self.actions_by_name["origins"].setChecked(name == ORIGINS)
        self.fold_alarm.places_button.setChecked(name == STATUS)

    def _on_blend(self, per_cent: int) -> None:
        self.view_area.set_blend(per_cent / 100)

    def _on_recent(self, path: str) -> None:
        self.files.open_project_file(Path(path))

    def _show_state(self) -> None:
        enable_actions(self.actions_by_name, needs_met(self.session))
        self._show_title()

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
            self.recovery.show_theme(theme)
            self.tour.show_theme(theme)
            self.fold_alarm.show_theme(theme)
            self.steps.show_theme(theme)
            self.judge.show_theme(theme)
            for dock in self.docks:
                show_dock_icons(dock, theme)

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
        self.recovery.release()
        self.autosave.close()
        self.preferences.views = self.view_area.arrangement.state()
        self.reports.close()
        self.comparing.close()
        self.runner.close()
        self.judging.close()
        self.carried.close()
        self.view_area.close_canvases()
        event.accept()
