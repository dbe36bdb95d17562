"""What can be given to the `flyreg` command."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from flyreg_core.brain_options import UNITS, add_brain_options

AUTOMATIC = "auto"
"""Says that the program is to choose the smoothing."""
Run = Callable[[argparse.Namespace], None]
if TYPE_CHECKING:  # what `add_subparsers` returns has no public name
    Commands = argparse._SubParsersAction[argparse.ArgumentParser]


def make_parser(run: Mapping[str, Run]) -> argparse.ArgumentParser:
    """Return the parser; `run` gives the function for each command's name."""
    parser = argparse.ArgumentParser(
        prog="flyreg",
        description="Lay the surface of one fly brain on another.",
        epilog="A BRAIN is a file of a mesh, points or labels, or the name of a template such as JFRC2.",
    )
    parser.add_argument(
        "--version", action=_ShowVersion, nargs=0, help="print the version and stop"
    )
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    _add_inspect(commands, run)
    _add_prepare(commands, run)
    _add_curves(commands, run)
    _add_register(commands, run)
    _add_transform(commands, run)
    _add_distance(commands, run)
    _add_compare(commands, run)
    return parser


class _ShowVersion(argparse.Action):
    """Look the version up only when it is asked for."""

    def __call__(self, *_: object, **__: object) -> None:
        from flyreg_core.project_file import program_version

        sys.stdout.write(f"flyreg {program_version()}\n")
        sys.exit(0)


def _add_command(
    commands: Commands,
    name: str,
    run: Run,
    summary: str,
) -> argparse.ArgumentParser:
    command = commands.add_parser(name, help=summary, description=summary)
    command.set_defaults(run=run)
    command.add_argument("--json", action="store_true", help="print one JSON object on stdout")
    return command


def _add_preparation(command: argparse.ArgumentParser) -> None:
    command.add_argument("brain", metavar="BRAIN")
    command.add_argument("--voxels", type=int, metavar="N", help="voxels from dorsal to ventral")
    command.add_argument("--vertices", type=int, metavar="N", help="simplify to N vertices")
    add_brain_options(command)


def _add_sizes(command: argparse.ArgumentParser) -> None:
    command.add_argument("--voxels", type=int, metavar="N", help="voxels from dorsal to ventral")
    command.add_argument(
        "--vertices",
        type=int,
        metavar="N",
        help="of both brains: simplify to N, or add vertices up to N where the other brain asks for them",
    )


def _add_inspect(commands: Commands, run: Mapping[str, Run]) -> None:
    command = _add_command(commands, "inspect", run["inspect"], "Say what a brain is.")
    _add_preparation(command)


def _add_prepare(commands: Commands, run: Mapping[str, Run]) -> None:
    command = _add_command(
        commands,
        "prepare",
        run["prepare"],
        "Write the main brain: closed, one component, one handle.",
    )
    command.add_argument("-o", "--output", required=True, type=Path, metavar="OUT.ply")
    _add_preparation(command)


def _add_curves(commands: Commands, run: Mapping[str, Run]) -> None:
    command = _add_command(
        commands,
        "curves",
        run["curves"],
        "Tell what simplifying and smoothing cost a brain's shape.",
    )
    command.add_argument("-o", "--output", type=Path, metavar="OUT.svg", help="draw them too")
    _add_preparation(command)


def _add_register(commands: Commands, run: Mapping[str, Run]) -> None:
    command = _add_command(commands, "register", run["register"], "Lay the source on the target.")
    command.add_argument("source", nargs="?", metavar="SOURCE")
    command.add_argument("target", nargs="?", metavar="TARGET")
    command.add_argument("-o", "--output", required=True, type=Path, metavar="DIR")
    command.add_argument("--project", type=Path, metavar="P.flyreg", help="repeat a saved project")
    command.add_argument("--landmarks", type=Path, metavar="FILE", help="landmark pairs to use too")
    command.add_argument(
        "--smoothing",
        type=_smoothing,
        metavar="X",
        help="lambda of the spline (default 0.01), or auto: the one that cross-validation speaks for, "
        "if it does",
    )
    command.add_argument(
        "--method",
        choices=("shape", "paper"),
        default="shape",
        help="paper: each brain by itself, nearest boundary vertices, averaging passes",
    )
    command.add_argument(
        "--pairing",
        choices=("shape", "coordinate", "arc length", "nearest"),
        help="what tells which places belong together (default shape; the paper: nearest)",
    )
    _add_sizes(command)
    command.add_argument("--smoothing-passes", type=int, metavar="N", help="default 500")
    command.add_argument(
        "--flattening-passes", type=int, metavar="N", help="average N times instead of solving"
    )
    _add_points(command)
    add_brain_options(command, "source")
    add_brain_options(command, "target")


def _add_points(command: argparse.ArgumentParser) -> None:
    """Let points be named on which the target registration error is measured."""
    command.add_argument(
        "--points",
        type=Path,
        metavar="TRUTH.csv",
        help="points x,y,z of the source and where they belong: x_target,y_target,z_target",
    )
    command.add_argument("--unit", choices=UNITS, help="unit of the points, if not their brains'")


def _smoothing(text: str) -> float | str:
    return text if text == AUTOMATIC else float(text)


def _add_transform(commands: Commands, run: Mapping[str, Run]) -> None:
    command = _add_command(
        commands, "transform", run["transform"], "Carry points near one surface to the other."
    )
    command.add_argument("project", type=Path, metavar="P.flyreg")
    command.add_argument("points", type=Path, metavar="POINTS.csv")
    command.add_argument("-o", "--output", required=True, type=Path, metavar="OUT.csv")
    command.add_argument("--inverse", action="store_true", help="from the target to the source")
    command.add_argument("--unit", choices=UNITS, help="unit of the points, if not their brain's")
    command.add_argument("--reach", type=float, metavar="UM", help="farthest distance, default 10")


def _add_distance(commands: Commands, run: Mapping[str, Run]) -> None:
    command = _add_command(
        commands, "distance", run["distance"], "Measure how far surfaces are apart."
    )
    command.add_argument("a", metavar="A")
    command.add_argument("b", metavar="B")
    command.add_argument("--unit", choices=UNITS, help="unit of both, if it is not judged right")
    command.add_argument(
        "--voxel-size",
        nargs=3,
        type=float,
        metavar=("X", "Y", "Z"),
        help="edges of a voxel, um: distances are told in voxels too; volumes may know their own",
    )


def _add_compare(commands: Commands, run: Mapping[str, Run]) -> None:
    command = _add_command(
        commands, "compare", run["compare"], "Lay the source on the target by several methods."
    )
    command.add_argument("source", metavar="SOURCE")
    command.add_argument("target", metavar="TARGET")
    command.add_argument(
        "--methods",
        type=_methods,
        metavar="NAMES",
        help="with commas between them, such as none,icp,flyreg (default: all)",
    )
    _add_points(command)
    command.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="DIR",
        help="write the table, all moved meshes and pictures of them",
    )
    command.add_argument(
        "--time-limit", type=float, default=60.0, metavar="S", help="of each rival, default 60"
    )
    command.add_argument(
        "--memory-limit", type=float, default=3000.0, metavar="MB", help="likewise, default 3000"
    )
    _add_sizes(command)
    add_brain_options(command, "source")
    add_brain_options(command, "target")


def _methods(text: str) -> tuple[str, ...]:
    from flyreg_core.comparison import find_methods
    from flyreg_core.errors import FlyregError

    try:
        return find_methods([name.strip() for name in text.split(",")])
    except FlyregError as error:
        raise argparse.ArgumentTypeError(str(error)) from error
