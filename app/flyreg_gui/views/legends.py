"""What the colours in the views mean: each is said once, in the first view that is shown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from flyreg_core.project import Role
from flyreg_gui.judging import STATUS_KEY, Judging
from flyreg_gui.theme import Color
from flyreg_gui.views.color_scale import Scale
from flyreg_gui.views.looks import Look
from flyreg_gui.views.view_frame import ViewFrame

ROLES_OF_FRAMES: tuple[Role, ...] = ("source", "target", "source", "source", "source")
"""Whose vertices carry the colours in each view; in the flat ones those of the moved source."""


def show_legends(
    frames: Sequence[ViewFrame], looks: Mapping[Role, Look], judging: Judging, is_trimming: bool
) -> None:
    """Say what the colours of each brain mean; the first two views show no colours in trimming."""
    judged = judging.judged
    explained: set[Role] = set()
    for frame, role in zip(frames, ROLES_OF_FRAMES, strict=True):
        look = looks.get(role)
        key: list[tuple[Color, str, str]] = []
        scale = None
        is_raw = is_trimming and frame in frames[:2]
        if look is not None and not is_raw and not frame.isHidden() and role not in explained:
            if judging.is_by_origin:
                key = look.key
            elif judging.colors_of(role, look.brain.surface) is not None and judged:
                key, scale = (STATUS_KEY, None) if judged.is_kinds else ([], judged)
            explained.add(role)
        frame.show_legend(key)
        frame.show_scale(scale)


def show_marker_scale(frames: Sequence[ViewFrame], scale: Scale | None) -> None:
    """Say what the colours of landmarks mean, if there is anything to say."""
    for frame in frames:
        is_first = not frame.isHidden()
        frame.show_marker_scale(scale if is_first else None)
        scale = None if is_first else scale
