"""The five views and what they show of the results."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QVBoxLayout, QWidget

from flyreg_core.project import Role
from flyreg_core.results import PreparedBrain, Results
from flyreg_gui.drill_mode import DrillMode
from flyreg_gui.judging import Judging
from flyreg_gui.landmark_mode import LandmarkMode, end_point
from flyreg_gui.marker_colors import MarkerColoring
from flyreg_gui.panels.cut_bar import CutBar
from flyreg_gui.preparing import ROLES
from flyreg_gui.selection import Selection
from flyreg_gui.session import Session
from flyreg_gui.steps import short_name
from flyreg_gui.theme import SOURCE, TARGET, Color, Theme
from flyreg_gui.trim_mode import TrimMode
from flyreg_gui.tunnels import Tunnels
from flyreg_gui.views.arrangement import Arrangement
from flyreg_gui.views.camera import CameraLink
from flyreg_gui.views.canvas import Canvas, FlatCanvas
from flyreg_gui.views.clicks import Clicks
from flyreg_gui.views.cursor import Cursor
from flyreg_gui.views.cut_handle import CutHandle
from flyreg_gui.views.flat_view import FlatView
from flyreg_gui.views.legends import show_legends, show_marker_scale
from flyreg_gui.views.looks import STAGES, STAGES_TIP, Look, Stage
from flyreg_gui.views.markers import points_of, style_markers
from flyreg_gui.views.raw_views import RawViews
from flyreg_gui.views.surface_view import SurfaceView
from flyreg_gui.views.trim_views import TrimViews
from flyreg_gui.views.tunnel_views import TunnelViews
from flyreg_gui.views.turns import Turns
from flyreg_gui.views.view_frame import ViewFrame

SEEN_FROM_OUTSIDE = "The moved source over the target, both seen from outside"
MOST_NAMED = 3
"""Up to so many selected landmarks have their names written; of more, only the current one."""


class ViewArea(QWidget):
    """Source, target, registered over target; below them the halves laid flat."""

    lightened = Signal(bool)  # what is slow to draw has fewer triangles from now on, or all again
    brains_shown = Signal()  # which brains are drawn in which views that are shown

    def __init__(
        self,
        session: Session,
        selection: Selection,
        mode: LandmarkMode,
        tunnels: Tunnels,
        drill: DrillMode,
        trim: TrimMode,
        judging: Judging,
        coloring: MarkerColoring,
    ) -> None:
        super().__init__()
        self._session, self._selection, self._mode = session, selection, mode
        self._trim, self._judging, self._coloring = trim, judging, coloring
        self._theme: Theme | None = None
        self._looks: dict[Role, Look] = {}
        self._landmarks: object = None  # those on show
        self._blend = 0.0
        self._instead: float | None = None
        self.marker_scale, self._are_markers_shown, self._are_own_named = 1.0, True, False
        self._stages: dict[Role, Stage] = dict.fromkeys(ROLES, "prepared")
        self.cut_bar = CutBar()
        self._make_frames()
        self._arrange()
        self.source = SurfaceView(self.frames[0].canvas)
        self.target = SurfaceView(self.frames[1].canvas)
        self.registered = SurfaceView(self.frames[2].canvas)
        self.anterior = FlatView(self._flat_canvases[0], "anterior")
        self.posterior = FlatView(self._flat_canvases[1], "posterior")
        self.surface_views = (self.source, self.target, self.registered)
        self.flat_views = (self.anterior, self.posterior)
        self.views: tuple[SurfaceView | FlatView, ...] = (*self.surface_views, *self.flat_views)
        self.link = CameraLink(self.surface_views, self)
        brains: dict[Role, SurfaceView] = {"source": self.source, "target": self.target}
        self.tunnel_views = TunnelViews(session, tunnels, drill, brains)
        self.trim_views = TrimViews(session, trim, brains)
        own_frames = dict(zip(ROLES, self.frames[:2], strict=True))
        self._raw_views = RawViews(session, own_frames, brains)
        self.cut_handles = [CutHandle(self.cut_bar, view) for view in self.surface_views]
        self._cut_spaces = {view: view.space for view in self.surface_views}
        self.pointer = Cursor(session, self)
        self._clicks = Clicks(session, selection, mode, trim, self)
        session.results_changed.connect(self._on_results)
        session.remains_changed.connect(self._on_raw)
        session.read_changed.connect(self._on_raw)
        selection.changed.connect(self._show_landmarks)
        mode.changed.connect(self._on_mode)
        trim.changed.connect(self._on_trim)
        judging.changed.connect(self._on_judging)
        coloring.chosen_changed.connect(self._show_landmarks)
        self.cut_bar.changed.connect(self._on_cut)
        self.arrangement.changed.connect(self._show_keys)
        self.arrangement.changed.connect(self.brains_shown)
        session.gesture_changed.connect(self.set_moving)
        self.turns = Turns(self)
        for frame in self.frames:
            frame.canvas.moving.connect(self.set_moving)
            frame.canvas.turns = self.turns

    def _make_frames(self) -> None:
        titles = (
            ("Source", "The brain that is moved appears here once it is read.", SOURCE, Canvas),
            ("Target", "The brain that stays appears here once it is read.", TARGET, Canvas),
            (
                "Registered on target",
                "The moved source appears here, on the target.",
                None,
                Canvas,
            ),
            ("Anterior half, flat", "The front half appears here, laid flat.", None, FlatCanvas),
            ("Posterior half, flat", "The back half appears here, laid flat.", None, FlatCanvas),
        )
        self.frames = [ViewFrame(*title) for title in titles]
        self._flat_canvases = [
            frame.canvas for frame in self.frames if isinstance(frame.canvas, FlatCanvas)
        ]
        for role, frame in zip(ROLES, self.frames[:2], strict=True):
            frame.title.offer(STAGES, STAGES_TIP)
            frame.title.chosen.connect(partial(self._on_stage_chosen, role))
        for frame in self.frames:
            frame.maximise_asked.connect(partial(self._on_maximise_asked, frame))

    def _arrange(self) -> None:
        self.arrangement = Arrangement(self.frames)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addWidget(self.cut_bar)
        layout.addWidget(self.arrangement, 1)

    # What the window asks for

    def show_theme(self, theme: Theme) -> None:
        """Take the colours of a theme."""
        self._theme = theme
        for frame in self.frames:
            frame.show_theme(theme)
        for view in self.views:
            view.show_theme(theme)
        self.tunnel_views.show_theme(theme)
        self.trim_views.show_theme(theme)
        for handle in self.cut_handles:
            handle.show_theme(theme)
        self._show_landmarks()

    def set_moving(self, on: bool) -> None:
        """Take notice that a hand moves what is drawn, or has let go of it."""
        for frame in self.frames:
            frame.canvas.set_moving(on)
        self.lightened.emit(any(frame.canvas.is_light for frame in self.frames))

    def set_blend(self, blend: float) -> None:
        """Show the registered source at 0, the target at 1, where both are on show."""
        self._blend = blend
        self._show_blend()

    def show_instead(self, blend: float | None) -> None:
        """Show another blend for a while, or again the one that was set."""
        self._instead = blend
        self._show_blend()

    def _show_blend(self) -> None:
        own = (
            0.0 if self._judging.is_of_source_alone else self._blend
        )  # or the legend would be wrong
        blend = own if self._instead is None else self._instead
        self.registered.set_overlay_opacity(blend)
        for view in self.flat_views:
            view.set_blend(blend)

    def set_marker_scale(self, scale: float) -> None:
        """Draw landmarks larger or smaller than at first."""
        self.marker_scale = scale
        for view in self.views:
            view.marker_scale = scale
        self._show_landmarks()

    def set_markers_shown(self, shown: bool) -> None:
        """Show or hide landmarks."""
        self._are_markers_shown = shown
        self._show_landmarks()

    def set_own_named(self, on: bool) -> None:
        """Write the names of the user's own landmarks, besides those of the selected ones."""
        self._are_own_named = on
        self._show_landmarks()

    def _on_cut(self) -> None:
        """Cut the brains; those that are being trimmed stay whole."""
        for view in self.surface_views:
            is_raw = self._trim.is_on and self.role_of(view) is not None
            view.set_cut(None if is_raw else self.cut_bar.cut)
        self._show_cut_handles()

    def _show_cut_handles(self) -> None:
        for handle in self.cut_handles:
            handle.show()

    def _on_maximise_asked(self, frame: ViewFrame) -> None:
        self.arrangement.toggle_maximised(frame)

    def _on_stage_chosen(self, role: Role, number: int) -> None:
        self._stages[role] = STAGES[number]
        self.pointer.leave()
        if self._session.results is not None:
            self._show_brains(self._session.results)
            self._show_landmarks()

    def _brain_view(self, role: Role) -> SurfaceView:
        return self.source if role == "source" else self.target

    def _on_judging(self) -> None:
        self._show_blend()
        if self._session.results is not None:
            self._show_brains(self._session.results)

    def go_home(self) -> None:
        """Show everything as at first: brains from the front, the halves whole."""
        for view in self.views:
            view.go_home()

    def look_at(self, identifier: str) -> None:
        """Turn the brains so that a landmark faces the user."""
        self.source.look_at(identifier)
        if not self.link.is_on:
            self.target.look_at(identifier)
            self.registered.look_at(identifier)

    def is_on_other_business(self, view: SurfaceView | FlatView) -> bool:
        """Tell whether a view shows a brain otherwise than as prepared."""
        role = self.role_of(view)
        return role is not None and (self._trim.is_on or self._stages[role] != "prepared")

    def role_of(self, view: SurfaceView | FlatView) -> Role | None:
        """Return which brain alone a view shows; None if it shows both."""
        if view is self.source:
            return "source"
        return "target" if view is self.target else None

    @property
    def frames_of_brains(self) -> tuple[tuple[ViewFrame, SurfaceView], ...]:
        """The views in space: source, target, and the one moved on the other."""
        return tuple(zip(self.frames[:3], self.surface_views, strict=True))

    def close_canvases(self) -> None:
        """End VTK in each view; nothing can be drawn afterwards, so news on their way are not."""
        self._session.read_changed.disconnect(self._on_raw)
        for frame in self.frames:
            frame.canvas.end()

    # News

    def _on_results(self, results: Results | None) -> None:
        for frame in self.frames:
            frame.set_empty(results is None)
            frame.set_caption("")
        if results is None:
            self._looks, self._landmarks = {}, None
            for view in self.views:
                view.clear()
            for frame in self.frames:
                frame.title.set_detail("")
            self._show_keys()
            self._show_cut_handles()
        else:
            self._show_brains(results)
            if results.landmarks is not self._landmarks or self._coloring.colors is not None:
                self._show_landmarks()
        self.brains_shown.emit()
        self.turns.go_on()

    def _on_raw(self, *_news: object) -> None:
        """Show the brains as they were read, until they are prepared or where they cannot be."""
        if not self._trim.is_on:
            self._raw_views.show()
        self.brains_shown.emit()

    def _on_trim(self) -> None:
        """Leave the views of the two brains to trimming, or take them back."""
        self._on_cut()
        if self._trim.is_on:
            self._show_keys()
            self._landmarks = None
            self.source.clear_landmarks()
            self.target.clear_landmarks()
            self.trim_views.show()
            return
        if self._session.results is not None:
            self._on_results(self._session.results)
        else:
            self._on_raw()
        self.trim_views.hide()

    def _show_brains(self, results: Results) -> None:
        source = self._look("source", results.source, SOURCE)
        target = self._look("target", results.target, TARGET)
        other, moved = results.target.surface, results.registration.surface
        judging = self._judging
        mine_colors, other_colors = (
            source.colors("source", judging),
            target.colors("target", judging),
        )
        self._show_keys()
        if not self._trim.is_on:
            for role, look in zip(ROLES, (source, target), strict=True):
                shape, colors = look.shape(self._stages[role], role, judging)
                self._brain_view(role).show_surface(shape, colors, look.space)
        self.registered.show_surface(moved, mine_colors, target.space)
        self.registered.show_overlay(other, other_colors)
        if any(view.space is not space for view, space in self._cut_spaces.items()):
            self._cut_spaces = {view: view.space for view in self.surface_views}
            self._show_cut_handles()
        for view in self.flat_views:
            view.show(results, mine_colors, other_colors)
        inputs = (results.project.source.input, results.project.target.input)
        for role, frame, brain in zip(ROLES, self.frames[:2], inputs, strict=True):
            stage = self._stages[role]
            name = short_name(brain) + ("" if stage == "prepared" else f", {stage}")
            frame.title.set_detail(name, brain.path)
        beside = self._session.beside
        self.frames[2].title.set_detail(f"weights {beside}" if beside else "")
        for frame in self.frames[3:]:
            frame.title.set_detail("both brains", SEEN_FROM_OUTSIDE)

    def _show_keys(self) -> None:
        """Say what the colours mean, of each brain in the first of its views that is shown."""
        self._show_marker_scale()
        show_legends(self.frames, self._looks, self._judging, self._trim.is_on)

    def _show_marker_scale(self) -> None:
        show_marker_scale(self.frames, self._coloring.scale if self._are_markers_shown else None)

    def _look(self, role: Role, brain: PreparedBrain, color: Color) -> Look:
        known = self._looks.get(role)
        if known is None or known.brain is not brain:
            self._looks[role] = Look(brain, color)
        return self._looks[role]

    def _show_landmarks(self, *_news: object) -> None:
        results = self._session.results
        if results is None or self._theme is None:
            return
        self._landmarks = results.landmarks
        landmarks = results.landmarks if self._are_markers_shown else ()
        chosen, current = self._selection.ids, self._selection.ids[-1:]
        named = list(chosen if len(chosen) <= MOST_NAMED else current)  # or names hide each other
        if self._are_own_named:
            named += [mark.pair.id for mark in landmarks if mark.pair.origin == "user"]
        for view in self.views:
            view.named = frozenset(named)
        colors = self._coloring.colors
        style = style_markers(landmarks, self._selection.ids, self._theme, colors)
        self._show_marker_scale()
        sources = points_of([landmark.source_point for landmark in landmarks])
        targets = points_of([landmark.target_point for landmark in landmarks])
        if not self._trim.is_on:
            self.source.show_landmarks(sources, style)
            self.target.show_landmarks(targets, style)
            self._show_half_made(results)
            for role in ROLES:
                if self._stages[role] == "smoothed":  # they would hang in the air
                    self._brain_view(role).clear_landmarks()
        self.registered.show_landmarks(targets, style)
        for flat in self.flat_views:
            flat.show_landmarks(landmarks, style)

    def _show_half_made(self, results: Results) -> None:
        """Show the ends of landmarks that are placed on one brain only."""
        brains: tuple[tuple[Role, SurfaceView, PreparedBrain], ...] = (
            ("source", self.source, results.source),
            ("target", self.target, results.target),
        )
        for role, view, brain in brains:
            ends = [
                (pair, end)
                for pair in self._mode.unplaced
                if (end := end_point(pair, role, brain.flat)) is not None
            ]
            ids, names = tuple(pair.id for pair, _ in ends), [pair.name for pair, _ in ends]
            view.show_half_made(points_of([end for _, end in ends]), ids, names)

    def _on_mode(self) -> None:
        results = self._session.results
        if results is not None and not self._trim.is_on:
            self._show_half_made(results)
