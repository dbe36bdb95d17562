"""The paper's Figure 11: what each method makes of the source, all seen from the same place."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from PIL import Image, ImageDraw

from flyreg_core.color_maps import SOURCE, TARGET
from flyreg_core.comparison import TITLES, Comparison
from flyreg_core.picture import Picture, axes_of, draw_surface, on_background, view_of

SIZE = (640, 480)
"""Width and height of one picture, pixels."""
ACROSS = 4
"""Pictures beside each other on the sheet."""
LABEL_PLACE, LABEL_SIZE, LABEL_COLOR = (12, 8), 22, (40, 40, 40)
NAME_OF_TARGET = "target"
PICTURE_TITLES = {**TITLES, NAME_OF_TARGET: "Target"}


def draw_methods(comparison: Comparison) -> dict[str, Picture]:
    """Return pictures by method, see `draw_surface`, and one of the target under its name.

    From the front of the target, at the scale at which the target and all moved sources fit.
    """
    surfaces = {row.method: row.surface for row in comparison.rows if row.surface is not None}
    shown = np.concatenate([each.vertices for each in (comparison.target, *surfaces.values())])
    view = view_of(shown, axes_of(comparison.frame, "front"), SIZE)
    pictures = {NAME_OF_TARGET: draw_surface(comparison.target, TARGET, view, SIZE)}
    for method, surface in surfaces.items():
        pictures[method] = draw_surface(surface, SOURCE, view, SIZE)
    return pictures


def on_one_sheet(pictures: Mapping[str, Picture]) -> Picture:
    """Return all pictures on one white one of (height, width, 3) bytes, each with its title."""
    down = -(-len(pictures) // ACROSS)
    sheet = Image.new("RGB", (ACROSS * SIZE[0], down * SIZE[1]), "white")
    pen = ImageDraw.Draw(sheet)
    for number, (name, picture) in enumerate(pictures.items()):
        left, top = number % ACROSS * SIZE[0], number // ACROSS * SIZE[1]
        sheet.paste(Image.fromarray(on_background(picture)), (left, top))
        place = (left + LABEL_PLACE[0], top + LABEL_PLACE[1])
        pen.text(place, PICTURE_TITLES[name], fill=LABEL_COLOR, font_size=LABEL_SIZE)
    return np.asarray(sheet)
