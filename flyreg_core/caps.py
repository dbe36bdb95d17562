"""The caps that the trim planes left: carried from rim to rim, each a disk onto a disk."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import SuperLU

from flyreg_core.boundary import Curve, CurveKey
from flyreg_core.cut import Dissection
from flyreg_core.flatten import Springs, factorized, mean_matrix
from flyreg_core.landmarks import CurveName
from flyreg_core.locate import TriangleGrid, build_grid, find_triangles
from flyreg_core.mesh import Floats, Integers
from flyreg_core.orientation import orientations
from flyreg_core.refine import AddedVertices
from flyreg_core.topology import compacted, unique_edges

ACROSS = 1e-3
"""Weight of a spring across a face that was divided, against 1 of its sides."""
CENTER, RADIUS = np.array([0.5, 0.0]), 0.25
"""Of the circle on which rims are laid flat."""


@dataclass(frozen=True, eq=False)
class Cap:
    """One cap: its vertices in the whole surface, and its rim in the order of the two curves."""

    side: CurveName  # left or right
    vertex_of: Integers  # (k,)
    faces: Integers  # (m, 3), own numbers
    springs: Springs
    rim: Integers  # (b,), own numbers, along the anterior half's curve and back along the posterior's

    @cached_property
    def means(self) -> tuple[Integers, SuperLU, sparse.csr_array]:
        """The inner vertices, and what makes them means of their neighbours, solved for once."""
        means, _ = mean_matrix(self.springs, len(self.vertex_of))
        inner = np.setdiff1d(np.arange(len(self.vertex_of)), self.rim)
        rows = means[inner]
        system = sparse.eye_array(len(inner)) - rows[:, inner]
        return inner, factorized(system.tocsc()), rows[:, self.rim]


@dataclass(frozen=True, eq=False)
class CarriedCap:
    """A cap of the source on the target's, laid flat."""

    flat: Floats  # (k, 2)
    face: Integers  # (k,), of the target's cap, where each vertex lies
    flipped: int  # faces flipped, decided exactly


def find_caps(
    dissection: Dissection, curves: Mapping[CurveKey, Curve], added: AddedVertices | None = None
) -> tuple[Cap, Cap]:
    """Return the right and the left cap.

    Parameters
    ----------
    added : AddedVertices, optional
        They leave the rest where it lies flat, and lie there on their edges, as far along as on the
        surface, but for a thousandth.
    """
    caps = []
    for side in ("right", "left"):
        faces, vertex_of = compacted(dissection.faces_of(f"{side} cap"))
        rim = _around(side, {key: curve.vertices for key, curve in curves.items()})
        edges, _ = unique_edges(faces)
        weights = np.ones(len(edges))
        if added is not None:
            weights = _weights(vertex_of[edges], len(dissection.surface.vertices), added)
        springs = Springs(edges, np.zeros(len(edges), dtype=np.int64), weights)
        caps.append(Cap(side, vertex_of, faces, springs, np.searchsorted(vertex_of, rim)))
    return caps[0], caps[1]


def _weights(edges: Integers, n_vertices: int, added: AddedVertices) -> Floats:
    """Return (e,) how strong the springs along edges are if those of whole edges are 1."""
    weights = np.ones(len(edges))
    low, high = edges.T.copy()
    first = n_vertices - len(added)
    while len(new := np.flatnonzero(high >= first)):
        number = high[new] - first
        weights[new] *= added.stiffening(number, low[new], ACROSS)
        low[new], high[new] = added.ends[number].T
    return weights


def lay_cap_flat(cap: Cap, rim_places: Floats) -> Floats:
    """Return (k, 2) places with the rim at (b, 2) places on a convex curve, the rest means (Tutte)."""
    inner, solver, pull = cap.means
    flat = np.zeros((len(cap.vertex_of), 2))
    flat[cap.rim] = rim_places
    flat[inner] = solver.solve(pull @ rim_places)
    return flat


def rim_circle(side: CurveName, curves: Mapping[CurveKey, Curve]) -> Floats:
    """Return the (b, 2) places of a rim on a circle, anterior and posterior half a turn each.

    The circle is run through so that faces keep their orientation. It lies within one turn of a
    strip, so that what finds places on strips finds them on caps.
    """
    anterior, posterior = (np.pi * curves[side, half].share for half in ("anterior", "posterior"))
    angle = np.concatenate([anterior[:-1], 2 * np.pi - posterior[::-1][:-1]])
    turn = 1 if side == "left" else -1
    return CENTER + RADIUS * np.stack([np.cos(angle), turn * np.sin(angle)], axis=1)


def rim_places(
    side: CurveName, mapped: Mapping[CurveKey, Floats], target_curves: Mapping[CurveKey, Curve]
) -> Floats:
    """Return the (b, 2) places of a rim whose vertices go to shares of the target's, laid flat there."""
    rim = []
    for half in ("anterior", "posterior"):
        angle = np.pi * target_curves[side, half].share
        on_circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        share = mapped[side, half]
        rim.append(
            np.stack(
                [
                    np.interp(share, target_curves[side, half].share, on_circle[:, i])
                    for i in (0, 1)
                ],
                axis=1,
            )
        )
    turn = 1 if side == "left" else -1
    around = np.concatenate([rim[0][:-1], (rim[1] * [1, -1])[::-1][:-1]])
    return np.asarray(CENTER + RADIUS * around * [1, turn])


def cap_grid(cap: Cap, flat: Floats) -> TriangleGrid:
    """Return the locator of a cap laid flat."""
    return build_grid(flat[cap.faces], np.arange(len(cap.faces)), cap.faces)


def carry_cap(
    cap: Cap,
    mapped: Mapping[CurveKey, Floats],
    target_curves: Mapping[CurveKey, Curve],
    target_grid: TriangleGrid,
    target_corners: Floats,
    near: Integers | None = None,
) -> tuple[Floats, CarriedCap]:
    """Return where a cap's vertices go on the target's cap, as (k, 3) points and laid flat.

    Parameters
    ----------
    mapped : curve -> target shares
        Where the rim goes; the rest follows by Tutte, so that nothing folds.
    target_corners : (m, 3, 3) float
        Of the faces of the target's cap, on the surface.
    near : (k,) int, optional
        Faces of the target's cap in which vertices are looked for first.
    """
    flat = lay_cap_flat(cap, rim_places(cap.side, mapped, target_curves))
    face, barycentric = find_triangles(target_grid, flat, near)
    points = np.einsum("ij,ijk->ik", barycentric, target_corners[face])
    flipped = int((orientations(flat[cap.faces]) <= 0).sum())
    return points, CarriedCap(flat, face, flipped)


def _around(side: CurveName, values: Mapping[CurveKey, Integers]) -> Integers:
    anterior, posterior = values[side, "anterior"], values[side, "posterior"]
    return np.concatenate([anterior[:-1], posterior[::-1][:-1]])
