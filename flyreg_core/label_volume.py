"""The surface around all labelled voxels of a volume, fine or coarse, anisotropic or oblique."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from flyreg_core.errors import MeshError
from flyreg_core.isosurface import extract_surface
from flyreg_core.mesh import Booleans, Floats, SurfaceMesh
from flyreg_core.progress import Report, within
from flyreg_core.volume_formats import VolumeHeader

BLOCK_UM = 2.0
"""Edge of the blocks that fine voxels are averaged over: a voxel of the solid has 2 to 5 um."""
MOST_BLOCKS = 12_000_000
BLUR, BLUR_OF_SINGLE = 0.5, 1.0
"""Standard deviation of the Gaussian that takes the steps away, in blocks; in voxels that were not
averaged, which have no values between 0 and 1."""
MARGIN = 3
"""Layers of empty blocks around the volume."""
SAMPLED_SLICES = 24
FEWEST_EQUAL = 0.6
"""Least share of neighbouring bright voxels with equal values: labels have 0.9, images below 0.3."""


def label_surface(labels: NDArray[Any], header: VolumeHeader, report: Report) -> SurfaceMesh:
    """Return the surface around all voxels with a label above 0.

    Parameters
    ----------
    labels : (nk, nj, ni) number
        One label per voxel, the first axis of the header last.
    header : VolumeHeader
        In micrometres.

    Returns
    -------
    SurfaceMesh
        Closed; its faces are counter-clockwise seen from outside if the axes are right-handed.

    Raises
    ------
    MeshError
        No voxel has a label, all have one, or the values are those of a picture and not labels.

    Notes
    -----
    The labelled share of each block of voxels is contoured at one half, so that a smooth brain stays
    smooth although each voxel is in or out. Memory beyond that of the labels: a few numbers for
    each block.
    """
    report(0.0, "checking the labels")
    _check_labels(labels)
    factors = _factors(header)
    share = _labelled_share(labels, factors[::-1], within(report, 0.1, 0.6))
    report(0.6, "finding the surface of the labels")
    padded = np.pad(share.transpose(), MARGIN)
    blur = [BLUR if factor > 1 else BLUR_OF_SINGLE for factor in factors]
    field = scipy.ndimage.gaussian_filter(padded, blur, truncate=3.0, mode="constant") - 0.5
    if not (field > 0).any():
        raise MeshError("the labelled voxels are too few and scattered for a surface")
    blocks = extract_surface(field, np.full(3, -float(MARGIN)), 1.0)
    steps = blocks.vertices * factors + (np.array(factors) - 1) / 2
    return SurfaceMesh(header.origin + steps @ header.axes.T, blocks.faces)


def _factors(header: VolumeHeader) -> tuple[int, int, int]:
    """Return how many voxels along each axis make a block."""
    voxel = header.voxel_size
    volume = voxel.prod() * np.prod(header.shape)
    edge = max(BLOCK_UM, float(np.cbrt(volume / MOST_BLOCKS)))
    i, j, k = (max(1, round(edge / float(size))) for size in voxel)
    return i, j, k


def _labelled_share(labels: NDArray[Any], factors: tuple[int, ...], report: Report) -> Floats:
    """Return the share of voxels above 0 in each block; beyond the volume's end there are none."""
    thickness, *in_plane = factors
    shape = [-(-n // factor) for n, factor in zip(labels.shape, factors, strict=True)]
    share = np.zeros(shape)
    padding = [
        (0, n * factor - length)
        for n, factor, length in zip(shape[1:], in_plane, labels.shape[1:], strict=True)
    ]
    for layer in range(shape[0]):
        report(layer / shape[0], "finding the labelled voxels")
        slab = labels[layer * thickness : (layer + 1) * thickness] > 0
        counts = np.pad(slab.sum(axis=0, dtype=np.uint32), padding)
        blocks = counts.reshape(shape[1], in_plane[0], shape[2], in_plane[1])
        share[layer] = blocks.sum(axis=1).sum(axis=2)
    if not share.any():
        raise MeshError("no voxel has a label above 0; save the segmentation, not an empty image")
    if share.sum() == labels.size:
        raise MeshError("every voxel has a label above 0; give what is not brain the label 0")
    return share / np.prod(factors)


def _check_labels(labels: NDArray[Any]) -> None:
    """Tell a picture by neighbours that differ; within labels they are nearly all equal."""
    slices = np.unique(np.linspace(0, len(labels) - 1, SAMPLED_SLICES).astype(int))
    sample = np.asarray(labels[slices])
    if sample.dtype.kind == "f" and not np.isfinite(sample).all():
        raise MeshError("some voxels have values that are infinite or no numbers; export it again")
    both: Booleans = (sample[..., 1:] > 0) & (sample[..., :-1] > 0)
    pairs = int(both.sum())
    equal = int((both & (sample[..., 1:] == sample[..., :-1])).sum())
    if pairs and equal < FEWEST_EQUAL * pairs:
        raise MeshError(
            f"it is a grey-value image and not labels: only {equal / pairs:.0%} of neighbouring "
            "voxels have the same value; segment the brain first and save the labels"
        )
