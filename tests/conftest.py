"""What all tests share: whether there is a display, and where a program's own files go."""

from __future__ import annotations

import os
import sys

import pytest

os.environ.setdefault("FLYREG_CACHE", "off")  # nothing is taken from, or left to, the user's

HAS_DISPLAY = not sys.platform.startswith("linux") or bool(
    os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
)
if not HAS_DISPLAY:  # widgets without 3D views can be tested nevertheless
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Keep windows on one core: two that were active at once would take each other's keys."""
    for item in items:
        place = item.path.parent.name
        item.add_marker(pytest.mark.xdist_group("windows" if place == "app" else item.path.name))
    if HAS_DISPLAY and os.environ.get("QT_QPA_PLATFORM") != "offscreen":
        return
    skip = pytest.mark.skip(reason="needs a display for 3D views; `python3 tests` provides one")
    for item in items:
        if item.get_closest_marker("window"):
            item.add_marker(skip)
