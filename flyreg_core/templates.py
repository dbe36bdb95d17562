"""The template brains of the flybrains package, found among its files without importing it."""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Iterator
from difflib import get_close_matches
from pathlib import Path

UNIT_NAMES = {"nanometers": "nm", "microns": "um", "millimeters": "mm"}
"""The package's words for the units that flyreg knows."""


def is_installed() -> bool:
    """Tell whether the flybrains package is installed."""
    return _folder() is not None


def template_labels() -> tuple[str, ...]:
    """Return the labels of all templates with a mesh, sorted; none without flybrains."""
    folder = _folder()
    return tuple(sorted(file.stem for file in (folder / "meshes").glob("*.ply"))) if folder else ()


def template_file(label: str) -> Path | None:
    """Return the mesh file of a template, or None if there is no template of that label."""
    folder = _folder()
    return folder / "meshes" / f"{label}.ply" if folder and label in template_labels() else None


def template_unit(label: str) -> str | None:
    """Return the unit of a template's mesh by the package's metadata; None where it says nothing.

    Returns
    -------
    str or None
        One of nm, um, mm, or the package's own word for another one ("voxels").

    Notes
    -----
    A mesh of a part, such as JRCFIB2022M_brain, has the unit of its whole, JRCFIB2022M; so has one
    of raw coordinates, such as MANCraw, where only MANC is described.
    """
    units = dict(_stated_units())
    stated = units.get(label) or units.get(label.partition("_")[0].removesuffix("raw"))
    return UNIT_NAMES.get(stated, stated) if stated else None


def similar_labels(label: str) -> tuple[str, ...]:
    """Return up to three templates whose labels look most like a misspelt one."""
    by_lower_case = {known.lower(): known for known in template_labels()}
    near = get_close_matches(label.lower(), list(by_lower_case))
    return tuple(by_lower_case[lower_case] for lower_case in near)


def _folder() -> Path | None:
    spec = importlib.util.find_spec("flybrains")
    places = spec.submodule_search_locations if spec else None
    return Path(next(iter(places))) if places else None


def _stated_units() -> Iterator[tuple[str, str]]:
    folder = _folder()
    file = folder / "data" / "template_meta.json" if folder else None
    if file is None or not file.is_file():
        return
    for entry in json.loads(file.read_text(encoding="utf-8")):
        units = entry.get("units")
        distinct = {units} if isinstance(units, str) else set(units or ())
        if "label" in entry and len(distinct) == 1:
            yield entry["label"], distinct.pop()
