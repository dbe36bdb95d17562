from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from flyreg_resources.demo import make_demo_pair

from flyreg_core.affine import AffineMap
from flyreg_core.brain_files import open_brain, write_mesh
from flyreg_core.cache import FOLDER_VARIABLE
from flyreg_core.cli import DONE, main
from flyreg_core.landmarks import LandmarkParameters
from flyreg_core.lift import Registration
from flyreg_core.mesh import SurfaceMesh
from flyreg_core.project import Brain, Project
from flyreg_core.shape_map import ShapeMap, fit_shape_map
from flyreg_core.solid import SolidParameters
from tests.brains import PreparedBrain, prepare, register_pair
from tests.frames import laid, random_frame

VOXELS_ACROSS = 40
"""Coarse, so that the demo pair is ready within seconds."""
COARSE = ["--voxels", "32"]
"""The same for commands."""


@pytest.fixture(scope="session")
def demo_source() -> PreparedBrain:
    return prepare(make_demo_pair()[0], VOXELS_ACROSS)


@pytest.fixture(scope="session")
def demo_target() -> PreparedBrain:
    return prepare(make_demo_pair()[1], VOXELS_ACROSS)


@pytest.fixture(scope="session", params=["source", "target"])
def demo(request: pytest.FixtureRequest) -> PreparedBrain:
    """Each brain of the demo pair in turn."""
    brain: PreparedBrain = request.getfixturevalue(f"demo_{request.param}")
    return brain


@pytest.fixture(scope="session", params=["turned", "mirrored"])
def demo_elsewhere(request: pytest.FixtureRequest, demo_source: PreparedBrain) -> PreparedBrain:
    """The source of the demo pair, lying otherwise in its file, or as its mirror image."""
    there = random_frame(3, is_mirrored=request.param == "mirrored")
    original = demo_source.original
    own = SurfaceMesh(demo_source.torus.frame.coordinates(original.vertices), original.faces)
    return prepare(laid(own, there), VOXELS_ACROSS, there)


@pytest.fixture(scope="session")
def demo_registration(demo_source: PreparedBrain, demo_target: PreparedBrain) -> Registration:
    return register_pair(demo_source, demo_target, LandmarkParameters())


@pytest.fixture(scope="session")
def demo_shape_map(demo_source: PreparedBrain, demo_target: PreparedBrain) -> ShapeMap:
    """The map of the shape of the demo's source on that of its target, from where they lie."""
    start = AffineMap(np.eye(3), np.zeros(3))
    return fit_shape_map(demo_source.original, demo_target.original, start)


@pytest.fixture(scope="session")
def demo_files(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The demo pair as files, source and target."""
    folder = tmp_path_factory.mktemp("demo")
    paths = (folder / "source.ply", folder / "target.ply")
    for path, mesh in zip(paths, make_demo_pair(), strict=True):
        write_mesh(path, mesh, "um")
    return paths


@pytest.fixture(scope="session")
def demo_project(demo_files: tuple[Path, Path]) -> Project:
    """The demo pair as files, at a coarse resolution."""
    source, target = (
        Brain(open_brain(str(path)), solid=SolidParameters(VOXELS_ACROSS)) for path in demo_files
    )
    return Project(source, target)


@pytest.fixture(scope="session")
def known_brains(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder where `registered` keeps its prepared brains."""
    return tmp_path_factory.mktemp("known")


@pytest.fixture
def brains_known(known_brains: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Commands find the brains of `registered` prepared, for a test that is not about that."""
    monkeypatch.setenv(FOLDER_VARIABLE, str(known_brains))


@pytest.fixture(scope="session")
def registered(
    demo_files: tuple[Path, Path], known_brains: Path, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """The folder that `flyreg register` wrote for the demo pair."""
    folder = tmp_path_factory.mktemp("run") / "demo"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(FOLDER_VARIABLE, str(known_brains))
        assert main(["register", *map(str, demo_files), "-o", str(folder), *COARSE]) == DONE
    return folder
