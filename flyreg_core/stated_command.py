"""A project as the options of `flyreg register`, without a project file, where they can say it."""

from __future__ import annotations

from collections.abc import Sequence

from flyreg_core.brain_files import UM_PER_UNIT
from flyreg_core.cut_height import CutParameters
from flyreg_core.flatten import FlattenParameters
from flyreg_core.handles import Point
from flyreg_core.landmarks import LandmarkParameters
from flyreg_core.project import Brain, BrainInput, Project, Role
from flyreg_core.simplify import SimplifyParameters
from flyreg_core.smooth import SmoothParameters
from flyreg_core.solid import SolidParameters
from flyreg_core.templates import template_labels

ROLES: tuple[Role, Role] = ("source", "target")


def only_in_a_file(project: Project) -> list[str]:
    """Return what of a project no option of `flyreg register` can say, for people."""
    brains = (project.source, project.target)
    source, target = brains
    found = {
        "landmarks of your own": project.pairs,
        "weights": project.weights,
        "moved landmarks": project.moved,
        "muted or soloed landmarks": project.muted or project.solo,
        "the numbers of landmarks": (
            project.boundary != LandmarkParameters(pairing=project.boundary.pairing)
        ),
        "moved cuts": any(brain.cut != CutParameters() for brain in brains),
        "the places of tunnels": any(not _is_sayable(brain) for brain in brains),
        "preparation settings that differ between the brains": (
            (source.solid, source.simplify, source.smooth, source.flatten)
            != (target.solid, target.simplify, target.smooth, target.flatten)
        ),
        "the rounds of flattening": any(
            brain.flatten != FlattenParameters(brain.flatten.passes) for brain in brains
        ),
    }
    return [what for what, is_there in found.items() if is_there]


def stated_words(project: Project, folder: str = "registered") -> list[str]:
    """Return the words of the command that registers a project, if nothing is `only_in_a_file`."""
    brain, words = project.source, ["flyreg", "register"]
    words += [_name_of(each.input) for each in (project.source, project.target)]
    words += ["-o", folder]
    for role in ROLES:
        words += _about(role, project.source if role == "source" else project.target)
    for option, value, usual in (
        ("voxels", brain.solid.voxels_across, SolidParameters().voxels_across),
        ("vertices", brain.simplify.vertices, SimplifyParameters().vertices),
        ("smoothing-passes", brain.smooth.passes, SmoothParameters().passes),
        ("flattening-passes", brain.flatten.passes, FlattenParameters().passes),
        ("pairing", project.boundary.pairing, LandmarkParameters().pairing),
        ("smoothing", float(project.smoothing), 1e-2),
    ):
        if value != usual:
            words.append(f"--{option}={value if isinstance(value, str) else repr(value)}")
    return words


def _about(role: Role, brain: Brain) -> list[str]:
    """Return the options about one brain."""
    opened, handles = brain.input, brain.handles
    um = UM_PER_UNIT[opened.unit]
    words = []
    if not _is_template(opened):  # said, not judged, so that it is the same everywhere
        words.append(f"--{role}-unit={opened.unit}")
    if opened.voxel_size_um is not None:
        words += [f"--{role}-voxel-size", *map(repr, opened.voxel_size_um)]
    if brain.pose.axes is not None:
        words.append(f"--{role}-pose={brain.pose.axes}")
    if handles.hole is not None:
        words.append(f"--{role}-hole={_in_unit(handles.hole, um)}")
    words += [f"--{role}-close={_in_unit(point, um)}" for point in handles.closed]
    words += [
        f"--{role}-drill={_in_unit(start, um)}:{_in_unit(end, um)}" for start, end in handles.drills
    ]
    for side in ("right", "left"):
        if (place := getattr(brain.trim, side)) is not None:
            words.append(f"--{role}-trim-{side}={float(place)!r}")
    return words


def _is_template(opened: BrainInput) -> bool:
    return opened.name in template_labels()


def _name_of(opened: BrainInput) -> str:
    return opened.name if _is_template(opened) else opened.path


def _in_unit(point: Point, um: float) -> str:
    return ",".join(repr(float(value) / um) for value in point)


def _is_sayable(brain: Brain) -> bool:
    """Tell whether the places of tunnels are the same to the last bit when read in the file's unit."""
    um, handles = UM_PER_UNIT[brain.input.unit], brain.handles
    points: Sequence[Point] = (
        *((handles.hole,) if handles.hole is not None else ()),
        *handles.closed,
        *(end for drill in handles.drills for end in drill),
    )
    return all(float(value) / um * um == value for point in points for value in point)
