"""Neuropils in the views of the brain they belong to, or lie in now, seen through its surface."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from PySide6.QtCore import QPointF

from flyreg_core.mesh import Integers, SurfaceMesh
from flyreg_core.neuropils import Neuropil
from flyreg_gui.carried_neuropils import CarriedNeuropils
from flyreg_gui.neuropils import Neuropils
from flyreg_gui.preparing import ROLES
from flyreg_gui.theme import NEUROPILS, Color
from flyreg_gui.views.layers import Colors
from flyreg_gui.views.surface_view import SurfaceView
from flyreg_gui.views.view_frame import ViewFrame


@dataclass(frozen=True, eq=False)
class Drawn:
    """All neuropils of one brain as one surface."""

    surface: SurfaceMesh
    colors: Colors  # of its vertices
    key: tuple[tuple[Color, str], ...]  # of the neuropils, in their order
    of_face: Integers  # the number of the neuropil of each face

    @classmethod
    def of(cls, neuropils: Sequence[Neuropil], color_of: dict[str, Color]) -> Drawn:
        """Return neuropils as they are drawn, all with their outsides outwards."""
        sizes = [len(each.surface.vertices) for each in neuropils]
        starts = np.cumsum([0, *sizes[:-1]])
        surfaces = [each.surface for each in neuropils]
        outwards = [own.faces if own.volume >= 0 else own.faces[:, ::-1] for own in surfaces]
        faces = [start + own for start, own in zip(starts, outwards, strict=True)]
        key = tuple((color_of[each.name], each.name) for each in neuropils)
        return cls(
            SurfaceMesh(
                np.concatenate([each.surface.vertices for each in neuropils]),
                np.concatenate(faces),
            ),
            np.repeat(np.array([color for color, _ in key], dtype=np.uint8), sizes, axis=0),
            key,
            np.repeat(np.arange(len(neuropils)), [len(own) for own in faces]),
        )


class NeuropilViews:
    """Draws neuropils into views; a legend names them, and so does the mouse that rests on one."""

    def __init__(
        self,
        neuropils: Neuropils,
        carried: CarriedNeuropils,
        views: Sequence[tuple[ViewFrame, SurfaceView]],
    ) -> None:
        self._neuropils, self._carried, self._views = neuropils, carried, tuple(views)
        self._is_on = True
        self._drawn: dict[SurfaceView, Drawn] = {}
        for _, view in self._views:
            view.canvas.hovered.connect(partial(self._on_hovered, view))
        neuropils.changed.connect(self._on_changed)
        carried.changed.connect(self._on_changed)

    def set_on(self, on: bool) -> None:
        """Show or hide neuropils."""
        self._is_on = on
        self.show()

    def show(self) -> None:
        """Draw the neuropils of each brain that is on show, each named in the first view it is in."""
        named: set[tuple[Color, str]] = set()
        for frame, view in self._views:
            drawn = self._drawn.get(view) if self._is_on and view.space is not None else None
            if drawn is None:
                view.hide_neuropils()
            else:
                view.show_neuropils(drawn.surface, drawn.colors)
            key = () if drawn is None or frame.isHidden() else drawn.key
            frame.show_names([each for each in dict.fromkeys(key) if each not in named])
            named.update(key)
            view.canvas.setToolTip("")

    def name_at(self, view: SurfaceView, position: QPointF) -> str:
        """Return the name of the neuropil that is seen first at a position in a view, or none."""
        hit, drawn = view.neuropil_at(position), self._drawn.get(view)
        return "" if hit is None or drawn is None else drawn.key[drawn.of_face[hit.place.face]][1]

    def _on_changed(self) -> None:
        known = self._neuropils.by_name.values()
        colors = colors_of_names(each.name for each in known)
        source, target = ([each for each in known if each.role == role] for role in ROLES)
        on_target = [*target, *self._carried.by_name.values()]
        self._drawn = {
            view: Drawn.of(neuropils, colors)
            for (_, view), neuropils in zip(self._views, (source, target, on_target), strict=True)
            if neuropils
        }
        self.show()

    def _on_hovered(self, view: SurfaceView, position: QPointF) -> None:
        view.canvas.setToolTip(self.name_at(view, position))


def colors_of_names(names: Iterable[str]) -> dict[str, Color]:
    """Return a colour for each name, the same in both brains; after the last the first again."""
    distinct = dict.fromkeys(names)
    return {name: NEUROPILS[number % len(NEUROPILS)] for number, name in enumerate(distinct)}
