"""What is no whole fly brain is refused by the commands in one sentence, and nothing is written."""

import re
import time

import numpy as np
import pytest

from flyreg_core.brain_files import open_brain, read_brain, write_mesh
from flyreg_core.cli import BAD_INPUT, main
from flyreg_core.errors import InputError
from flyreg_core.isosurface import extract_surface
from flyreg_core.mesh import SurfaceMesh
from flyreg_core.pose import PoseParameters, find_frame
from flyreg_core.progress import ignore
from flyreg_core.solid import SolidParameters, close_solid, voxelize
from tests.shapes import box, sphere, torus

MOST_SECONDS = 20
PITCH = 6.0
RADII = np.array([300.0, 150.0, 90.0])


def drawn(depth):
    """Draw where a function of points is positive, in a box somewhat larger than a brain."""
    shape = np.ceil(2 * np.array([340.0, 170.0, 110.0]) / PITCH).astype(int)
    low = -PITCH * (shape - 1) / 2
    return extract_surface(depth(low + PITCH * np.stack(np.indices(shape), axis=-1)), low, PITCH)


def ellipsoid(points):
    return RADII.min() * (1 - np.linalg.norm(points / RADII, axis=-1))


def slab(points):
    return (RADII - np.abs(points)).min(axis=-1)


def with_tunnel(body):
    return lambda points: np.minimum(
        body(points), np.hypot(*np.moveaxis(points[..., :2], -1, 0)) - 20
    )


def two_rings(points):
    x, y, z = np.moveaxis(points, -1, 0)
    return 45 - np.hypot(np.hypot(np.abs(x) - 150, y) - 105, z)


def lumps(points):
    rng = np.random.default_rng(3)
    centers, sizes = rng.uniform(-0.8, 0.8, (9, 3)) * RADII, rng.uniform(40, 90, 9)
    return np.max(
        [
            size - np.linalg.norm(points - c, axis=-1)
            for c, size in zip(centers, sizes, strict=True)
        ],
        axis=0,
    )


def swollen(shape, radii):
    vertices, faces = shape
    return SurfaceMesh(vertices * radii, faces)


@pytest.fixture(scope="module")
def fcwb():
    """A brain, its frame, and its voxels with cracks closed."""
    raw = read_brain(open_brain("FCWB"))
    frame = find_frame(raw)
    return raw, frame, close_solid(voxelize(raw, frame, SolidParameters(), ignore), 1.5)


def part(fcwb, axis, side):
    """Half of a brain, closed where it is cut."""
    _, frame, solid = fcwb
    is_kept = (side * solid.coordinates(axis) > 0).reshape(
        [-1 if a == axis else 1 for a in range(3)]
    )
    mesh = extract_surface(np.where(solid.inside & is_kept, 1.0, -1.0), solid.origin, solid.pitch)
    return SurfaceMesh(frame.points(mesh.vertices), mesh.faces)


def torn(fcwb, axis, side):
    """Half of a brain, open where it is cut."""
    raw, frame, _ = fcwb
    is_kept = side * frame.coordinates(raw.vertices)[:, axis] > 0
    faces = raw.faces[is_kept[raw.faces].all(axis=1)]
    used, number = np.unique(faces, return_inverse=True)
    return SurfaceMesh(raw.vertices[used], number.reshape(-1, 3))


def without_tunnels(fcwb):
    """A brain as deep everywhere near its middle as it is beside its oesophagus."""
    _, frame, solid = fcwb
    field = np.where(solid.inside, 1.0, -1.0)
    near = np.linalg.norm(np.indices(field.shape).T * solid.pitch + solid.origin, axis=-1).T < 90
    deep = np.abs(solid.coordinates(2)) < 50
    filled = field.copy()
    filled[near & deep] = 1.0
    mesh = extract_surface(filled, solid.origin, solid.pitch)
    return SurfaceMesh(frame.points(mesh.vertices), mesh.faces)


NO_SIDES = "no direction that is clearly its left and right"
NO_FRONT = "the same turned round, without a front and a top"
STRANGE = "as a fly's brain, so it does not look like one"
FOREIGN = "where hardly any of a fly's brain does"
NO_TUNNEL = "has no tunnel, so there is no oesophagus|none of the .* tunnels"
SHAPES = {
    "a ball": (lambda _: SurfaceMesh(*sphere(250.0)), NO_SIDES),
    "a ring": (lambda _: SurfaceMesh(*torus()), NO_SIDES),
    "an oval ring": (lambda _: swollen(torus(200, 60), [1.4, 0.8, 1.0]), NO_FRONT),
    "an ellipsoid": (lambda _: swollen(sphere(1.0, 4), [300, 150, 125]), NO_FRONT),
    "an ellipsoid with a tunnel": (lambda _: drawn(with_tunnel(ellipsoid)), NO_FRONT),
    "a box": (lambda _: SurfaceMesh(*box()), NO_FRONT),
    "a box with a tunnel": (lambda _: drawn(with_tunnel(slab)), NO_FRONT),
    "two joined rings": (lambda _: drawn(two_rings), NO_FRONT),
    "lumps": (lambda _: drawn(lumps), f"{NO_SIDES}|{STRANGE}|{FOREIGN}|{NO_TUNNEL}"),
    "a left half, closed": (lambda brain: part(brain, 0, 1), f"{NO_SIDES}|{STRANGE}"),
    "a left half, open": (lambda brain: torn(brain, 0, 1), f"{NO_SIDES}|{STRANGE}|{FOREIGN}"),
    "a front half, closed": (lambda brain: part(brain, 2, -1), STRANGE),
    "a front half, open": (lambda brain: torn(brain, 2, -1), f"{STRANGE}|{FOREIGN}"),
    "a back half, closed": (lambda brain: part(brain, 2, 1), STRANGE),
    "an upper half, closed": (lambda brain: part(brain, 1, -1), STRANGE),
    "a brain without tunnels": (without_tunnels, NO_TUNNEL),
}


@pytest.fixture(scope="module", params=SHAPES)
def nonsense(request, fcwb, tmp_path_factory):
    """A file with a shape that is no brain, and what has to be said about it."""
    make, sentence = SHAPES[request.param]
    path = tmp_path_factory.mktemp("shape") / "shape.ply"
    write_mesh(path, make(fcwb), "um")
    return path, sentence


@pytest.mark.parametrize("command", ["prepare", "inspect"])
def test_what_is_no_brain_is_refused_soon_and_nothing_is_written(
    nonsense, command, tmp_path, capsys
):
    path, sentence = nonsense
    output = tmp_path / "out" / "brain.ply"
    started = time.process_time()
    options = ["-o", str(output)] if command == "prepare" else []
    assert main([command, str(path), "--unit", "um", *options]) == BAD_INPUT
    assert time.process_time() - started < MOST_SECONDS
    said = capsys.readouterr()
    assert said.out == ""
    assert len(said.err.splitlines()) == 1
    assert re.search(sentence, said.err)
    assert not output.parent.exists()


def test_a_shape_is_taken_for_a_brain_where_it_is_stated_how_it_lies():
    shape = SurfaceMesh(*box())
    with pytest.raises(InputError, match=NO_FRONT):
        find_frame(shape)
    assert (np.diag(find_frame(shape, PoseParameters("LVP")).axes) > 0.9).all()
