"""Stage 4a: where the cut between the halves should run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from flyreg_core.frame import ANTERO_POSTERIOR, LEFT_RIGHT
from flyreg_core.mesh import Booleans, Floats
from flyreg_core.torus import Torus

SECTION = 2.0
"""Thickness of the sections across the left-right axis, voxels."""
SECTION_BLUR = 2.0
"""Blur over neighbouring sections, sections, so that the cut has no steps."""
SECTION_MARGIN = 0.3
"""Share of a section's depth that the cut leaves before and behind it."""


@dataclass(frozen=True)
class CutParameters:
    """How far behind the automatic place the halves are divided, micrometres."""

    shift_um: float = 0.0


def find_cut_knots(torus: Torus, smoothed: Floats, openings: tuple[Booleans, Booleans]) -> Floats:
    """Return the left-right and antero-posterior place of the cut at three places.

    Parameters
    ----------
    smoothed : (n, 3) float
        The vertices after smoothing.
    openings : two (n,) bool
        Which of them lie in the right and in the left trim opening.

    Returns
    -------
    (3, 2) float
        In the middles of the right opening, of the section at the midplane, of the left opening.
    """
    places = torus.frame.coordinates(smoothed)
    right, left = (places[o].mean(axis=0)[[LEFT_RIGHT, ANTERO_POSTERIOR]] for o in openings)
    is_middle = np.abs(places[:, LEFT_RIGHT]) <= SECTION * torus.pitch
    if not is_middle.any():
        is_middle = np.ones(len(places), dtype=bool)
    depth = places[is_middle, ANTERO_POSTERIOR]
    middle = np.array([0.0, (depth.min() + depth.max()) / 2])
    return np.stack([right, middle, left])


def height_over_cut(torus: Torus, smoothed: Floats, knots: Floats) -> Floats:
    """Return (n,) how far behind the cut each smoothed vertex lies, micrometres.

    The cut runs straight between its knots (3.1 B of the paper halves the bounding box, which
    misses a trim opening in some brains), but in the middle part of each section.
    """
    places = torus.frame.coordinates(smoothed)
    straight = np.interp(places[:, LEFT_RIGHT], *knots.T)
    cut = _inside_sections(places, straight, torus.pitch)
    return np.asarray(places[:, ANTERO_POSTERIOR] - cut)


def _inside_sections(places: Floats, cut: Floats, pitch: float) -> Floats:
    """Return the places of the cut, moved into the middle part of the section they lie in."""
    x, depth = places[:, LEFT_RIGHT], places[:, ANTERO_POSTERIOR]
    section = np.floor((x - x.min()) / (SECTION * pitch)).astype(int)
    count = int(section.max()) + 1
    low, high = np.full(count, np.inf), np.full(count, -np.inf)
    np.minimum.at(low, section, depth)
    np.maximum.at(high, section, depth)
    margin = SECTION_MARGIN * (high - low)
    middles = x.min() + SECTION * pitch * (np.arange(count) + 0.5)
    front, back = (
        np.interp(x, middles, scipy.ndimage.gaussian_filter1d(end, SECTION_BLUR, mode="nearest"))
        for end in (low + margin, high - margin)
    )
    return np.asarray(np.clip(cut, front, back))
