from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from flyreg_core.alignment import Alignment, align
from flyreg_core.brain_files import open_brain, read_brain
from flyreg_core.errors import Cancelled
from flyreg_core.frame import BrainFrame
from flyreg_core.mesh import SurfaceMesh
from flyreg_core.pose import find_frame
from flyreg_core.progress import ignore

STRETCH = np.array([[1.05, 0.03, -0.02], [0.02, 0.95, 0.04], [-0.03, 0.01, 1.1]])


@cache
def template(name: str) -> SurfaceMesh:
    return read_brain(open_brain(name))


@cache
def template_frame(name: str) -> BrainFrame:
    return find_frame(template(name))


@cache
def usual_alignment() -> tuple[Alignment, list[float]]:
    """FCWB on JFRC2, and the progress that was reported."""
    fractions: list[float] = []
    found = align(
        template("FCWB"),
        template("JFRC2"),
        template_frame("FCWB"),
        template_frame("JFRC2"),
        lambda fraction, text: fractions.append(fraction),
    )
    return found, fractions


def with_signs(frame: BrainFrame, signs: tuple[int, int, int]) -> BrainFrame:
    return BrainFrame(frame.origin, frame.axes * np.array(signs)[:, np.newaxis])


def test_a_stretched_copy_is_laid_on_its_original():
    mesh = template("JFRC2")
    moved = SurfaceMesh(mesh.vertices @ STRETCH.T + [30.0, -20.0, 7.0], mesh.faces)
    found = align(mesh, moved, template_frame("JFRC2"), find_frame(moved), ignore)
    away = np.linalg.norm(found.to_target(mesh.vertices) - moved.vertices, axis=1)
    assert away.mean() < 0.1
    assert found.residual_um < 0.1
    assert found.is_sure
    assert not found.is_mirrored


def test_one_brain_is_laid_on_another():
    found, _ = usual_alignment()
    assert found.residual_um < 4
    assert found.is_sure
    assert not found.is_side_sure  # a brain is much like its mirror image
    assert not found.is_mirrored


def test_the_frame_of_the_source_is_that_of_the_target_carried_back():
    found, target = usual_alignment()[0], template_frame("JFRC2")
    np.testing.assert_allclose(found.to_target(found.frame.origin), target.origin, atol=1e-6)
    np.testing.assert_allclose(found.frame.axes @ found.frame.axes.T, np.eye(3), atol=1e-12)
    carried = found.frame.axes @ found.to_target.matrix.T
    carried /= np.linalg.norm(carried, axis=1, keepdims=True)
    assert ((carried * target.axes).sum(axis=1) > 0.98).all()


@pytest.mark.parametrize("signs", [(1, -1, -1), (-1, 1, -1)], ids=str)
def test_wrong_front_or_top_is_set_right_by_the_target(signs):
    wrong = with_signs(template_frame("FCWB"), signs)
    found = align(template("FCWB"), template("JFRC2"), wrong, template_frame("JFRC2"), ignore)
    assert found.candidates[0].signs == signs
    assert found.is_sure
    assert not found.is_mirrored
    np.testing.assert_allclose(found.frame.axes, usual_alignment()[0].frame.axes, atol=0.02)


def test_a_mirror_image_of_the_target_is_told():
    mesh, frame = template("JFRC2"), template_frame("JFRC2")
    mirrored = SurfaceMesh(mesh.vertices * [-1, 1, 1], mesh.faces[:, ::-1])
    found = align(mirrored, mesh, find_frame(mirrored), frame, ignore)
    assert found.is_mirrored
    assert found.is_side_sure
    assert found.frame.is_mirrored
    assert found.residual_um < 0.1


def test_what_the_frames_say_about_sides_is_kept_in_doubt():
    known = with_signs(template_frame("FCWB"), (-1, 1, 1))
    found = align(template("FCWB"), template("JFRC2"), known, template_frame("JFRC2"), ignore)
    assert found.is_mirrored
    assert not found.is_side_sure


def test_the_alignment_moves_with_the_source():
    turn = Rotation.random(random_state=5).as_matrix()
    moved = SurfaceMesh(0.8 * template("FCWB").vertices @ turn.T + 900.0, template("FCWB").faces)
    found = align(moved, template("JFRC2"), find_frame(moved), template_frame("JFRC2"), ignore)
    expected = usual_alignment()[0].to_target(template("FCWB").vertices)
    np.testing.assert_allclose(found.to_target(moved.vertices), expected, atol=0.5)


def test_it_can_be_cancelled():
    calls = []

    def cancel(fraction: float, text: str) -> None:
        calls.append(fraction)
        if len(calls) > 3:
            raise Cancelled

    with pytest.raises(Cancelled):
        align(
            template("FCWB"),
            template("JFRC2"),
            template_frame("FCWB"),
            template_frame("JFRC2"),
            cancel,
        )
    assert len(calls) == 4


def test_progress_never_goes_back():
    _, fractions = usual_alignment()
    assert np.all(np.diff(fractions) >= 0)
    assert 0 <= min(fractions) <= max(fractions) <= 1
