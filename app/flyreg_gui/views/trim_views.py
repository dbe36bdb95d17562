"""The planes and the cut in the views of the two brains, with a dot each to drag them by."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPointF, Qt

from flyreg_core.frame import ANTERO_POSTERIOR, LEFT_RIGHT
from flyreg_core.mesh import Floats, SurfaceMesh
from flyreg_core.project import Role
from flyreg_core.relief import relief_colors
from flyreg_gui.session import BrainOnShow, Session
from flyreg_gui.theme import CUT, SOURCE, TARGET, TRIM, Theme
from flyreg_gui.trim_mode import Knob, TrimMode, TrimPlaces, beyond, label_of
from flyreg_gui.views.camera import Pose, ViewSpace
from flyreg_gui.views.layers import Colors, DotLayer, LabelLayer, SheetLayer
from flyreg_gui.views.picking import MARKER_REACH, way_along
from flyreg_gui.views.surface_view import SurfaceView

MARGIN = 0.06
"""How far the sheets stand out of the brain, as a share of its extent."""
OPACITY, OUTLINE = 0.22, 2.0
DOT, HALO = 15.0, 4.0
BEHIND = 0.68
"""Brightness of what lies behind the cut."""
CUT_OFF = (150, 150, 150)
FLATTEST = 0.02
"""Least squared sine between the line of sight and the line that a dot moves on."""


class TrimView:
    """One brain as it was read, what would be cut off in grey, and what does the cutting."""

    def __init__(self, role: Role, session: Session, mode: TrimMode, view: SurfaceView) -> None:
        self._role: Role = role
        self._session, self._mode, self.view = session, mode, view
        canvas = view.canvas
        self._planes = SheetLayer(canvas, OPACITY, OUTLINE)
        self._cut = SheetLayer(canvas, OPACITY, OUTLINE)
        self._dots, self._labels = DotLayer(canvas, DOT, HALO), LabelLayer(canvas)
        self._planes.set_color(TRIM)
        self._cut.set_color(CUT)
        self._raw: SurfaceMesh | None = None
        self._before: Pose | None = None
        self._knobs: dict[Knob, Floats] = {}
        self._grip: tuple[Floats, Floats, float] | None = None  # dot, its line, and where it was
        canvas.hovered.connect(self._on_hovered)

    def show_theme(self, theme: Theme) -> None:
        """Take the colours of a theme."""
        scale = self.view.canvas.devicePixelRatioF()
        self._labels.set_style(theme.text, theme.background, scale)
        self._dots.set_scale(scale)
        for sheet in (self._planes, self._cut):
            sheet.set_width(OUTLINE * scale)

    def show(self) -> None:
        """Draw the brain and the sheets as they are now."""
        brain, places = self._session.brain(self._role), self._mode.places(self._role)
        if brain is None or places is None:
            return
        if brain.raw is not self._raw:
            self._begin(brain)
        self._show_brain(places)
        self._show_sheets(brain, places)
        self.view.canvas.grabber = self
        self.view.canvas.refresh()

    def hide(self) -> None:
        """Draw nothing of all that any more."""
        if self._raw is None:
            return
        self._raw, self._knobs = None, {}
        self._planes.show([])
        self._cut.show([])
        self._dots.show(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.uint8))
        self._labels.show(np.zeros((0, 3)), [])
        self.view.canvas.grabber = None
        self.view.canvas.unsetCursor()
        if self._before is None:
            self.view.go_home()
        else:
            self.view.set_pose(self._before)

    def _begin(self, brain: BrainOnShow) -> None:
        """Look at the brain obliquely from above: all three sheets can be dragged there."""
        if self._raw is None:
            self._before = None if self.view.is_home else self.view.pose()
        self._raw = brain.raw
        self._space = ViewSpace.of(brain.raw, brain.frame)
        self._coordinates = brain.frame.coordinates(brain.raw.vertices)
        color = SOURCE if self._role == "source" else TARGET
        self._colors = relief_colors(brain.raw, color)
        self._grey = relief_colors(brain.raw, CUT_OFF)
        self.view.show_surface(brain.raw, self._colors, self._space)
        canvas = self.view.canvas
        self.view.set_pose(Pose.from_above(self._space, canvas.width() / max(canvas.height(), 1)))

    def _show_brain(self, places: TrimPlaces) -> None:
        assert self._raw is not None
        colors: Colors = self._colors.copy()
        if places.knots is not None:
            x, depth = self._coordinates[:, LEFT_RIGHT], self._coordinates[:, ANTERO_POSTERIOR]
            behind = depth > np.interp(x, *places.knots.T)
            colors[behind] = (BEHIND * colors[behind]).astype(np.uint8)
        off = beyond(self._coordinates, places)
        colors[off] = self._grey[off]
        self.view.show_surface(self._raw, colors, self._space)

    def _show_sheets(self, brain: BrainOnShow, places: TrimPlaces) -> None:
        low, high = self._coordinates.min(axis=0), self._coordinates.max(axis=0)
        low, high = low - MARGIN * (high - low), high + MARGIN * (high - low)
        (_, top, front), (_, bottom, back) = low, high
        points = brain.frame.points
        sheets, knobs, labels = [], {}, {}
        sides: tuple[tuple[Knob, float], ...] = (("right", places.right), ("left", places.left))
        for knob, x in sides:
            sheets.append(
                points(np.array([[[x, y, z] for z in (front, back)] for y in (top, bottom)]))
            )
            knobs[knob] = points(np.array([x, top, front]))
            labels[knob] = points(np.array([x, bottom, front]))
        self._planes.show(sheets)
        if places.knots is None:
            self._cut.show([])
        else:
            across = np.concatenate([low[:1], places.knots[:, 0], high[:1]])
            depths = np.interp(across, *places.knots.T)
            strip = [
                np.column_stack([across, np.full(len(across), y), depths]) for y in (top, bottom)
            ]
            self._cut.show([points(np.stack(strip))])
            middle = (places.right + places.left) / 2
            depth = float(np.interp(middle, *places.knots.T))
            knobs["cut"] = labels["cut"] = points(np.array([middle, top, depth]))
        self._knobs = knobs
        colors = [CUT if knob == "cut" else TRIM for knob in knobs]
        self._dots.show(np.array(list(knobs.values())), np.array(colors, dtype=np.uint8))
        texts = [label_of(knob, places.of(knob)) for knob in knobs]
        self._labels.show(np.array(list(labels.values())), texts)

    # What the canvas asks

    def press(self, position: QPointF) -> bool:
        """Take hold of the dot at a position."""
        knob, brain = self.knob_at(position), self._session.brain(self._role)
        places = self._mode.places(self._role)
        if knob is None or brain is None or places is None:
            return False
        axis = ANTERO_POSTERIOR if knob == "cut" else LEFT_RIGHT
        dot, line = self._knobs[knob], brain.frame.axes[axis]
        way = self._way(position, dot, line)
        if way is not None:
            self._mode.grab(self._role, knob)
            self._grip = (dot, line, places.of(knob) - way)
        return True

    def move(self, position: QPointF) -> None:
        """Drag the dot along its line to where the line passes the mouse nearest."""
        if self._grip is not None:
            dot, line, offset = self._grip
            way = self._way(position, dot, line)
            if way is not None:
                self._mode.drag_to(offset + way)

    def release(self) -> None:
        """Let go of the dot."""
        if self._grip is not None:
            self._grip = None
            self._mode.release()

    def double_click(self, position: QPointF) -> bool:
        """Leave the sheet of the dot at a position to the program again."""
        knob = self.knob_at(position)
        if knob is not None:
            self._mode.reset(self._role, knob)
        return knob is not None

    def knob_at(self, position: QPointF) -> Knob | None:
        """Return what the dot at a position moves."""
        if not self._knobs:
            return None
        pixels, _ = self.view.canvas.to_pixels(np.array(list(self._knobs.values())))
        away = np.hypot(pixels[:, 0] - position.x(), pixels[:, 1] - position.y())
        nearest = int(away.argmin())
        return list(self._knobs)[nearest] if away[nearest] <= MARKER_REACH else None

    def place_of(self, knob: Knob) -> Floats:
        """Return where the dot of a plane or of the cut is."""
        return self._knobs[knob]

    def _way(self, position: QPointF, dot: Floats, line: Floats) -> float | None:
        """Return how far along its line a dot is nearest to the mouse; None if seen end on."""
        return way_along(self.view.canvas, position, dot, line, FLATTEST)

    def _on_hovered(self, position: QPointF) -> None:
        if self._raw is not None:
            hand = Qt.CursorShape.OpenHandCursor
            is_over = self.knob_at(position) is not None
            self.view.canvas.setCursor(hand if is_over else Qt.CursorShape.ArrowCursor)


class TrimViews:
    """Both brains."""

    def __init__(self, session: Session, mode: TrimMode, views: dict[Role, SurfaceView]) -> None:
        self._mode = mode
        self.of = {role: TrimView(role, session, mode, view) for role, view in views.items()}
        mode.dragged.connect(self._on_dragged)

    def show(self) -> None:
        """Draw both brains as the mode says."""
        for each in self.of.values():
            each.show()

    def hide(self) -> None:
        """Leave the views to others."""
        for each in self.of.values():
            each.hide()

    def show_theme(self, theme: Theme) -> None:
        """Take the colours of a theme."""
        for each in self.of.values():
            each.show_theme(theme)

    def _on_dragged(self, role: Role) -> None:
        self.of[role].show()
