"""Whether what a file holds is one fly brain, and in which unit it is measured."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from flyreg_core import templates
from flyreg_core.errors import InputError
from flyreg_core.mesh import Floats, Integers
from flyreg_core.project import Unit
from flyreg_core.templates import template_file
from flyreg_core.topology import component_of_vertex

UM_PER_UNIT: Mapping[Unit, float] = {"nm": 1e-3, "um": 1.0, "mm": 1e3}
"""Micrometres in one of each unit."""
USUAL_UM = (150.0, 2000.0)
"""Largest extents by which a unit is judged, micrometres; a fly brain has 300 to 900."""
POSSIBLE_UM = (100.0, 3000.0)
"""Largest extents that are believed when the unit is stated, micrometres."""
TWIN_SHARE = 0.6
"""A surface beside the largest one is a brain too if its box has at least this share of the volume.

Optic lobes that hang on nothing, as in the templates Dsim and JRC2018F, have up to 0.43.
"""


def find_unit(name: str, path: Path, extent: float, stated: Unit | None) -> tuple[Unit, str]:
    """Return the unit of a brain, and how it is known.

    Parameters
    ----------
    name, path : str, Path
        As the user gave it, and the file that was found.
    extent : float
        The longest edge of its box, in the file's unit.
    stated : {"nm", "um", "mm"}, optional
        What the user says.

    Raises
    ------
    InputError
        It is a template in voxels, or the size fits no unit.
    """
    if stated is not None:
        return stated, "stated by the user"
    by_metadata = templates.template_unit(name) if path == template_file(name) else None
    if by_metadata == "voxels":
        raise InputError(
            f"the template {name} is measured in voxels, whose size flyreg does not know; scale "
            "it to micrometres and save that as a file"
        )
    for unit, um in UM_PER_UNIT.items():
        if unit == by_metadata:
            return unit, "template metadata"
        if by_metadata is None and USUAL_UM[0] <= extent * um <= USUAL_UM[1]:
            return unit, "judged from the size"
    raise InputError(
        f"the unit of {path} cannot be judged: it is {extent:,.6g} units across, and a fly brain "
        "is 300 to 900 um; state the unit with --source-unit or --target-unit"
    )


def check_size(path: Path, extent: float, unit: Unit) -> None:
    """Tell whether a brain of this extent, in its unit, is possible.

    Raises
    ------
    InputError
        It is much smaller or larger than any fly brain.
    """
    extent_um = extent * UM_PER_UNIT[unit]
    if not POSSIBLE_UM[0] <= extent_um <= POSSIBLE_UM[1]:
        raise InputError(
            f"{path} is {extent:,.6g} units across, so in {unit} it is {extent_um:,.6g} um, and a "
            "fly brain is 300 to 900 um: the unit is off by 1,000 or so; state the right one with "
            "--source-unit or --target-unit"
        )


def check_single(vertices: Floats, faces: Integers, path: Path) -> None:
    """Tell whether a surface, in micrometres, is one brain in one piece.

    Raises
    ------
    InputError
        Beside its largest piece lies another that is nearly as large.
    """
    component = component_of_vertex(faces, len(vertices))
    count = int(component.max()) + 1
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, component, vertices)
    np.maximum.at(high, component, vertices)
    volume = (high - low).prod(axis=1)
    largest = int(volume.argmax())
    is_apart = ((low > high[largest]) | (high < low[largest])).any(axis=1)
    twins = np.flatnonzero(is_apart & (volume >= TWIN_SHARE * volume[largest]))
    if len(twins):
        one, other = (
            "(" + ", ".join(f"{x:.0f}" for x in (low[i] + high[i]) / 2) + ")"
            for i in (largest, twins[0])
        )
        raise InputError(
            f"{path} holds two brains or halves of one, centred at {one} and {other} um; save the "
            "one you mean, in one piece, in a file of its own"
        )
