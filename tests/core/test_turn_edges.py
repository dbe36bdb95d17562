import numpy as np
import pytest

from flyreg_core import topology
from flyreg_core.cut import PIECES
from flyreg_core.landmarks import HALVES
from flyreg_core.orientation import face_orientations, signed_areas
from flyreg_core.turn_edges import find_diagonals, turn_edges


@pytest.fixture(scope="module", params=HALVES)
def flat_and_half(request, demo_target):
    return demo_target.flat, request.param


def diagonals_of(brain, name, origin):
    half = brain.halves[name]
    vertices = brain.dissection.surface.vertices[half.vertex_of]
    return find_diagonals(half, vertices, half.springs.edges, origin)


def apart(faces: np.ndarray) -> np.ndarray:
    """Rows none of which share a face."""
    seen: set[int] = set()
    rows = []
    for row, pair in enumerate(faces.tolist()):
        if seen.isdisjoint(pair):
            seen.update(pair)
            rows.append(row)
    return np.array(rows)


def number_of(pairs: np.ndarray, n: int) -> np.ndarray:
    """One number for each pair, whichever comes first."""
    return np.sort(pairs, axis=1) @ [n, 1]


def turned_loops(faces: np.ndarray) -> set[tuple[int, ...]]:
    """Faces, whichever corner they begin with."""
    return {tuple(np.roll(face, -face.argmin()).tolist()) for face in faces}


def test_edges_between_faces_that_were_two_are_not_turned(flat_and_half):
    brain, name = flat_and_half
    origin = np.arange(len(brain.halves[name].faces))
    assert len(diagonals_of(brain, name, origin).edge) == 0


def test_what_is_turned_covers_the_flat_half_once_and_is_held_as_before(flat_and_half):
    """As if the half were one face: where the two faces bend, only the flat map stays."""
    brain, name = flat_and_half
    before = brain.halves[name]
    found = diagonals_of(brain, name, np.zeros(len(before.faces)))
    chosen = found.some(apart(found.faces))
    assert len(chosen.edge) > 0.1 * len(before.faces)
    after = turn_edges(brain, name, chosen)
    half = after.halves[name]
    assert (face_orientations(half.flat) == 1).all()
    assert signed_areas(half.flat.corners).sum() == pytest.approx(1)
    assert topology.is_closed(after.dissection.surface.faces)
    of_half = after.dissection.surface.faces[after.dissection.piece_of_face == PIECES.index(name)]
    assert np.array_equal(half.vertex_of[half.faces], of_half)
    assert np.array_equal(half.springs.edges, topology.unique_edges(half.faces)[0])
    gone = before.springs.edges[chosen.edge]
    assert set(map(tuple, gone.tolist())).isdisjoint(map(tuple, half.springs.edges.tolist()))
    first, second = half.springs.edges.T
    along = half.flat.uv[second, 0] + half.springs.jumps - half.flat.uv[first, 0]
    assert np.abs(along).max() < 0.5


def test_edges_turned_twice_are_as_they_were(flat_and_half):
    brain, name = flat_and_half
    before = brain.halves[name]
    as_one = np.zeros(len(before.faces))
    found = diagonals_of(brain, name, as_one)
    chosen = found.some(apart(found.faces))
    back = diagonals_of(turn_edges(brain, name, chosen), name, as_one)
    pairs = [number_of(each.faces, len(as_one)) for each in (chosen, back)]
    returns = np.isin(pairs[0], pairs[1])
    assert returns.mean() > 0.95  # where two faces bend too much, they are no quadrilateral
    chosen = chosen.some(returns)
    once = turn_edges(brain, name, chosen)
    back = diagonals_of(once, name, as_one)
    rows = np.isin(number_of(back.faces, len(as_one)), number_of(chosen.faces, len(as_one)))
    twice = turn_edges(once, name, back.some(rows)).halves[name]
    assert turned_loops(twice.faces) == turned_loops(before.faces)
    for column in ("edges", "jumps", "weights"):
        assert np.array_equal(getattr(twice.springs, column), getattr(before.springs, column))
