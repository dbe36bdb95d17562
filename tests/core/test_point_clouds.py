"""Points become the surface they lie on, with or without normals."""

import igl
import numpy as np
import pytest

from flyreg_core.brain_files import input_facts, open_brain, read_brain
from flyreg_core.errors import Cancelled, InputError
from flyreg_core.surface_distance import sample_surface
from flyreg_core.topology import genus, is_closed
from tests.outer_surface import largest_part, outer_distances
from tests.shapes import torus

RADIUS, TUBE = 90.0, 35.0
COUNT = 10_000
TUNNEL = 5.0


def torus_points(count=COUNT, seed=0):
    """Return points spread evenly on a torus, and their outward normals."""
    rng = np.random.default_rng(seed)
    u, v, chance = rng.uniform(0, 1, (3, 2 * count)) * [[2 * np.pi], [2 * np.pi], [1]]
    kept = chance < (RADIUS + TUBE * np.cos(v)) / (RADIUS + TUBE)
    u, v = u[kept][:count], v[kept][:count]
    normals = np.column_stack([np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)])
    ring = RADIUS * np.column_stack([np.cos(u), np.sin(u), np.zeros_like(u)])
    return ring + TUBE * normals, normals


def torus_heights(points):
    """Return how far points are outside a torus."""
    ring = np.hypot(points[:, 0], points[:, 1]) - RADIUS
    return np.hypot(ring, points[:, 2]) - TUBE


def spacing(count=COUNT):
    return np.sqrt(4 * np.pi**2 * RADIUS * TUBE / count)


def body_with_tunnel(count=100_000):
    """Return points of an ellipsoid with a tunnel 10 um wide through it."""
    rng = np.random.default_rng(1)
    direction = rng.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    axes = np.array([200.0, 120.0, 50.0])
    area = np.linalg.norm(direction / axes, axis=1)
    body = axes * direction[rng.uniform(size=count) < area / area.max()]
    body = body[np.hypot(body[:, 0], body[:, 1]) > TUNNEL]
    turn, height = rng.uniform(0, 2 * np.pi, 900), rng.uniform(-50, 50, 900)
    wall = np.column_stack([TUNNEL * np.cos(turn), TUNNEL * np.sin(turn), height])
    return np.concatenate([body, wall])


def written(path, *columns, header="", separator=" "):
    np.savetxt(path, np.column_stack(columns), "%.5f", separator, header=header, comments="")
    return str(path)


def read(name, unit=None):
    return read_brain(open_brain(name, unit))


def check_torus(surface, tolerance):
    assert is_closed(surface.faces)
    assert genus(surface.faces) == 1
    assert np.percentile(np.abs(torus_heights(surface.vertices)), 99) < tolerance


# Surfaces


def outward(normals):
    return normals


def inward(normals):
    return -normals


def either(normals):
    return normals * np.random.default_rng(2).choice([-1, 1], (len(normals), 1))


def of_any_length(normals):
    return 7.5 * normals


@pytest.mark.parametrize("turned", [None, outward, inward, either, of_any_length])
def test_the_surface_lies_on_the_points_whatever_their_normals(tmp_path, turned):
    points, normals = torus_points()
    columns = [points] if turned is None else [points, turned(normals)]
    header = "x y z" if turned is None else "x y z nx ny nz"
    surface = read(written(tmp_path / "a.xyz", *columns, header=header))
    check_torus(surface, spacing() / 4)
    assert surface.volume == pytest.approx(2 * np.pi**2 * RADIUS * TUBE**2, rel=0.01)


def test_noise_is_evened_out(tmp_path):
    points, _ = torus_points()
    noise = np.random.default_rng(3).normal(scale=spacing() / 4, size=points.shape)
    check_torus(read(written(tmp_path / "a.xyz", points + noise)), spacing() / 2)


def test_a_tunnel_as_wide_as_the_oesophagus_stays_open(tmp_path):
    surface = read(written(tmp_path / "a.xyz", body_with_tunnel()))
    assert is_closed(surface.faces)
    assert genus(surface.faces) == 1
    width = 2 * np.hypot(*surface.vertices[:, :2].T).min()
    assert width == pytest.approx(2 * TUNNEL, abs=2)


@pytest.mark.parametrize("distance", [1.0, 4.0])
def test_contours_of_slices_are_enough(tmp_path, distance):
    heights = np.arange(-TUBE + distance / 2, TUBE, distance)
    contours = []
    for height in heights:
        for side in (-1, 1):
            ring = RADIUS + side * np.sqrt(TUBE**2 - height**2)
            turn = np.arange(0, 2 * np.pi, 2 / ring)
            contours.append([ring * np.cos(turn), ring * np.sin(turn), np.full(len(turn), height)])
    points = np.concatenate(contours, axis=1).T
    check_torus(read(written(tmp_path / "a.xyz", points)), max(distance, 2.0))


def test_the_order_of_the_points_does_not_matter(tmp_path):
    points, _ = torus_points()
    one = read(written(tmp_path / "a.xyz", points))
    other = read(written(tmp_path / "b.xyz", points[::-1]))
    assert outer_distances(one, other).max() < spacing() / 2


def test_stray_points_leave_the_surface_alone(tmp_path):
    points, _ = torus_points()
    stray = [[0.0, 0.0, 0.0], [150.0, 100.0, 40.0]]
    check_torus(read(written(tmp_path / "a.xyz", np.vstack([points, stray]))), spacing() / 4)


def test_repeated_points_count_once(tmp_path):
    points, _ = torus_points()
    check_torus(read(written(tmp_path / "a.xyz", np.vstack([points] * 3))), spacing() / 4)


@pytest.mark.parametrize("has_normals", [True, False])
def test_points_of_a_raw_template_give_its_outer_surface(tmp_path, has_normals):
    raw = read("FCWB")
    points = sample_surface(raw, 100_000)
    _, face, _ = igl.point_mesh_squared_distance(points, raw.vertices, raw.faces)
    columns = [points, raw.face_normals[face]] if has_normals else [points]
    header = "x y z nx ny nz" if has_normals else "x y z"
    surface = read(written(tmp_path / "a.xyz", *columns, header=header))
    distances = outer_distances(surface, largest_part(raw))
    # two voxels of the solid, but for a fold that hangs on single points
    assert np.quantile(distances, 0.999) < 10
    assert distances.mean() < 0.4


# Files


SEPARATED = [
    ("a.xyz", " ", ""),
    ("a.txt", "\t", "x\ty\tz"),
    ("a.csv", ",", "x,y,z"),
    ("a.csv", ",", '"X (um)","Y (um)","Z (um)"'),
    ("a.csv", ";", "X [um];Y [um];Z [um]"),
    ("a.csv", ", ", ""),
    ("a.pts", " ", str(COUNT)),
    ("a.asc", " ", "# made by hand\n// x y z\n"),
]


@pytest.mark.parametrize(("name", "separator", "header"), SEPARATED)
def test_points_may_be_parted_and_named_in_many_ways(tmp_path, name, separator, header):
    points, _ = torus_points()
    brain = open_brain(written(tmp_path / name, points, header=header, separator=separator))
    assert (brain.kind, brain.unit) == ("point cloud", "um")
    assert input_facts(brain) == {"points": COUNT, "has_normals": False}


def test_columns_are_found_by_their_names(tmp_path):
    points, normals = torus_points()
    columns = [np.arange(len(points)), normals, points[:, ::-1]]
    header = "id,nx,ny,nz,z,y,x"
    name = written(tmp_path / "a.csv", *columns, header=header, separator=",")
    assert input_facts(open_brain(name))["has_normals"]
    check_torus(read(name), spacing() / 4)


def test_further_columns_without_names_are_normals_only_if_their_length_is_1(tmp_path):
    points, normals = torus_points()
    with_normals = open_brain(written(tmp_path / "a.xyz", points, normals))
    with_colours = open_brain(written(tmp_path / "b.xyz", points, 200 * np.abs(normals)))
    assert input_facts(with_normals)["has_normals"]
    assert not input_facts(with_colours)["has_normals"]


@pytest.mark.parametrize("has_normals", [True, False])
def test_a_ply_file_without_faces_is_a_point_cloud(tmp_path, has_normals):
    points, normals = torus_points()
    columns = [points, normals] if has_normals else [points]
    names = ["x", "y", "z", "nx", "ny", "nz"][: 3 * len(columns)]
    lines = [f"property float {name}" for name in names]
    header = ["ply", "format ascii 1.0", "element vertex 10000", *lines, "end_header"]
    brain = open_brain(written(tmp_path / "a.ply", *columns, header="\n".join(header)))
    assert brain.kind == "point cloud"
    assert input_facts(brain) == {"points": COUNT, "has_normals": has_normals}
    check_torus(read_brain(brain), spacing() / 4)


def test_points_are_read_in_micrometres(tmp_path):
    points, _ = torus_points()
    name = written(tmp_path / "a.xyz", 1000 * points)
    assert open_brain(name).unit == "nm"
    check_torus(read(name), spacing() / 4)


def test_a_surface_has_no_further_facts():
    assert input_facts(open_brain("FCWB")) == {}


# Bad input, one sentence each


def refused(tmp_path, text):
    path = tmp_path / "a.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(InputError) as caught:
        read(str(path))
    return str(caught.value)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (b"\x00\x01\x02", "is not text, so its points cannot be read"),
        ("x,y,z\n", "has no points; export it again"),
        ("# nothing\n", "has no points; export it again"),
        ("1,2,3\n4,5\n", "line 2: '4,5' is not 3 numbers as in the first line"),
        ("x,y,z\n1,2,3\n4,five,6\n", "line 3: '4,five,6' is not 3 numbers"),
        ("1,2,3\n4,,6\n", "line 2: '4,,6' is not 3 numbers"),
        ("x,y\n1,2\n", "has the columns x, y; the columns x, y and z are needed"),
        ("x,y,z\n1,2,3,4\n", "names 3 columns and has 4; correct its first line"),
        ("1,2\n3,4\n", "has 2 numbers per line; x, y and z are needed"),
        ("1,2,3\n1,2,nan\n", "1 of 2 points have coordinates that are infinite or no numbers"),
        ("1,2,3\n4,5,6\n", "only 2 points, too few for a surface; give at least 1,000"),
    ],
)
def test_bad_text_is_named(tmp_path, text, sentence):
    assert sentence in refused(tmp_path, text)


def test_too_few_distinct_points_are_counted(tmp_path):
    points = np.tile(torus_points(500)[0], (10, 1))
    with pytest.raises(InputError, match=r"the 5,000 points are too few .*: \d+ are left where"):
        read(written(tmp_path / "a.xyz", points))


def test_points_that_fill_the_brain_are_no_surface(tmp_path):
    inside = np.random.default_rng(4).uniform(-1, 1, (20_000, 3)) * [280, 130, 70]
    with pytest.raises(InputError, match=r"a\.xyz cannot be used: the points fill space instead"):
        read(written(tmp_path / "a.xyz", inside))


def test_a_flat_sheet_encloses_nothing(tmp_path):
    sheet = np.random.default_rng(4).uniform(-1, 1, (20_000, 3)) * [280, 130, 0]
    with pytest.raises(InputError, match="the points enclose nothing; give points from all"):
        read(written(tmp_path / "a.xyz", sheet))


def test_two_brains_of_points_are_refused(tmp_path):
    points, _ = torus_points()
    with pytest.raises(InputError, match="holds two brains or halves of one, centred at"):
        read(written(tmp_path / "a.xyz", np.vstack([points, points + np.array([600, 0, 0])])))


def test_reading_can_be_cancelled(tmp_path):
    points, _ = torus_points()
    brain = open_brain(written(tmp_path / "a.xyz", points))

    def cancel(fraction, text):
        if fraction > 0.5:
            raise Cancelled

    with pytest.raises(Cancelled):
        read_brain(brain, cancel)


def test_mesh_vertices_alone_give_the_mesh_again(tmp_path):
    vertices, _ = torus(RADIUS, TUBE, 200, 100)
    check_torus(read(written(tmp_path / "a.xyz", vertices)), spacing() / 4)
