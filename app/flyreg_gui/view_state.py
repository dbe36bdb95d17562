"""What a project file remembers of the window: where the camera was, how views were blended."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from flyreg_gui.judging import is_choice
from flyreg_gui.marker_colors import is_marker_choice
from flyreg_gui.views.camera import Pose

if TYPE_CHECKING:
    from flyreg_gui.main_window import MainWindow


def view_state(window: MainWindow) -> dict[str, object]:
    """Return the state as JSON knows it."""
    state: dict[str, object] = {
        "blend": window.blend.value(),
        "colors": window.judging.chosen,
        "marker_colors": window.coloring.chosen,
        "views": window.view_area.arrangement.state(),
    }
    pose = window.view_area.source.pose()
    if pose is not None:
        state["camera"] = {
            "position": list(pose.position),
            "focal_point": list(pose.focal_point),
            "up": list(pose.up),
        }
    return state


def read_view_state(window: MainWindow, state: Mapping[str, object]) -> None:
    """Restore what is there; what is missing or damaged stays as it is."""
    blend = state.get("blend")
    if isinstance(blend, int | float):
        window.blend.setValue(round(blend))
    window.view_area.arrangement.restore(state.get("views"))
    colors = state.get("colors")
    if isinstance(colors, str) and is_choice(colors):
        window.judging.choose(colors)
    markers = state.get("marker_colors")
    if isinstance(markers, str) and is_marker_choice(markers):
        window.coloring.choose(markers)
    camera = state.get("camera")
    if not isinstance(camera, Mapping):
        return
    places = [_triple(camera.get(name)) for name in ("position", "focal_point", "up")]
    position, focal_point, up = places
    if position and focal_point and up:
        for view in window.view_area.surface_views:
            view.set_pose(Pose(position, focal_point, up))


def _triple(value: object) -> tuple[float, ...] | None:
    if not isinstance(value, Sequence) or isinstance(value, str) or len(value) != 3:
        return None
    if not all(isinstance(number, int | float) for number in value):
        return None
    return tuple(float(number) for number in value)
