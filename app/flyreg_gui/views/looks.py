"""How a prepared brain looks: at each stage, in its own colours or those it is judged by."""

from __future__ import annotations

from functools import cached_property
from typing import Literal

from flyreg_core.mesh import SurfaceMesh
from flyreg_core.progress import ignore
from flyreg_core.project import Role
from flyreg_core.relief import relief_colors, tinted
from flyreg_core.results import PreparedBrain
from flyreg_core.smooth import smooth
from flyreg_gui.judging import Judging
from flyreg_gui.theme import Color
from flyreg_gui.views.camera import ViewSpace
from flyreg_gui.views.layers import Colors
from flyreg_gui.views.origins import key_of, origin_colors

Stage = Literal["prepared", "as read", "smoothed"]
STAGES: tuple[Stage, ...] = ("prepared", "as read", "smoothed")
STAGES_TIP = "As read from the file; prepared; or smoothed until the lobes are gone, to be cut by"


class Look:
    """What is drawn of one prepared brain whatever the registration: its space and its colours."""

    def __init__(self, brain: PreparedBrain, color: Color) -> None:
        self.brain, self._color = brain, color
        self.space = ViewSpace.of(brain.surface, brain.frame)

    def colors(self, role: Role, judging: Judging) -> Colors:
        """Return the colours of the vertices: the brain's own, or what is chosen to judge by."""
        if judging.is_by_origin:
            return self._by_origin
        judged = judging.colors_of(role, self.brain.surface)
        return self._plain if judged is None else judged

    @cached_property
    def _plain(self) -> Colors:
        return tinted(self.brain.relief, self._color)

    @cached_property
    def _by_origin(self) -> Colors:
        return origin_colors(self.brain)

    def shape(self, stage: Stage, role: Role, judging: Judging) -> tuple[SurfaceMesh, Colors]:
        """Return the surface of a stage of the preparation, with its colours."""
        if stage == "as read":
            return self.brain.raw, self._raw_colors
        colors = self.colors(role, judging)
        return (self.brain.surface if stage == "prepared" else self._smoothed), colors

    @cached_property
    def _raw_colors(self) -> Colors:
        return relief_colors(self.brain.raw, self._color)

    @cached_property
    def _smoothed(self) -> SurfaceMesh:
        surface = self.brain.surface
        passes = self.brain.brain.smooth
        return surface.moved(smooth(surface.vertices, surface.faces, passes, ignore))

    @cached_property
    def key(self) -> list[tuple[Color, str, str]]:
        """What the colours by origin mean."""
        return key_of(self.brain)
