"""What all tests share: displays, who runs which test, and where a program's own files go."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import settings

if TYPE_CHECKING:
    from xdist.scheduler import LoadScopeScheduling

os.environ.setdefault("FLYREG_CACHE", "off")  # nothing is taken from, or left to, the user's
settings.register_profile("flyreg", derandomize=True, deadline=None, max_examples=50)
settings.load_profile("flyreg")  # here, as modules of all folders take it when they are read

DISPLAYS = os.environ.get("FLYREG_TEST_DISPLAYS", "").split()
"""What `python3 tests` has started on Linux: as many as there are processes."""
WORKER = os.environ.get("PYTEST_XDIST_WORKER", "").removeprefix("gw")
if DISPLAYS and WORKER:
    os.environ["DISPLAY"] = DISPLAYS[int(WORKER) % len(DISPLAYS)]

HAS_DISPLAY = not sys.platform.startswith("linux") or bool(
    os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
)
if not HAS_DISPLAY:  # widgets without 3D views can be tested nevertheless
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Skip what needs a display where there is none."""
    if HAS_DISPLAY and os.environ.get("QT_QPA_PLATFORM") != "offscreen":
        return
    skip = pytest.mark.skip(reason="needs a display for 3D views; `python3 tests` provides one")
    for item in items:
        if item.get_closest_marker("window"):
            item.add_marker(skip)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> LoadScopeScheduling:
    """Have each module run in one process, and all windows in one that share a display.

    Two windows that were active at once on one display would take each other's keys and pointer.
    """
    from xdist.scheduler import LoadScopeScheduling

    class Scheduling(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            module = nodeid.partition("::")[0]
            is_window = Path(module).parent.name == "app"
            is_shared = len(DISPLAYS) < self.numnodes
            return "windows" if is_window and is_shared else module

    return Scheduling(config, log)


@pytest.fixture(scope="module", autouse=True)
def only_here(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> None:
    """No other process runs tests of this module: what it shares would be made twice."""
    if WORKER:
        place = Path(request.node.nodeid)
        name = f"{place.parent.name}-{place.stem}"
        (tmp_path_factory.getbasetemp().parent / name).touch(exist_ok=False)
