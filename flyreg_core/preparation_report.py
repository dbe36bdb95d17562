"""What scripts read of one brain: what an input is, and what its prepared main brain is."""

from __future__ import annotations

import numpy as np

from flyreg_core import topology
from flyreg_core.brain_files import input_facts
from flyreg_core.facts import Facts
from flyreg_core.frame import BrainFrame
from flyreg_core.handles import Handle
from flyreg_core.mesh import SurfaceMesh
from flyreg_core.progress import Report
from flyreg_core.project import BrainInput
from flyreg_core.simplify import Simplified
from flyreg_core.surface_distance import distances_to_surface
from flyreg_core.torus import ORIGINS, Torus

MOST_FILLINGS = 50
"""As many of the filled places are listed, the largest first."""


def inspect_report(brain: BrainInput, raw: SurfaceMesh, torus: Torus) -> Facts:
    """Return what an input is, and the handles found in its main brain."""
    open_edges, non_manifold = topology.count_open_and_non_manifold_edges(raw.faces)
    used = np.unique(raw.faces)
    components = len(np.unique(topology.component_of_vertex(raw.faces, len(raw.vertices))[used]))
    is_closed = topology.is_closed(raw.faces)
    return {
        "name": brain.name,
        "kind": brain.kind,
        **input_facts(brain),
        "unit": brain.unit,
        "unit_known_by": brain.unit_known_by,
        "vertices": len(raw.vertices),
        "faces": len(raw.faces),
        "components": components,
        "genus": topology.genus(raw.faces) if is_closed else None,
        "open_edges": open_edges,
        "non_manifold_edges": non_manifold,
        "extent_um": [float(length) for length in np.ptp(raw.vertices, axis=0)],
        "pose": pose_facts(torus.frame),
        "trim_um": {"right": torus.planes.right, "left": torus.planes.left},
        "handles": [handle_facts(handle) for handle in torus.handles],
    }


def pose_facts(frame: BrainFrame) -> Facts:
    """Return where a brain lies and which way its axes run."""
    left, ventral, posterior = (list(map(float, axis)) for axis in frame.axes)
    return {
        "center_um": list(map(float, frame.origin)),
        "left": left,
        "ventral": ventral,
        "posterior": posterior,
        "is_mirrored": frame.is_mirrored,
    }


def handle_facts(handle: Handle) -> Facts:
    """Return what is known of a tunnel through a brain."""
    return {
        "center_um": list(handle.center_um),
        "width_um": handle.width_um,
        "direction": list(handle.direction),
        "is_near_midline": handle.is_near_midline,
        "is_candidate": handle.is_candidate,
        "is_oesophagus": handle.is_oesophagus,
    }


def prepare_report(raw: SurfaceMesh, torus: Torus, simplified: Simplified, report: Report) -> Facts:
    """Return what a prepared main brain is, and how far it leaves the original surface."""
    surface = simplified.surface
    away = distances_to_surface(surface.vertices, raw, report)
    origin = torus.origin_of_vertex[torus.nearest_vertices(surface.vertices)]
    kept = away[origin == ORIGINS.index("original")]
    handle = torus.oesophagus
    return {
        "vertices": len(surface.vertices),
        "faces": len(surface.faces),
        "components": len(np.unique(topology.component_of_vertex(surface.faces))),
        "genus": topology.genus(surface.faces),
        "watertight": topology.is_closed(surface.faces),
        "diagonal_um": surface.diagonal,
        "deviation": {
            "mean_um": float(kept.mean()),
            "p99_um": float(np.percentile(kept, 99)),
            "max_um": float(kept.max()),
            "share_of_vertices": len(kept) / len(away),
            "untrimmed_mean_um": float(away[origin != ORIGINS.index("trimmed")].mean()),
        },
        "handle": {
            "center_um": list(handle.center_um),
            "width_um": handle.width_um,
            "chosen_by": torus.chosen_by,
            "is_guess": torus.is_guess,
        },
        "pose": pose_facts(torus.frame),
        "trim_um": {"right": torus.planes.right, "left": torus.planes.left},
        "filled_um3": torus.filled_um3,
        "drilled_um3": torus.drilled_um3,
        "fillings": [
            {"center_um": list(filling.center_um), "volume_um3": filling.volume_um3}
            for filling in torus.fillings[:MOST_FILLINGS]
        ],
        "vertices_by_origin": {
            name: int((origin == number).sum()) for number, name in enumerate(ORIGINS)
        },
        "simplified": simplified_facts(torus, simplified),
    }


def simplified_facts(torus: Torus, simplified: Simplified) -> Facts:
    """Return what simplifying cost a main brain."""
    return {
        "vertices_before": len(torus.surface.vertices),
        "vertices": len(simplified.surface.vertices),
        "mean_distance_um": simplified.mean_distance_um,
        "largest_distance_um": simplified.largest_distance_um,
        "area_share": simplified.area_share,
    }
