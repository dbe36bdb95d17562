"""What scripts read: the facts of each command as one JSON object."""

from __future__ import annotations

import io
import math
import platform
import sys
from collections.abc import Mapping
from dataclasses import asdict
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flyreg_core import topology
from flyreg_core.alignment import Alignment
from flyreg_core.brain_files import voxel_edge_um, write_mesh
from flyreg_core.facts import Facts
from flyreg_core.files import write_atomically
from flyreg_core.judgement import Judgement
from flyreg_core.landmarks import HALVES
from flyreg_core.mesh import FlatMesh
from flyreg_core.orientation import orientations, signed_areas
from flyreg_core.preparation_report import handle_facts, pose_facts, simplified_facts
from flyreg_core.project import Project
from flyreg_core.results import PreparedBrain, Results
from flyreg_core.seam import AlongCurve, examine_seam
from flyreg_core.surface_distance import (
    PERCENTILES,
    Distances,
    DistanceSummary,
)
from flyreg_core.vertex_properties import vertex_status, weight_influence

LIBRARIES = ("flyreg", "numpy", "scipy", "numba", "libigl", "manifold3d", "trimesh")


def register_report(results: Results) -> Facts:
    """Return what a registration did, without times and memory."""
    project = results.project
    judgement = results.judgement
    origins = [mark.pair.origin for mark in results.landmarks]
    return {
        "source": _brain(results.source),
        "target": _brain(results.target),
        "alignment": _alignment(results.alignment),
        "halves": {half: _half(results, half) for half in HALVES},
        "seam": _seam(results),
        "flipped_on_caps": results.registration.flipped_on_caps,
        "watertight": topology.is_closed(results.registration.surface.faces),
        "landmarks": {
            "boundary": origins.count("boundary"),
            "automatic": origins.count("suggested"),
            "user": origins.count("user"),
        },
        "landmark_list": _landmarks(results),
        "folds_by_landmark": dict(judgement.folds_by_landmark) if judgement else None,
        "there_and_back_um": _there_and_back(judgement),
        "displacement_beyond_affine": _displacement(results),
        "smoothing": project.smoothing,
        "smoothing_by_cross_validation": _cross_validation(judgement, project.smoothing),
        "residual_against_bending": _trade_off(judgement, project.smoothing),
        "pairing": project.boundary.pairing,
        "parameters": _parameters(project),
        "warnings": list(results.warnings),
        "distance": distance_report(
            *(results.distances, "source_to_target", "target_to_source"),
            voxel_edge_um(project.target.input),
        )
        if results.distances
        else None,
        "versions": versions(),
    }


def _there_and_back(judgement: Judgement | None) -> Facts | None:
    """Return by how much registering back, with the same pairs, misses where vertices came from."""
    if judgement is None or len(judgement.there_and_back_um) == 0:
        return None
    away = judgement.there_and_back_um
    return {
        "mean": float(away.mean()),
        "p95": float(np.percentile(away, 95)),
        "max": float(away.max()),
    }


def _displacement(results: Results) -> Facts:
    """Return how far registration took vertices from where the affine alignment had put them."""
    moved = results.beyond_alignment_um
    shares = {f"p{share}_um": float(np.percentile(moved, share)) for share in PERCENTILES}
    return {"mean_um": float(moved.mean()), **shares, "max_um": float(moved.max())}


def _parameters(project: Project) -> Facts:
    """Return all that the user can set, but for inputs and landmarks, as the project has it."""
    brains = {"source": project.source, "target": project.target}
    return {
        **{
            role: {name: value for name, value in asdict(brain).items() if name != "input"}
            for role, brain in brains.items()
        },
        "boundary": asdict(project.boundary),
    }


def _alignment(alignment: Alignment) -> Facts:
    return {
        "matrix": [list(map(float, row)) for row in alignment.to_target.matrix],
        "offset_um": list(map(float, alignment.to_target.offset)),
        "residual_um": alignment.residual_um,
        "is_mirrored": alignment.is_mirrored,
        "is_sure": alignment.is_sure,
        "is_side_sure": alignment.is_side_sure,
        "candidates": [
            {"signs": list(candidate.signs), "misfit_um": candidate.misfit_um}
            for candidate in alignment.candidates
        ],
    }


def _brain(prepared: PreparedBrain) -> Facts:
    brain = prepared.brain.input
    return {
        "name": brain.name,
        "sha256": brain.sha256,
        "unit": brain.unit,
        "unit_known_by": brain.unit_known_by,
        "vertices": len(prepared.surface.vertices),
        "simplified": simplified_facts(prepared.torus, prepared.simplified),
        "pose": pose_facts(prepared.frame),
        "trim_um": {"right": prepared.torus.planes.right, "left": prepared.torus.planes.left},
        "oesophagus": handle_facts(prepared.torus.oesophagus),
    }


def _half(results: Results, half: str) -> Facts:
    flat, warped = results.source.halves[half], results.registration.halves[half]  # type: ignore[index]
    return {
        "triangles": len(flat.faces),
        "flipped_before_spline": int((orientations(flat.flat.corners) <= 0).sum()),
        "flipped_by_spline_and_mended": warped.folds_mended,
        "flipped_after_spline": warped.flipped,
        "gap_um": warped.gap_um,
        "certificate": _certificate(warped.flat),
    }


def _seam(results: Results) -> Facts:
    seam = examine_seam(results)

    def summary(values: AlongCurve, unit: str) -> Facts:
        return {
            f"mean_{unit}": values.mean,
            f"p95_{unit}": values.p95,
            f"max_{unit}": values.largest,
        }

    return {
        "angle": {
            "registered": summary(seam.registered_degrees, "degrees"),
            "target": summary(seam.target_degrees, "degrees"),
        },
        "hole_curve": {
            "source_to_target": summary(seam.hole_to_target_um, "um"),
            "target_to_source": summary(seam.hole_from_target_um, "um"),
        },
    }


def _certificate(flat: FlatMesh) -> Facts:
    """Return what shows that a strip is laid out once and without folds.

    No face is flipped, and together they have the area of the strip: so nothing overlaps.
    """
    areas = signed_areas(flat.corners)
    return {
        "not_positive": int((orientations(flat.corners) <= 0).sum()),  # exact, not by the areas
        "smallest_signed_area": float(areas.min()),
        "sum_of_signed_areas": math.fsum(areas),
        "area_of_the_strip": 1.0,
    }


def _landmarks(results: Results) -> list[Facts]:
    judgement = results.judgement
    foretold = judgement.leave_one_out_um if judgement else {}
    leverage = judgement.leverage if judgement else {}
    residual = results.registration.residual_um
    return [
        {
            "id": mark.pair.id,
            "name": mark.pair.name,
            "kind": mark.pair.kind,
            "origin": mark.pair.origin,
            "weight": mark.pair.weight,
            "is_muted": mark.is_muted,
            "residual_um": residual.get(mark.pair.id),
            "leave_one_out_um": foretold.get(mark.pair.id),
            "leverage": leverage.get(mark.pair.id),
        }
        for mark in results.landmarks
    ]


def _cross_validation(judgement: Judgement | None, smoothing: float) -> Facts | None:
    if judgement is None:
        return None
    curve = judgement.cross_validation
    return {
        "best": curve.best,
        "suggested": curve.advise(smoothing).smoothing,
        "smoothings": [float(value) for value in curve.smoothings],
        "scores": [float(value) for value in curve.scores],
    }


def _trade_off(judgement: Judgement | None, smoothing: float) -> Facts | None:
    """Return what the landmarks' residual costs in bending energy, at lambda and at all others."""
    if judgement is None:
        return None
    curve = judgement.trade_off
    residual, energy = curve.at(smoothing)
    return {
        "residual_rms_um": residual,
        "bending_energy": energy,
        "smoothings": [float(value) for value in curve.smoothings],
        "residuals_rms_um": [float(value) for value in curve.residuals_um],
        "bending_energies": [float(value) for value in curve.energies],
    }


def write_flat(path: Path, results: Results) -> None:
    """Write the flat halves before and after the spline, from which others can tell folds."""
    arrays: dict[str, NDArray[Any]] = {}
    for half in HALVES:
        before, after = results.source.halves[half].flat, results.registration.halves[half].flat
        arrays |= {
            f"{half}_source_uv": before.uv,
            f"{half}_registered_uv": after.uv,
            f"{half}_faces": after.faces.astype(np.int32),
            f"{half}_corner_shifts": after.corner_shifts.astype(np.int8),
        }
    content = io.BytesIO()
    np.savez(content, **arrays)  # type: ignore[arg-type]  # packing places saves a third, in 0.4 s
    write_atomically(path, content.getvalue())


def distance_report(
    distances: Distances, first: str, second: str, voxel_edge_um: float | None = None
) -> Facts:
    """Return distances both ways under the names of the two directions.

    Where a voxel's size is known, also in edges of a cube as large as a voxel.
    """
    shared = distances.diagonal_um, voxel_edge_um
    return {
        "diagonal_um": distances.diagonal_um,
        "voxel_edge_um": voxel_edge_um,
        "samples": distances.samples,
        first: _summary(distances.a_to_b, *shared),
        second: _summary(distances.b_to_a, *shared),
    }


def _summary(summary: DistanceSummary, diagonal_um: float, voxel_edge_um: float | None) -> Facts:
    lengths = {
        "mean": summary.mean_um,
        "rms": summary.rms_um,
        "hausdorff": summary.hausdorff_um,
        **{
            f"p{percent}": value
            for percent, value in zip(PERCENTILES, summary.percentiles_um, strict=True)
        },
        "standard_error": summary.standard_error_um,
    }
    facts: Facts = {f"{name}_um": value for name, value in lengths.items()}
    facts |= {f"{name}_share_of_diagonal": value / diagonal_um for name, value in lengths.items()}
    if voxel_edge_um is not None:
        facts |= {f"{name}_voxels": value / voxel_edge_um for name, value in lengths.items()}
    return facts


def versions() -> Mapping[str, str]:
    """Return the versions of the program, Python and the libraries that decide the numbers."""
    found = {"python": platform.python_version(), "platform": sys.platform}
    for library in LIBRARIES:
        try:
            found[library] = metadata.version(library)
        except metadata.PackageNotFoundError:
            found[library] = "unknown"
    return found


def write_registered(path: Path, results: Results) -> None:
    """Write the registered mesh, in the target's unit and frame, with its properties."""
    properties = {
        "displacement_um": np.linalg.norm(
            results.registration.surface.vertices - results.source.surface.vertices, axis=1
        ),
        "weight_influence": weight_influence(results),
        "status": vertex_status(results),
    }
    unit = results.project.target.input.unit
    write_mesh(path, results.registration.surface, unit, properties)
