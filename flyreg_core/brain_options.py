"""What the commands ask about a brain: its unit, how it lies, its tunnels, where it is trimmed."""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from flyreg_core.handles import Point
    from flyreg_core.project import Brain

UNITS = ("nm", "um", "mm")


def add_brain_options(command: argparse.ArgumentParser, role: str = "") -> None:
    """Add the options about one brain; in `register` their names begin with its role."""
    group = command.add_argument_group(f"about the {role}" if role else "about the brain")
    start = f"--{role}-" if role else "--"
    group.add_argument(f"{start}unit", choices=UNITS, help="unit of the file's coordinates")
    group.add_argument(
        f"{start}voxel-size",
        nargs=3,
        type=float,
        metavar=("X", "Y", "Z"),
        help="of a label volume, um",
    )
    group.add_argument(
        f"{start}pose",
        metavar="LVP",
        help="towards which sides of the animal x, y and z grow: L or R, V or D, P or A",
    )
    group.add_argument(
        f"{start}hole",
        type=_point,
        metavar="X,Y,Z",
        help="a place in the oesophagus, in the file's unit (--hole=-1,2,3 if it begins with a minus)",
    )
    for name, kind, metavar, text in (
        ("close", _point, "X,Y,Z", "a place in a tunnel that is not the oesophagus"),
        ("drill", _points, "X,Y,Z:X,Y,Z", "drill a channel from one place to another"),
    ):
        group.add_argument(
            f"{start}{name}",
            type=kind,
            action="append",
            default=[],
            metavar=metavar,
            help=f"{text}; may be repeated",
        )
    for side in ("right", "left"):
        group.add_argument(
            f"{start}trim-{side}",
            type=float,
            metavar="UM",
            help=f"the {side} trim plane, from the midplane" + " (negative)" * (side == "right"),
        )


def brain_of(name: str, arguments: argparse.Namespace, role: str = "") -> Brain:
    """Return the brain of a name, prepared as the arguments say.

    Raises
    ------
    InputError
        See `brain_files.open_brain`.
    """
    from flyreg_core.brain_files import open_brain
    from flyreg_core.project import Brain

    size = _given(arguments, role, "voxel_size")
    opened = open_brain(
        name, _given(arguments, role, "unit"), None if size is None else (size[0], size[1], size[2])
    )
    if opened.unit_known_by == "judged from the size":
        sys.stderr.write(
            f"flyreg: {name} is taken to be in {opened.unit}, {opened.unit_known_by}\n"
        )
    return prepared_as_told(Brain(opened), arguments, role)


def prepared_as_told(brain: Brain, arguments: argparse.Namespace, role: str = "") -> Brain:
    """Return a brain with all that the arguments say about its preparation; the rest stays."""
    from flyreg_core.brain_files import UM_PER_UNIT
    from flyreg_core.handles import HandleParameters
    from flyreg_core.pose import PoseParameters
    from flyreg_core.simplify import SimplifyParameters
    from flyreg_core.solid import SolidParameters
    from flyreg_core.trim import TrimParameters

    um = UM_PER_UNIT[brain.input.unit]
    hole, closed, drills = (
        _given(arguments, role, option) for option in ("hole", "close", "drill")
    )
    if hole is not None or closed or drills:
        handles = HandleParameters(
            None if hole is None else _scaled(hole, um),
            tuple(_scaled(point, um) for point in closed),
            tuple((_scaled(start, um), _scaled(end, um)) for start, end in drills),
        )
        brain = replace(brain, handles=handles)
    if (pose := _given(arguments, role, "pose")) is not None:
        brain = replace(brain, pose=PoseParameters(pose))
    planes = TrimParameters(
        *(_given(arguments, role, f"trim_{side}") for side in ("right", "left"))
    )
    brain = replace(brain, trim=planes.completed_by(brain.trim))
    if arguments.voxels is not None:
        brain = replace(brain, solid=SolidParameters(arguments.voxels))
    if arguments.vertices is not None:
        brain = replace(brain, simplify=SimplifyParameters(arguments.vertices))
    return brain


def _given(arguments: argparse.Namespace, role: str, option: str) -> Any:
    return getattr(arguments, f"{role}_{option}" if role else option)


def _scaled(point: Point, um: float) -> Point:
    return point[0] * um, point[1] * um, point[2] * um


def _point(text: str) -> Point:
    """Return three numbers with commas between them."""
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError as error:
        raise argparse.ArgumentTypeError(
            f"a place is three numbers with commas between them, such as 320,140,55, not {text}"
        ) from error
    return x, y, z


def _points(text: str) -> tuple[Point, Point]:
    """Return two places with a colon between them."""
    parts = text.split(":")
    if len(parts) != 2:
        raise argparse.ArgumentTypeError(
            f"a channel is two places with a colon between them, such as 1,2,3:4,5,6, not {text}"
        )
    return _point(parts[0]), _point(parts[1])
