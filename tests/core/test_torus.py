import numpy as np
import pytest
import trimesh

from flyreg_core.errors import Cancelled
from flyreg_core.mesh import SurfaceMesh
from flyreg_core.progress import ignore
from flyreg_core.solid import SolidParameters, voxelize
from flyreg_core.torus import make_torus
from flyreg_core.trim import TrimParameters
from tests.brains import PreparedBrain

SIZE = np.array([400.0, 200.0, 100.0])
TUNNEL = 50.0


def block_with_tunnels(*centres, width=TUNNEL):
    """A block with square tunnels along z, as the surface between cells of a coarse grid."""
    x_cuts = sorted({-200.0, 200.0, *(c + s * width / 2 for c, _ in centres for s in (-1, 1))})
    y_cuts = sorted({-100.0, 100.0, *(c + s * width / 2 for _, c in centres for s in (-1, 1))})
    x_middles, y_middles = (np.add(cuts[1:], cuts[:-1]) / 2 for cuts in (x_cuts, y_cuts))

    def is_full(i, j):
        if not (0 <= i < len(x_middles) and 0 <= j < len(y_middles)):
            return False
        return all(
            max(abs(x_middles[i] - x), abs(y_middles[j] - y)) > width / 2 for x, y in centres
        )

    corners = []
    for i in range(len(x_middles)):
        for j in range(len(y_middles)):
            if not is_full(i, j):
                continue
            (x0, x1), (y0, y1) = x_cuts[i : i + 2], y_cuts[j : j + 2]
            around = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
            corners.append([(x, y, 50.0) for x, y in around])
            corners.append([(x, y, -50.0) for x, y in around[::-1]])
            for k, (di, dj) in enumerate(((0, -1), (1, 0), (0, 1), (-1, 0))):
                if not is_full(i + di, j + dj):
                    (a, b), (c, d) = around[k], around[(k + 1) % 4]
                    corners.append([(a, b, -50.0), (c, d, -50.0), (c, d, 50.0), (a, b, 50.0)])
    vertices = np.array(corners).reshape(-1, 3)
    start = 4 * np.arange(len(corners))[:, None]
    return SurfaceMesh(vertices, np.vstack([np.add(start, [0, 1, 2]), np.add(start, [0, 2, 3])]))


def made(original, right=-150.0, left=150.0, across=27):
    solid = voxelize(original, SolidParameters(across), ignore)
    return make_torus(original, solid, TrimParameters(right, left), ignore)


def as_trimesh(surface):
    return trimesh.Trimesh(surface.vertices, surface.faces, process=False)


def assert_torus(surface):
    mesh = as_trimesh(surface)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.body_count == 1
    assert mesh.euler_number == 0
    assert mesh.volume > 0


def test_the_main_brain_is_closed_in_one_piece_with_one_handle(demo: PreparedBrain):
    assert_torus(demo.torus.surface)


def test_the_handle_is_near_the_midline(demo: PreparedBrain):
    x = demo.torus.surface.vertices[:, 0]
    middle, width = (x.min() + x.max()) / 2, np.ptp(x)
    assert abs(demo.torus.oesophagus.center_um[0] - middle) < 0.1 * width
    assert demo.torus.oesophagus in demo.torus.handles


def test_nothing_reaches_beyond_the_trim_planes(demo: PreparedBrain):
    torus = demo.torus
    x = torus.surface.vertices[:, 0]
    assert x.min() >= torus.planes.right - torus.pitch
    assert x.max() <= torus.planes.left + torus.pitch


def test_vertices_off_the_trim_planes_lie_on_the_original_within_a_fraction_of_a_voxel(
    demo: PreparedBrain,
):
    torus = demo.torus
    x = torus.surface.vertices[:, 0]
    off_planes = np.minimum(x - torus.planes.right, torus.planes.left - x) > 2 * torus.pitch
    _, away, _ = trimesh.proximity.closest_point(
        as_trimesh(demo.original), torus.surface.vertices[off_planes]
    )
    assert away.mean() < 0.1 * torus.pitch
    assert np.quantile(away, 0.95) < 0.5 * torus.pitch


def test_a_block_with_a_tunnel_has_the_volume_of_a_block_with_a_tunnel():
    torus = made(block_with_tunnels((0, 0)))
    assert_torus(torus.surface)
    expected = 300 * SIZE[1] * SIZE[2] - TUNNEL**2 * SIZE[2]
    assert torus.surface.volume == pytest.approx(expected, rel=0.02)
    assert torus.filled_um3 == 0
    assert torus.oesophagus.center_um == pytest.approx((0, 0, 0), abs=50 + 2 * torus.pitch)
    assert torus.oesophagus.width_um == pytest.approx(TUNNEL, abs=2 * torus.pitch)


@pytest.mark.parametrize("voxels", [2, 3])
def test_an_oesophagus_no_wider_than_a_crack_stays_open(voxels):
    width = voxels * SIZE[1] / 27
    torus = made(block_with_tunnels((0, 0), width=width))
    assert_torus(torus.surface)
    assert torus.oesophagus.width_um == pytest.approx(width, abs=2 * torus.pitch)


def test_flat_faces_are_drawn_flat():
    surface = made(block_with_tunnels((0, 0))).surface
    top = surface.vertices[surface.vertices[:, 2] > 40]
    inner = (np.abs(top[:, 0]) < 130) & (np.abs(top[:, 1]) < 80)
    inner &= np.abs(top[:, :2]).max(axis=1) > 35
    assert top[inner, 2] == pytest.approx(50.0, abs=1e-6)


def test_other_tunnels_are_filled_and_their_volume_is_told():
    torus = made(block_with_tunnels((0, 0), (100, 0)))
    assert_torus(torus.surface)
    assert len(torus.handles) == 2
    assert torus.pitch**3 < torus.filled_um3 < TUNNEL**2 * 2 * torus.pitch


def test_the_planes_are_where_the_parameters_put_them():
    torus = made(block_with_tunnels((0, 0)), right=-120.0, left=140.0)
    assert (torus.planes.right, torus.planes.left) == (-120, 140)
    x = torus.surface.vertices[:, 0]
    assert (x.min(), x.max()) == pytest.approx((-120, 140), abs=0.5 * torus.pitch)


def test_drawing_can_be_cancelled():
    original = block_with_tunnels((0, 0))
    solid = voxelize(original, SolidParameters(27), ignore)

    def report(fraction, text):
        if fraction > 0.5:
            raise Cancelled

    with pytest.raises(Cancelled):
        make_torus(original, solid, TrimParameters(), report)


def test_the_same_solid_gives_the_same_bytes(demo_source: PreparedBrain):
    original, solid = demo_source.original, demo_source.solid
    again = make_torus(original, solid, TrimParameters(), ignore).surface
    assert again.vertices.tobytes() == demo_source.torus.surface.vertices.tobytes()
    assert again.faces.tobytes() == demo_source.torus.surface.faces.tobytes()
