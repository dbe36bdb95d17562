from __future__ import annotations

import pytest
from flyreg_resources.demo import make_demo_pair
from hypothesis import settings

from flyreg_core.landmarks import LandmarkParameters
from flyreg_core.lift import Registration
from tests.brains import PreparedBrain, prepare, register_pair

settings.register_profile("flyreg", derandomize=True, deadline=None, max_examples=50)
settings.load_profile("flyreg")

VOXELS_ACROSS = 32
"""Coarse, so that the demo pair is ready within seconds."""


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


@pytest.fixture(scope="session")
def demo_registration(demo_source: PreparedBrain, demo_target: PreparedBrain) -> Registration:
    return register_pair(demo_source, demo_target, LandmarkParameters())
