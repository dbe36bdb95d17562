"""Labelled voxels become the surface around them, in the frame of the file."""

import gzip
from pathlib import Path

import igl
import nibabel
import nrrd
import numpy as np
import pytest
import tifffile

from flyreg_core.brain_files import (
    accept_changed_file,
    input_facts,
    open_brain,
    read_brain,
    voxel_edge_um,
)
from flyreg_core.cli import BAD_INPUT, main
from flyreg_core.errors import Cancelled, InputError
from flyreg_core.topology import genus, is_closed
from tests.outer_surface import largest_part, outer_distances

RADIUS, TUBE = 60.0, 28.0
PAPER = (0.35, 0.35, 1.0)
COARSE = (3.0, 3.0, 4.0)
HALF = np.array([RADIUS + TUBE + 8, RADIUS + TUBE + 8, TUBE + 8])
SHEARED = np.array([[0.8, -0.5, 0.1], [0.6, 0.8, -0.2], [0.0, 0.3, 0.9]])


def torus_height(x, y, z):
    return np.hypot(np.hypot(x, y) - RADIUS, z) - TUBE


def torus_labels(voxel=COARSE):
    """Return the [z, y, x] voxels inside a torus centred in the volume, all of label 1."""
    shape = np.ceil(2 * HALF / voxel).astype(int)
    x, y, z = ((np.arange(n) - (n - 1) / 2) * size for n, size in zip(shape, voxel, strict=True))
    return (torus_height(x[None, None], y[None, :, None], z[:, None, None]) < 0).astype(np.uint8)


def middle(labels):
    """Return the index (x, y, z) of the volume's middle."""
    return (np.array(labels.shape[::-1]) - 1) / 2


def write_nrrd(path, labels, axes=None, origin=(0, 0, 0), unit="microns", **fields):
    header = dict(fields)
    if axes is not None:
        header |= {"space dimension": 3, "space directions": axes, "space origin": origin}
        header |= {} if unit is None else {"space units": [unit] * 3}
    nrrd.write(str(path), labels, header, index_order="C")
    return str(path)


def write_imagej(path, labels, voxel=COARSE, unit="um", **metadata):
    resolution = (1 / voxel[0], 1 / voxel[1])
    about = {"axes": "ZYX", "spacing": voxel[2], "unit": unit, **metadata}
    tifffile.imwrite(path, labels, imagej=True, resolution=resolution, metadata=about)
    return str(path)


def write_ome(path, labels, voxel=COARSE, unit="µm"):
    about = {"axes": "ZYX"}
    for axis, size in zip("XYZ", voxel, strict=True):
        about |= {f"PhysicalSize{axis}": size, f"PhysicalSize{axis}Unit": unit}
    tifffile.imwrite(path, labels, metadata=about, ome=True)
    return str(path)


def write_nifti(path, labels, affine=None, unit="micron"):
    image = nibabel.Nifti1Image(labels.T, np.diag([*COARSE, 1]) if affine is None else affine)
    image.header.set_xyzt_units(unit)
    nibabel.save(image, path)
    return str(path)


def read(name, **stated):
    return read_brain(open_brain(name, **stated))


def check_torus(surface, center, voxel=COARSE):
    """Check a surface against the torus it was made of, to half a voxel or block of voxels."""
    edge = max(2.0, *voxel)
    assert is_closed(surface.faces)
    assert genus(surface.faces) == 1
    height = torus_height(*(surface.vertices - center).T)
    assert np.abs(height).max() < edge / 2
    assert np.abs(height).mean() < edge / 6
    assert surface.volume == pytest.approx(2 * np.pi**2 * RADIUS * TUBE**2, rel=0.04)


# Surfaces


def test_the_voxels_of_the_paper_give_a_smooth_surface(tmp_path):
    labels = torus_labels(PAPER)
    surface = read(write_nrrd(tmp_path / "a.nrrd", labels, np.diag(PAPER)))
    check_torus(surface, middle(labels) * PAPER, PAPER)


def test_no_steps_are_left_of_the_voxels(tmp_path):
    labels = torus_labels(COARSE)
    surface = read(write_nrrd(tmp_path / "a.nrrd", labels, np.diag(COARSE)))
    x, y, z = (surface.vertices - middle(labels) * COARSE).T
    ring = np.hypot(x, y)
    outward = np.column_stack([(1 - RADIUS / ring) * x, (1 - RADIUS / ring) * y, z])
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    cosine = np.einsum("ij,ij->i", surface.vertex_normals, outward)
    assert np.percentile(np.degrees(np.arccos(cosine.clip(-1, 1))), 95) < 15


def test_every_label_above_0_is_brain(tmp_path):
    labels = torus_labels()
    parts = labels * (1 + np.arange(labels.shape[2]) // 10).astype(np.uint8)
    one = read(write_nrrd(tmp_path / "a.nrrd", labels, np.diag(COARSE)))
    many = read(write_nrrd(tmp_path / "b.nrrd", parts, np.diag(COARSE)))
    np.testing.assert_array_equal(one.vertices, many.vertices)


@pytest.mark.parametrize("kind", ["u1", "u4", "f8"])
def test_labels_may_be_numbers_of_any_type(tmp_path, kind):
    labels = torus_labels()
    name = write_nrrd(tmp_path / "a.nrrd", labels.astype(kind), np.diag(COARSE))
    check_torus(read(name), middle(labels) * COARSE)


def test_a_brain_that_touches_the_edge_of_the_volume_is_closed(tmp_path):
    labels = torus_labels()[:, :, 10:]
    surface = read(write_nrrd(tmp_path / "a.nrrd", labels, np.diag(COARSE)))
    assert is_closed(surface.faces)


def test_a_template_as_a_volume_gives_its_outer_surface(tmp_path):
    raw = read("FCWB")
    voxel = np.array([3.0, 3.0, 3.5])
    low = raw.vertices.min(axis=0) - 3 * voxel
    shape = np.ceil((raw.vertices.max(axis=0) + 3 * voxel - low) / voxel).astype(int)
    places = low + voxel * np.indices(shape).reshape(3, -1).T
    labels = (igl.fast_winding_number(raw.vertices, raw.faces, places) > 0.5).reshape(shape)
    name = write_nrrd(tmp_path / "a.nrrd", labels.T.astype(np.uint8), np.diag(voxel), low)
    distances = outer_distances(read(name), largest_part(raw))
    assert distances.max() < 10  # two voxels of the solid
    assert distances.mean() < 1


# Frames


def test_the_origin_of_an_nrrd_file_is_kept(tmp_path):
    labels, origin = torus_labels(), np.array([-500.0, 30.0, 1000.0])
    surface = read(write_nrrd(tmp_path / "a.nrrd", labels, np.diag(COARSE), origin))
    check_torus(surface, origin + middle(labels) * COARSE)


@pytest.mark.parametrize("turn", [SHEARED, np.diag([1.0, 1.0, -1.0]), np.eye(3)[[1, 2, 0]]])
def test_oblique_mirrored_and_exchanged_axes_are_followed(tmp_path, turn):
    labels, origin = torus_labels(), np.array([5.0, 6.0, 7.0])
    turn = turn / np.linalg.norm(turn, axis=0)
    plain = read(write_nrrd(tmp_path / "a.nrrd", labels, np.diag(COARSE)))
    axes = turn * COARSE  # column a: the step along axis a
    turned = read(write_nrrd(tmp_path / "b.nrrd", labels, axes.T, origin))
    np.testing.assert_allclose(turned.vertices, origin + plain.vertices @ turn.T, atol=1e-9)
    assert turned.volume > 0


def test_a_nifti_affine_is_followed(tmp_path):
    labels, affine = torus_labels(), np.eye(4)
    affine[:3, :3], affine[:3, 3] = np.diag([-1, 1, 1]) * COARSE, (400, -20, 3)
    surface = read(write_nifti(tmp_path / "a.nii.gz", labels, affine))
    check_torus(surface, (400, -20, 3) + middle(labels) * COARSE * [-1, 1, 1])


def test_a_nifti_file_without_an_affine_is_not_mirrored(tmp_path):
    labels = torus_labels()
    image = nibabel.Nifti1Image(labels.T, None)
    image.header.set_zooms(COARSE)
    image.header.set_xyzt_units("micron")
    nibabel.save(image, tmp_path / "a.nii")
    check_torus(read(str(tmp_path / "a.nii")), middle(labels) * COARSE)


# Voxel sizes and units


def nrrd_of_directions(path, labels):
    return write_nrrd(path / "a.nrrd", labels, np.diag(COARSE))


def nrrd_of_spacings(path, labels):
    about = {"spacings": COARSE, "units": ["microns"] * 3}
    return write_nrrd(path / "a.nrrd", labels, **about)


def nrrd_in_two_files(path, labels):
    return write_nrrd(path / "a.nhdr", labels, np.diag(COARSE))


def nrrd_with_the_sign_for_micro(path, labels):
    name = write_nrrd(path / "a.nrrd", labels, np.diag(COARSE), unit="??")
    content = Path(name).read_bytes().replace(b'"??"', '"µm"'.encode())
    Path(name).write_bytes(content)
    return name


def imagej_in_microns(path, labels):
    return write_imagej(path / "a.tif", labels, unit="micron")


def imagej_with_the_sign_for_micro(path, labels):
    return write_imagej(path / "a.tiff", labels, unit="\\u00B5m")


def ome(path, labels):
    return write_ome(path / "a.ome.tif", labels)


def nifti(path, labels):
    return write_nifti(path / "a.nii", labels)


HEADERS = [
    nrrd_of_directions, nrrd_of_spacings, nrrd_in_two_files, nrrd_with_the_sign_for_micro,
    imagej_in_microns, imagej_with_the_sign_for_micro, ome, nifti,
]  # fmt: skip


@pytest.mark.parametrize("write", HEADERS)
def test_voxel_size_and_unit_are_in_the_header(tmp_path, write):
    labels = torus_labels()
    brain = open_brain(write(tmp_path, labels))
    assert (brain.kind, brain.unit) == ("label volume", "um")
    assert brain.unit_known_by == "file header"
    assert input_facts(brain) == {
        "voxels": list(labels.shape[::-1]), "voxel_size_um": pytest.approx(COARSE, rel=1e-5),
    }  # fmt: skip
    check_torus(read_brain(brain), middle(labels) * COARSE)


@pytest.mark.parametrize(("unit", "um"), [("nm", 1e-3), ("mm", 1e3)])
def test_other_units_become_micrometres(tmp_path, unit, um):
    labels, voxel = torus_labels(), np.divide(COARSE, um)
    for name in (
        write_nrrd(tmp_path / "a.nrrd", labels, np.diag(voxel), unit=unit),
        write_ome(tmp_path / "a.tif", labels, voxel, unit),
    ):
        assert open_brain(name).unit == unit
        check_torus(read(name), middle(labels) * COARSE)


def test_a_unit_that_is_not_in_the_header_is_judged_from_the_size(tmp_path):
    name = write_nrrd(tmp_path / "a.nrrd", torus_labels(), np.diag(COARSE) / 1000, unit=None)
    brain = open_brain(name)
    assert (brain.unit, brain.unit_known_by) == ("mm", "judged from the size")


def without_voxel_size(path, kind, labels):
    name = str(path / f"a.{kind}")
    if kind == "nrrd":
        return write_nrrd(name, labels)
    about = {"axes": "ZYX"}
    tifffile.imwrite(name, labels, imagej=kind == "tiff", metadata=about)
    return name


@pytest.mark.parametrize("kind", ["nrrd", "tif", "tiff"])
def test_a_missing_voxel_size_is_asked_for_and_can_be_stated(tmp_path, kind):
    labels = torus_labels()
    name = without_voxel_size(tmp_path, kind, labels)
    with pytest.raises(InputError, match="does not say how large its voxels are; state their"):
        open_brain(name)
    brain = open_brain(name, voxel_size_um=COARSE)
    assert (brain.unit, brain.unit_known_by) == ("um", "stated by the user")
    check_torus(read_brain(brain), middle(labels) * COARSE)


def test_a_stated_voxel_size_goes_before_the_header(tmp_path):
    labels = torus_labels()
    name = write_nrrd(tmp_path / "a.nrrd", labels, np.diag(COARSE) * 2, (20.0, 0.0, 0.0))
    surface = read(name, voxel_size_um=COARSE)
    check_torus(surface, (10, 0, 0) + middle(labels) * COARSE)  # the origin is 5 voxels away


def test_a_changed_volume_is_refused_until_it_is_accepted(tmp_path):
    labels = torus_labels()
    brain = open_brain(nrrd_in_two_files(tmp_path, labels), voxel_size_um=COARSE)
    labels[:10] = 0
    nrrd_in_two_files(tmp_path, labels)  # the header stays the same, the voxels do not
    with pytest.raises(InputError, match="has changed since the project was saved"):
        read_brain(brain)
    accepted = accept_changed_file(brain)
    assert accepted.voxel_size_um == brain.voxel_size_um
    assert len(read_brain(accepted).vertices)


# Bad input, one sentence each


def refused(name):
    with pytest.raises(InputError) as caught:
        read(name)
    return str(caught.value)


def test_an_empty_segmentation_is_named(tmp_path):
    name = write_imagej(tmp_path / "a.tif", 0 * torus_labels())
    assert "a.tif cannot be used: no voxel has a label above 0" in refused(name)


def test_a_volume_without_background_is_named(tmp_path):
    name = write_imagej(tmp_path / "a.tif", 0 * torus_labels() + 1)
    assert "every voxel has a label above 0; give what is not brain" in refused(name)


@pytest.mark.parametrize("kind", ["u1", "u2", "f4"])
def test_a_grey_value_image_is_told_from_labels(tmp_path, kind):
    noise = np.random.default_rng(0).normal(120, 20, torus_labels().shape)
    name = write_nrrd(tmp_path / "a.nrrd", (noise * torus_labels()).astype(kind), np.diag(COARSE))
    assert "is a grey-value image and not labels" in refused(name)


def test_a_colour_image_is_named(tmp_path):
    image = np.zeros((20, 64, 64, 3), dtype=np.uint8)
    tifffile.imwrite(tmp_path / "a.tif", image, photometric="rgb")
    assert "is a colour image of 3 x 64 x 64 x 20 values" in refused(str(tmp_path / "a.tif"))


@pytest.mark.parametrize("kind", ["nrrd", "tif", "nii"])
def test_a_single_picture_is_no_volume(tmp_path, kind):
    name = str(tmp_path / f"a.{kind}")
    if kind == "nrrd":
        nrrd.write(name, np.zeros((40, 50), dtype=np.uint8))
    elif kind == "tif":
        tifffile.imwrite(name, np.zeros((50, 40), dtype=np.uint8))
    else:
        nibabel.save(nibabel.Nifti1Image(np.zeros((40, 50), dtype=np.uint8), np.eye(4)), name)
    assert "has 40 x 50 voxels, and a volume has three dimensions" in refused(name)


@pytest.mark.parametrize("kind", ["nrrd", "tif", "nii", "nii.gz"])
@pytest.mark.parametrize("share", [0.02, 0.6])
def test_a_truncated_volume_is_named(tmp_path, kind, share):
    write = {"nrrd": nrrd_of_directions, "tif": imagej_in_microns}.get(kind, nifti)
    labels = np.random.default_rng(0).integers(1, 200, torus_labels().shape, dtype=np.uint8)
    data = Path(write(tmp_path, labels)).read_bytes()
    data = gzip.compress(data) if kind == "nii.gz" else data
    path = tmp_path / f"cut.{kind}"
    path.write_bytes(data[: int(len(data) * share)])
    assert "is damaged, cut short or of another kind" in refused(str(path))


@pytest.mark.parametrize("kind", ["nrrd", "nhdr", "tif", "tiff", "nii", "nii.gz"])
def test_content_of_another_kind_is_no_volume(tmp_path, kind):
    (tmp_path / f"a.{kind}").write_text("Dear reader,\nthis is a letter.\n")
    assert "of another kind" in refused(str(tmp_path / f"a.{kind}"))


@pytest.mark.parametrize("kind", ["nrrd", "nhdr", "tif", "nii"])
def test_a_missing_or_empty_volume_is_named(tmp_path, kind):
    assert "there is no file" in refused(str(tmp_path / f"a.{kind}"))
    (tmp_path / f"a.{kind}").touch()
    assert "is empty (0 bytes)" in refused(str(tmp_path / f"a.{kind}"))


def test_a_header_without_its_voxels_is_named(tmp_path):
    name = nrrd_in_two_files(tmp_path, torus_labels())
    next(tmp_path.glob("a.raw*")).unlink()
    assert "there is no file" in refused(name)


def test_axes_in_one_plane_are_named(tmp_path):
    flat = np.array([[2.0, 0, 0], [0, 2.0, 0], [2.0, 2.0, 0]])
    assert "its axes do not span space" in refused(
        write_nrrd(tmp_path / "a.nrrd", torus_labels(), flat)
    )


def test_a_voxel_size_off_by_a_thousand_is_refused(tmp_path):
    name = write_imagej(tmp_path / "a.tif", torus_labels(), (2000.0, 2000.0, 3000.0))
    assert "off by 1,000 or so" in refused(name)


def test_two_brains_in_one_volume_are_refused(tmp_path):
    labels = torus_labels()
    both = np.concatenate([labels, labels], axis=2)
    assert "holds two brains or halves of one" in refused(write_imagej(tmp_path / "a.tif", both))


def test_reading_can_be_cancelled(tmp_path):
    brain = open_brain(write_imagej(tmp_path / "a.tif", torus_labels()))

    def cancel(fraction, text):
        if fraction > 0.5:
            raise Cancelled

    with pytest.raises(Cancelled):
        read_brain(brain, cancel)


# Commands


@pytest.mark.parametrize("option", ["--voxel-size", "--source-voxel-size", "--target-voxel-size"])
def test_the_voxel_size_can_be_stated_to_the_commands(tmp_path, capsys, option):
    name = without_voxel_size(tmp_path, "tif", torus_labels())
    other = nifti(tmp_path, torus_labels())
    command = {
        "--voxel-size": ["inspect", name],
        "--source-voxel-size": ["register", name, other, "-o", str(tmp_path / "out")],
        "--target-voxel-size": ["register", other, name, "-o", str(tmp_path / "out")],
    }[option]
    assert main([*command, option, "1", "0", "1"]) == BAD_INPUT
    assert "must be three positive numbers of micrometres" in capsys.readouterr().err


def test_the_commands_say_how_to_state_the_voxel_size(tmp_path, capsys):
    assert main(["inspect", without_voxel_size(tmp_path, "tif", torus_labels())]) == BAD_INPUT
    assert "in um with --voxel-size" in capsys.readouterr().err


def test_distances_in_voxels_are_in_edges_of_a_cube_as_large(tmp_path):
    path = write_imagej(tmp_path / "labels.tif", torus_labels(), COARSE)
    brain = open_brain(path)
    assert voxel_edge_um(brain) == pytest.approx(np.cbrt(3.0 * 3.0 * 4.0))
    stated = open_brain(path, voxel_size_um=(2.0, 2.0, 2.0))
    assert voxel_edge_um(stated) == pytest.approx(2.0)
    (tmp_path / "labels.tif").unlink()
    assert voxel_edge_um(brain) is None
