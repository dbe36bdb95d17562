"""A surface as it is drawn: whole, or with fewer faces while a hand moves what is slow to draw."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray
from vtkmodules.vtkCommonDataModel import vtkPlane

from flyreg_core.mesh import Floats, Integers
from flyreg_core.mesh_part import MeshPart
from flyreg_core.normals import vertex_normals
from flyreg_gui.views.canvas import Canvas
from flyreg_gui.views.layers import Colors, clip_by, draw_in_front, put

BOXES, BOXES_OF_PLANE = 40, 64
"""Of so many boxes along its longest side a lighter surface keeps one vertex each."""


class SurfaceLayer:
    """A mesh with a colour at each vertex.

    VTK gets it when the canvas is drawn: a canvas that is hidden costs nothing.
    """

    def __init__(self, canvas: Canvas, name: str, *, lit: bool = True) -> None:
        self._canvas, self._name, self._lit = canvas, name, lit
        self._shown: tuple[Floats, Integers, Colors] | None = None
        self._whole: _Copy | None = None
        self._lighter: _Copy | None = None
        self._clip: vtkPlane | None = None
        self.actor: pv.Actor | None = None
        canvas.before_drawing(self._follow)

    def show(self, vertices: Floats, faces: Integers, colors: Colors) -> bool:
        """Draw a mesh; if only its vertices moved, move them. Tell whether anything changed."""
        shown, before = (vertices, faces, colors), self._shown
        if before is not None and all(a is b for a, b in zip(shown, before, strict=True)):
            return False
        self._shown = shown
        if before is None or faces is not before[1]:
            self._build(vertices, faces, colors)
        return True

    @property
    def polydata(self) -> pv.PolyData:
        """The whole mesh as VTK holds it."""
        if self._shown is None or self._whole is None:
            return pv.PolyData()
        vertices, _, colors = self._shown
        self._whole.take(vertices, colors)
        polydata: pv.PolyData = self._whole.polydata
        return polydata

    def _build(self, vertices: Floats, faces: Integers, colors: Colors) -> None:
        self._whole, self._lighter = _Copy(vertices, faces, colors, self._lit), None
        self.actor = self._canvas.add_mesh(
            self._whole.polydata,
            name=self._name,
            scalars="color",
            rgb=True,
            lighting=self._lit,
            smooth_shading=False,
            ambient=0.15,
            diffuse=0.85,
            specular=0.0,
            copy_mesh=False,
            pickable=self._lit,
            reset_camera=False,
            render=False,
            show_scalar_bar=False,
        )
        if self._lit:
            self.actor.prop.interpolation = "Phong"
        clip_by(self.actor.mapper, self._clip)

    def _follow(self) -> None:
        """Give VTK what is to be drawn now."""
        if self._shown is None or self._whole is None or self.actor is None:
            return
        vertices, faces, colors = self._shown
        if self._canvas.is_slow and self._lighter is None:  # ready before a hand needs it
            part = MeshPart.of(vertices, faces, BOXES if self._lit else BOXES_OF_PLANE)
            self._lighter = _Copy(vertices, part.faces, colors, self._lit, part)
        lighter = self._lighter if self._canvas.is_light else None
        drawn = lighter or self._whole
        drawn.take(vertices, colors)
        if self.actor.mapper.GetInput() is not drawn.polydata:
            self.actor.mapper.SetInputData(drawn.polydata)

    def hide(self) -> None:
        """Remove the mesh from the scene."""
        if self.actor is not None:
            self._canvas.remove_actor(self.actor, reset_camera=False, render=False)
        self.actor = self._shown = self._whole = self._lighter = None

    def set_opacity(self, opacity: float) -> None:
        """Let through what is behind; at 0 the mesh is not drawn at all."""
        if self.actor is not None:
            self.actor.prop.opacity = opacity
            self.actor.visibility = opacity > 0

    def set_clip(self, plane: vtkPlane | None) -> None:
        """Draw only what lies where the plane's normal points to, or all."""
        self._clip = plane
        if self.actor is not None:
            clip_by(self.actor.mapper, plane)

    def bring_forward(self, steps: float) -> None:
        """Draw the mesh as if it were slightly nearer, over one at the same place."""
        if self.actor is not None:
            self.actor.mapper.SetResolveCoincidentTopologyToPolygonOffset()
            self.actor.mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(-steps, -steps)

    def let_shine_through(self) -> None:
        """Draw the mesh's outside over everything that is nearer, as if that were of glass."""
        if self.actor is not None:
            draw_in_front(self.actor.mapper)
            self.actor.prop.culling = "back"


class _Copy:
    """What VTK holds of a mesh: all of its vertices, or some of them with faces of their own."""

    def __init__(
        self,
        vertices: Floats,
        faces: Integers,
        colors: Colors,
        lit: bool,
        part: MeshPart | None = None,
    ) -> None:
        self._faces, self._part, self._lit = faces, part, lit
        self._vertices, self._colors = vertices, colors
        points: Any = self._kept(vertices).astype(np.float32)  # a copy: VTK writes through arrays
        triangles: Any = faces
        self.polydata = pv.PolyData.from_regular_faces(points, triangles)
        self.polydata.point_data["color"] = np.array(self._kept(colors))
        self.polydata.point_data.active_scalars_name = "color"
        if lit:
            normals: Any = self._normals()
            self.polydata.point_data.active_normals = normals

    def take(self, vertices: Floats, colors: Colors) -> None:
        """Take other places and colours, as far as they are others."""
        if vertices is not self._vertices:
            self._vertices = vertices
            put(self.polydata.points, self._kept(vertices))
            if self._lit:
                put(self.polydata.point_data.active_normals, self._normals())
            self.polydata.Modified()
        if colors is not self._colors:
            self._colors = colors
            put(self.polydata.point_data["color"], self._kept(colors))
            self.polydata.Modified()

    def _kept(self, values: NDArray[Any]) -> NDArray[Any]:
        return values if self._part is None else values[self._part.rows]

    def _normals(self) -> NDArray[np.float32]:
        """Return the normals of the whole mesh: the faces of a part lie too roughly."""
        part = self._part
        if part is None:
            return vertex_normals(np.asarray(self.polydata.points), self._faces)
        around = self._vertices[part.ring].astype(np.float32)
        return vertex_normals(around, part.ring_faces)[part.places]
