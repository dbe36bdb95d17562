import numpy as np
import pytest
from flyreg_resources import read_help
from flyreg_resources.demo import deform, make_demo_pair

from flyreg_core import topology
from flyreg_core.handles import HandleParameters
from flyreg_core.mesh import SurfaceMesh
from flyreg_core.pose import find_frame
from flyreg_core.progress import ignore
from flyreg_core.solid import SolidParameters, voxelize
from flyreg_core.torus import make_torus
from flyreg_core.trim import TrimParameters

pytestmark = pytest.mark.filterwarnings("default")


@pytest.fixture(scope="module")
def pair() -> tuple[SurfaceMesh, SurfaceMesh]:
    return make_demo_pair()


def test_the_demo_pair_is_the_same_each_time(pair):
    again = make_demo_pair()
    for mesh, other in zip(pair, again, strict=True):
        np.testing.assert_array_equal(mesh.vertices, other.vertices)
        np.testing.assert_array_equal(mesh.faces, other.faces)


def test_the_demo_brains_are_closed_with_one_handle(pair):
    for mesh in pair:
        assert topology.genus(mesh.faces) == 1
        assert mesh.volume > 0
        assert 10_000 < len(mesh.vertices) < 22_000


def test_the_demo_source_has_the_proportions_of_a_fly_brain(pair):
    width, height, depth = np.ptp(pair[0].vertices, axis=0)
    assert 520 < width < 600
    assert 240 < height < 300
    assert 120 < depth < 170


def test_the_demo_target_is_the_deformed_source(pair):
    source, target = pair
    np.testing.assert_array_equal(target.vertices, deform(source.vertices))
    moved = np.linalg.norm(target.vertices - source.vertices, axis=1)
    assert 15 < moved.mean() < 30


def test_the_deformation_turns_nothing_inside_out():
    points = np.random.default_rng(1).uniform(-300, 300, size=(2000, 3))
    step = 1e-3
    columns = [(deform(points + step * axis) - deform(points)) / step for axis in np.eye(3)]
    assert np.linalg.det(np.stack(columns, axis=-1)).min() > 0.4


@pytest.mark.parametrize("index", [0, 1])
def test_one_handle_of_a_demo_brain_is_found_and_is_the_oesophagus(pair, index):
    frame = find_frame(pair[index])
    solid = voxelize(pair[index], frame, SolidParameters(voxels_across=36), ignore)
    torus = make_torus(pair[index], solid, TrimParameters(), HandleParameters(), ignore)
    assert [handle.is_oesophagus for handle in torus.handles] == [True]
    assert topology.genus(torus.surface.faces) == 1


def test_there_is_help():
    assert "Landmark" in read_help("method.md") or "landmark" in read_help("method.md")
    assert "left drag" in read_help("shortcuts.md")
