from functools import cache

import numpy as np
import pytest
from flyreg_resources.demo import make_demo_pair
from scipy.spatial.transform import Rotation

from flyreg_core.brain_files import open_brain, read_brain
from flyreg_core.errors import InputError
from flyreg_core.mesh import SurfaceMesh
from flyreg_core.pose import Pose, find_frame, find_pose
from tests.shapes import box, sphere, torus

UPRIGHT = (
    *("FCWB", "JFRC2", "IS2", "T1", "IBNWB", "JFRC2013", "JFRC2013DS", "JRC2018F", "JRC2018M"),
    *("JRC2018U", "Dmel", "DsecI", "Dsim", "Dvir", "FAFB14", "FLYWIRE_whole_brain"),
    "JRCFIB2022M_brain",
)
"""Templates whose x, y and z point about to the left, ventrally and posteriorly."""


@cache
def template(name: str) -> SurfaceMesh:
    return read_brain(open_brain(name))


@cache
def template_pose(name: str) -> Pose:
    return find_pose(template(name))


def cut(mesh: SurfaceMesh, is_kept) -> SurfaceMesh:
    """Return the faces all of whose vertices are kept."""
    faces = mesh.faces[is_kept[mesh.faces].all(axis=1)]
    used, number = np.unique(faces, return_inverse=True)
    return SurfaceMesh(mesh.vertices[used], number.reshape(-1, 3))


@pytest.mark.parametrize("name", UPRIGHT)
def test_every_template_that_lies_as_its_images_do_is_found_so(name):
    pose = template_pose(name)
    cosines = np.diag(pose.frame.axes)
    assert cosines[0] > np.cos(np.deg2rad(6))
    assert (cosines[1:] > np.cos(np.deg2rad(20))).all()
    assert pose.is_sure


def test_a_template_that_looks_down_is_found_so():
    axes = template_pose("BANC_brain").frame.axes
    assert axes[0, 0] > 0.99
    assert 50 < np.rad2deg(np.arctan2(axes[2, 1], axes[2, 2])) < 65


@pytest.mark.parametrize(
    ("name", "seed", "scale"), [("FCWB", 1, 0.6), ("FAFB14", 2, 1.9), ("JRC2018F", 3, 1.0)]
)
@pytest.mark.parametrize("is_mirrored", [False, True])
def test_the_frame_moves_with_the_brain(name, seed, scale, is_mirrored):
    mesh, frame = template(name), template_pose(name).frame
    turn = Rotation.random(random_state=seed).as_matrix() @ np.diag(
        [1, 1, -1 if is_mirrored else 1]
    )
    shift = np.array([500.0, -20_000.0, 77.0])
    moved = SurfaceMesh(
        scale * mesh.vertices @ turn.T + shift, mesh.faces[:, ::-1] if is_mirrored else mesh.faces
    )
    found = find_frame(moved)
    expected = frame.axes @ turn.T
    if is_mirrored:
        expected[0] *= -1  # shape cannot tell, and the frame is right-handed
    np.testing.assert_allclose(found.axes, expected, atol=1e-6)
    np.testing.assert_allclose(
        found.origin, scale * frame.origin @ turn.T + shift, atol=1e-4 * scale
    )
    assert not found.is_mirrored


@pytest.mark.parametrize(
    ("name", "left", "right"),
    [
        ("FCWB", 0.5, 1.0),
        ("FCWB", 0.5, 0.5),
        ("JRCFIB2022M_brain", 1.0, 0.5),
        ("JRCFIB2022M_brain", 0.6, 0.45),
        ("Dvir", 0.75, 1.0),
    ],
)
def test_missing_and_torn_optic_lobes_do_not_matter(name, left, right):
    mesh, whole = template(name), template_pose(name).frame
    lateral = whole.coordinates(mesh.vertices)[:, 0]
    half = np.abs(lateral).max()
    pose = find_pose(cut(mesh, (lateral < left * half) & (lateral > -right * half)))
    turn = np.rad2deg(np.arccos(np.clip((pose.frame.axes * whole.axes).sum(axis=1), -1, 1)))
    assert turn.max() < 7
    assert abs(whole.coordinates(pose.frame.origin)[0]) < 5


def test_a_made_up_brain_lies_as_it_was_made():
    frame = find_frame(make_demo_pair()[0])
    np.testing.assert_allclose(frame.axes, np.eye(3), atol=0.05)
    assert abs(frame.origin[0]) < 2


def test_a_box_has_a_left_and_right_but_no_certain_front_and_top():
    pose = find_pose(SurfaceMesh(*box((600.0, 300.0, 150.0))))
    np.testing.assert_allclose(np.abs(pose.frame.axes[0]), [1, 0, 0], atol=1e-6)
    assert not pose.is_sure


@pytest.mark.parametrize("shape", [sphere(), torus()], ids=["ball", "ring"])
def test_what_is_as_wide_another_way_is_refused(shape):
    with pytest.raises(InputError, match="no direction that is clearly its left and right"):
        find_pose(SurfaceMesh(*shape))


def test_half_a_brain_is_no_certain_brain():
    mesh, frame = template("FCWB"), template_pose("FCWB").frame
    try:
        pose = find_pose(cut(mesh, frame.coordinates(mesh.vertices)[:, 0] > 0))
    except InputError:
        return
    assert not pose.is_sure


def test_a_body_of_revolution_has_a_left_and_right_but_no_front():
    vertices, faces = sphere()
    pose = find_pose(SurfaceMesh(vertices * [3.0, 1.0, 1.0], faces))
    np.testing.assert_allclose(np.abs(pose.frame.axes[0]), [1, 0, 0], atol=1e-3)
    assert not pose.is_sure


def test_a_flat_sheet_is_refused():
    flat = SurfaceMesh(np.array([[0, 0, 0], [600, 0, 0], [0, 300, 0.0]]), np.array([[0, 1, 2]]))
    with pytest.raises(InputError, match="is flat"):
        find_frame(flat)
