"""The command `flyreg-gui`: what it is asked for, before anything slow is imported."""

from __future__ import annotations

import argparse
import importlib.metadata
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

USAGE_ERROR, INPUT_ERROR, INTERNAL_ERROR = 2, 3, 4
PROJECT_SUFFIX = ".flyreg"
UNITS = ("nm", "um", "mm")


@dataclass(frozen=True)
class Request:
    """What the command line asks for."""

    project: Path | None = None
    brains: tuple[str, str] | None = None
    source_unit: str | None = None
    target_unit: str | None = None
    source_voxel_size: tuple[float, float, float] | None = None
    target_voxel_size: tuple[float, float, float] | None = None
    demo: bool = False
    screenshot: Path | None = None


def main(argv: Sequence[str] | None = None) -> int:
    """Open the window; return 0, or the status that says what went wrong."""
    request = parse(sys.argv[1:] if argv is None else argv)
    from flyreg_gui.application import run

    return run(request)


def parse(argv: Sequence[str]) -> Request:
    """Return what the arguments ask for; ends the program if they make no sense."""
    parser = make_parser()
    arguments = parser.parse_args(argv)
    inputs: list[str] = arguments.inputs
    project, brains = None, None
    if arguments.demo and inputs:
        parser.error("--demo brings its own brains; leave out either it or the files")
    if len(inputs) == 1:
        project = Path(inputs[0])
        if project.suffix != PROJECT_SUFFIX:
            parser.error(
                f"{inputs[0]} is no project (*{PROJECT_SUFFIX}); to register brains name two, "
                "a source and a target"
            )
    elif len(inputs) == 2:
        brains = (inputs[0], inputs[1])
    elif inputs:
        parser.error(f"at most two brains can be opened, not {len(inputs)}")
    if arguments.screenshot and not (inputs or arguments.demo):
        parser.error("--screenshot needs something to show: brains, a project, or --demo")
    return Request(
        project,
        brains,
        arguments.source_unit,
        arguments.target_unit,
        _voxel_size(arguments.source_voxel_size),
        _voxel_size(arguments.target_voxel_size),
        arguments.demo,
        arguments.screenshot,
    )


def _voxel_size(edges: list[float] | None) -> tuple[float, float, float] | None:
    return None if edges is None else (edges[0], edges[1], edges[2])


def make_parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(
        prog="flyreg-gui",
        description="Register one fly brain surface to another, and see what landmarks do.",
        epilog="Exit status: 0 done, 2 wrong usage, 3 the input cannot be used, 4 internal error.",
    )
    parser.add_argument(
        "inputs",
        nargs="*",
        metavar="PROJECT | SOURCE TARGET",
        help="a project file, or two brains: files (meshes, point clouds, label volumes) or labels "
        "of flybrains templates",
    )
    parser.add_argument("--demo", action="store_true", help="open a made-up pair of brains")
    parser.add_argument(
        "--screenshot",
        type=Path,
        metavar="FILE",
        help="register, write a picture (PNG) of the whole window, and end",
    )
    for role in ("source", "target"):
        parser.add_argument(f"--{role}-unit", choices=UNITS, help=f"the unit of the {role}'s file")
        parser.add_argument(
            f"--{role}-voxel-size",
            type=float,
            nargs=3,
            metavar=("X", "Y", "Z"),
            help=f"edges of a voxel of the {role} in micrometres, if it is a label volume",
        )
    parser.add_argument("--version", action="version", version=f"%(prog)s {_version()}")
    return parser


def _version() -> str:
    try:
        return importlib.metadata.version("flyreg")
    except importlib.metadata.PackageNotFoundError:
        return "(not installed)"
