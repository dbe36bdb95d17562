"""A brain is prepared the same whether its file holds a surface, points on it, or labels of it."""

import igl
import nrrd
import numpy as np
import pytest

from flyreg_core.brain_files import open_brain, read_brain
from flyreg_core.surface_distance import sample_surface
from tests.core.test_amira_surface import single
from tests.moved import as_torus, vertices_apart

POINTS = 100_000
VOXEL = np.array([0.35, 0.35, 1.0])
MARGIN = 5.0
SAME = 2.0  # voxels
FORMS = ("Amira surface", "points with normals", "points alone", "label volume")


@pytest.fixture(scope="module")
def original():
    """FCWB as it was read, and as a torus."""
    raw = read_brain(open_brain("FCWB"))
    return raw, as_torus(raw)


@pytest.fixture(scope="module", params=FORMS)
def form(request):
    """What kind of file it is given as."""
    return request.param


@pytest.fixture(scope="module")
def again(form, original, tmp_path_factory):
    """The torus it becomes when it is given in another form."""
    write = {
        "Amira surface": amira_surface,
        "points with normals": points_with_normals,
        "points alone": points_alone,
        "label volume": label_volume,
    }[form]
    return as_torus(read_brain(open_brain(write(tmp_path_factory.mktemp("form"), original[0]))))


def amira_surface(folder, raw):
    (folder / "a.surf").write_bytes(single(raw.vertices, raw.faces, "BINARY"))
    return str(folder / "a.surf")


def points_alone(folder, raw):
    points = sample_surface(raw, POINTS)
    np.savetxt(folder / "a.xyz", points, "%.5f", header="x y z", comments="")
    return str(folder / "a.xyz")


def points_with_normals(folder, raw):
    points = sample_surface(raw, POINTS)
    face = igl.point_mesh_squared_distance(points, raw.vertices, raw.faces)[1]
    columns = np.column_stack([points, raw.face_normals[face]])
    np.savetxt(folder / "a.xyz", columns, "%.5f", header="x y z nx ny nz", comments="")
    return str(folder / "a.xyz")


def label_volume(folder, raw):
    """Write the voxels, of the size the paper has, whose centres lie in a surface without holes."""
    low = raw.vertices.min(axis=0) - MARGIN
    shape = np.ceil((np.ptp(raw.vertices, axis=0) + 2 * MARGIN) / VOXEL).astype(int)
    changes = np.zeros(shape[::-1], dtype=np.int8)
    add_crossings(changes, (raw.vertices - low) / VOXEL, raw.faces)
    for layer in changes:
        layer[:] = np.cumsum(layer, axis=1, dtype=np.int8) > 0
    header = {"space dimension": 3, "space directions": np.diag(VOXEL), "space origin": low}
    header |= {"space units": ["microns"] * 3, "encoding": "raw"}
    nrrd.write(str(folder / "a.nrrd"), changes.view(np.uint8), header, index_order="C")
    return str(folder / "a.nrrd")


def add_crossings(changes, vertices, faces):
    """Add to each voxel how often the surface is entered less left on the way along x before it."""
    for corners in vertices[faces]:
        x, across = corners[:, 0], corners[:, 1:]
        low, high = (
            np.ceil(across.min(axis=0)).astype(int),
            np.floor(across.max(axis=0)).astype(int),
        )
        j, k = (axis.ravel() for axis in np.mgrid[low[0] : high[0] + 1, low[1] : high[1] + 1])
        first, second = across[1] - across[0], across[2] - across[0]
        area = first[0] * second[1] - first[1] * second[0]
        if area == 0 or not len(j):
            continue
        arm = np.column_stack([j, k]) - across[0]
        share = (arm[:, 0] * second[1] - arm[:, 1] * second[0]) / area
        other = (first[0] * arm[:, 1] - first[1] * arm[:, 0]) / area
        is_met = (share >= 0) & (other >= 0) & (share + other <= 1)
        place = x[0] + share * (x[1] - x[0]) + other * (x[2] - x[0])
        index = (k[is_met], j[is_met], np.ceil(place[is_met]).astype(int))
        np.add.at(changes, index, np.int8(-np.sign(area)))


def test_a_brain_becomes_the_same_surface_in_whatever_form_it_is_given(form, original, again):
    away = vertices_apart(again.surface, original[1].surface) / original[1].pitch
    assert away.max() <= SAME


def test_a_brain_has_the_same_oesophagus_in_whatever_form_it_is_given(original, again):
    expected, found = original[1].oesophagus, again.oesophagus
    way = np.linspace(expected.center_um, found.center_um, 20)  # the middle may slide along it
    for surface in (original[1].surface, again.surface):
        assert igl.fast_winding_number(surface.vertices, surface.faces, way).max() < 0.5
    assert found.width_um == pytest.approx(expected.width_um, abs=2 * original[1].pitch)
    assert again.chosen_by == original[1].chosen_by
    assert not again.is_guess
