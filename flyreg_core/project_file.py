"""Project files (.flyreg): what the user decided, as JSON that people can read and compare."""

from __future__ import annotations

import importlib.metadata
import json
import math
import os
import types
from collections.abc import Callable, Mapping
from dataclasses import MISSING, fields, is_dataclass
from pathlib import Path
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from flyreg_core.errors import FlyregError, LandmarkError, ProjectError
from flyreg_core.files import read_text, write_atomically
from flyreg_core.project import BrainInput, Project
from flyreg_core.templates import template_file

FORMAT = 4
"""Version of the layout; raised whenever a file of it could not be read by the version before."""

UPGRADES: Mapping[int, Callable[[dict[str, Any]], dict[str, Any]]] = {
    1: dict,  # format 2 adds what kind of input a brain is; without it, it is a surface
    2: dict,  # format 3 adds pairing by shape; what a project says about pairing stays
    3: dict,  # format 4 adds mute, solo, colours, neuropils and snapshots; none before
}
"""For each older format, what turns the content of a file of it into that of the next format."""

RELATIVE_PATH = "relative_path"
"""Where a brain's file lies as seen from the project file, so that both can be moved together."""


def save_project(
    project: Project, path: Path, notes: Mapping[str, str | None] | None = None
) -> None:
    """Write a project, whole or not at all; equal projects give equal files.

    Parameters
    ----------
    notes : mapping from str to str or None, optional
        What a program says beside the project, for `read_notes`; `load_project` passes over it.

    Raises
    ------
    InputError
        The file cannot be written (see `files.write_atomically`).
    ProjectError
        Something in it has no place in JSON, such as an infinite number.
    """
    content: dict[str, Any] = {
        "flyreg": {"format": FORMAT, "program": program_version()},
        "project": _encode(project, path.resolve().parent),
    }
    if notes is not None:
        content["notes"] = dict(notes)
    try:
        text = json.dumps(content, sort_keys=True, indent=2, ensure_ascii=False, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise ProjectError(f"the project cannot be saved: {error}") from error
    # a file name that is no valid text, as Linux allows, becomes an escape that JSON knows
    write_atomically(path, (text + "\n").encode("utf-8", "backslashreplace"))


def load_project(path: Path) -> Project:
    """Return the project in a file; equal to the one that was saved if no brain has moved.

    A brain's file that is no longer where it was is looked for at its place relative to the
    project file, and a template where the package is now. Whether the brains' files are there and
    unchanged is seen when they are read.

    Raises
    ------
    InputError
        The file is missing, empty or not text.
    ProjectError, LandmarkError
        It is of a newer version, damaged, or says something impossible; the message says where.
    """
    try:
        content = json.loads(read_text(path))
    except (ValueError, RecursionError) as error:
        raise ProjectError(f"{path} is damaged ({error}); open a copy of it") from error
    content = _upgraded(content, path)
    try:
        project = _decode(content.get("project"), Project, "project", path.resolve().parent)
        return _named_once(project)
    except FlyregError as error:
        raise type(error)(f"{path} cannot be used: {error}") from error


def read_notes(path: Path) -> dict[str, str | None]:
    """Return what a program said beside the project when it saved it; nothing if it said nothing.

    Raises
    ------
    InputError, ProjectError
        The file is missing, empty or damaged.
    """
    try:
        content = json.loads(read_text(path))
    except (ValueError, RecursionError) as error:
        raise ProjectError(f"{path} is damaged ({error}); open a copy of it") from error
    notes = content.get("notes") if isinstance(content, dict) else None
    notes = notes if isinstance(notes, dict) else {}
    return {
        str(key): value for key, value in notes.items() if value is None or isinstance(value, str)
    }


def _upgraded(content: Any, path: Path) -> dict[str, Any]:
    about = content.get("flyreg") if isinstance(content, dict) else None
    about = about if isinstance(about, dict) else {}
    version = about.get("format")
    if type(version) is not int:
        raise ProjectError(f"{path} is no flyreg project: it does not say which format it has")
    if version > FORMAT:
        raise ProjectError(
            f"{path} is from a newer flyreg ({about.get('program')}, format {version}); this one "
            f"reads formats up to {FORMAT}, so update flyreg"
        )
    for older in range(version, FORMAT):
        if older not in UPGRADES:
            raise ProjectError(f"{path} has the unknown format {version}")
        content = UPGRADES[older](content)
    return dict(content)


def _named_once(project: Project) -> Project:
    for what in ("id", "name"):
        used = [getattr(pair, what) for pair in project.pairs]
        if twice := sorted({text for text in used if used.count(text) > 1}):
            raise LandmarkError(f"the landmark {what} {twice[0]} is used twice in project.pairs")
    return project


def program_version() -> str:
    """Return the installed version of the program."""
    try:
        return importlib.metadata.version("flyreg")
    except importlib.metadata.PackageNotFoundError:  # run from a checkout
        return "unknown"


def _encode(value: Any, folder: Path) -> Any:
    if is_dataclass(value):
        content = {f.name: _encode(getattr(value, f.name), folder) for f in fields(value)}
        if isinstance(value, BrainInput):
            content[RELATIVE_PATH] = _relative(value.path, folder)
        return content
    if isinstance(value, Mapping):
        return {key: _encode(item, folder) for key, item in value.items()}
    if isinstance(value, (tuple, list)):
        return [_encode(item, folder) for item in value]
    return value


def _relative(path: str, folder: Path) -> str | None:
    try:
        return Path(os.path.relpath(path, folder)).as_posix()
    except ValueError:  # on another drive
        return None


def _decode(value: Any, kind: Any, place: str, folder: Path) -> Any:
    """Return a JSON value as a value of a type, or say in which place it is not one."""
    origin, arguments = get_origin(kind), get_args(kind)
    if is_dataclass(kind):
        return _decode_dataclass(value, kind, place, folder)
    if origin in (Union, types.UnionType):
        return _decode_union(value, arguments, place, folder)
    if origin is Literal:
        if value not in arguments or isinstance(value, bool):
            raise ProjectError(f"{place} must be one of {_listed(arguments)}, not {_shown(value)}")
        return value
    if origin is tuple:
        return _decode_tuple(value, arguments, place, folder)
    if origin is not None and issubclass(origin, Mapping):
        _require(isinstance(value, dict), "names with values", value, place)
        return {
            key: _decode(item, arguments[1], f"{place}.{key}", folder)
            for key, item in value.items()
        }
    if kind is float:
        return _decode_float(value, place)
    if kind is object:
        return _frozen(value)
    _require(type(value) is kind, _WORDS.get(kind, str(kind)), value, place)
    return value


_WORDS = {str: "a text", int: "a whole number", bool: "true or false", types.NoneType: "nothing"}


def _decode_dataclass(value: Any, kind: Any, place: str, folder: Path) -> Any:
    _require(isinstance(value, dict), "names with values", value, place)
    hints = get_type_hints(kind)
    content = dict(value)
    if kind is BrainInput:
        content = _with_present_path(content, folder)
    if unknown := sorted(content.keys() - hints.keys()):
        raise ProjectError(f"{place} has the unknown entry {unknown[0]}; delete it")
    for field in fields(kind):
        is_needed = field.default is MISSING and field.default_factory is MISSING
        if is_needed and field.name not in content:
            raise ProjectError(f"{place} lacks the entry {field.name}")
    decoded = {
        name: _decode(item, hints[name], f"{place}.{name}", folder)
        for name, item in content.items()
    }
    try:
        return kind(**decoded)
    except FlyregError as error:
        raise type(error)(f"{error} (in {place})") from error


def _with_present_path(content: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Return a brain's input with the first of its possible places where there is a file."""
    relative, path, name = (content.get(key) for key in (RELATIVE_PATH, "path", "name"))
    places = [Path(path)] if isinstance(path, str) else []
    if isinstance(relative, str):
        places.append(Path(os.path.normpath(folder / relative)))
    if isinstance(name, str) and (template := template_file(name)):
        places.append(template)
    present = next((str(place) for place in places if place.is_file()), path)
    kept = {key: item for key, item in content.items() if key != RELATIVE_PATH}
    return kept | ({"path": present} if "path" in kept else {})


def _decode_union(value: Any, kinds: tuple[Any, ...], place: str, folder: Path) -> Any:
    if value is None and types.NoneType in kinds:
        return None
    lists = [kind for kind in kinds if get_origin(kind) is tuple]
    others = [kind for kind in kinds if kind not in (*lists, types.NoneType)]
    kind = lists[0] if lists and (isinstance(value, list) or not others) else others[0]
    return _decode(value, kind, place, folder)


def _decode_tuple(value: Any, kinds: tuple[Any, ...], place: str, folder: Path) -> Any:
    _require(isinstance(value, list), "a list", value, place)
    if kinds[1:] == (...,):
        kinds = kinds[:1] * len(value)
    _require(len(value) == len(kinds), f"a list of {len(kinds)}", value, place)
    return tuple(
        _decode(item, kind, f"{place}[{index}]", folder)
        for index, (item, kind) in enumerate(zip(value, kinds, strict=True))
    )


def _decode_float(value: Any, place: str) -> float:
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    _require(is_number, "a number", value, place)
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    _require(math.isfinite(number), "a finite number", value, place)
    return number


def _frozen(value: Any) -> Any:
    """Return free-form content as values that cannot change: lists become tuples."""
    if isinstance(value, dict):
        return {key: _frozen(item) for key, item in value.items()}
    return tuple(map(_frozen, value)) if isinstance(value, list) else value


def _require(is_right: bool, wanted: str, value: Any, place: str) -> None:
    if not is_right:
        raise ProjectError(f"{place} must be {wanted}, not {_shown(value)}")


def _shown(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 40 else text[:37] + "..."


def _listed(values: tuple[Any, ...]) -> str:
    return ", ".join(map(str, values))
