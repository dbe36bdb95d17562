"""A project as text that repeats it: a Python program, or a command for the shell."""

from __future__ import annotations

import os
import shlex
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, Field, fields, is_dataclass, replace
from pathlib import Path
from typing import Any

from flyreg_core.project import Project

WIDTH = 88
"""Longer values are written over several lines."""
PROGRAM = '''"""Repeats a registration of flyreg."""

from pathlib import Path

{imports}
from flyreg_core.cache import open_cache
from flyreg_core.pipeline import Pipeline
from flyreg_core.report import write_registered

project = {project}

results = Pipeline(open_cache()).run(project)
registered = results.registration.surface  # vertices (n, 3) in micrometres, faces (m, 3)
write_registered(Path("registered.ply"), results)
'''


def python_program(project: Project) -> str:
    """Return a Python program that runs a project and writes `registered.ply`.

    It needs no project file: every decision that differs from the usual one is written out, numbers
    to the last digit, so the vertices are the same to the last bit. What concerns only the window
    (the view, snapshots) is left out.
    """
    told = replace(project, view={}, snapshots={})
    used: set[type] = set()
    expression = _expression(told, used, 0)
    modules: dict[str, list[str]] = {}
    for kind in used:
        modules.setdefault(kind.__module__, []).append(kind.__name__)
    imports = "\n".join(
        f"from {module} import {', '.join(sorted(names))}"
        for module, names in sorted(modules.items())
    )
    return PROGRAM.format(imports=imports, project=expression)


def register_command(project_file: Path, folder: str = "registered") -> str:
    """Return the command that registers a saved project, quoted for the shell of this system."""
    return quoted(["flyreg", "register", "--project", str(project_file), "-o", folder])


def quoted(words: Sequence[str]) -> str:
    """Return the words of a command, quoted for the shell of this system."""
    return subprocess.list2cmdline(words) if os.name == "nt" else shlex.join(words)


def _expression(value: Any, used: set[type], depth: int) -> str:
    """Return a value as Python writes it; dataclasses without what is as usual."""
    if is_dataclass(value) and not isinstance(value, type):
        used.add(type(value))
        told = [f for f in fields(value) if not _is_usual(f, getattr(value, f.name))]
        parts = [f"{f.name}={_expression(getattr(value, f.name), used, depth + 1)}" for f in told]
        return _joined(f"{type(value).__name__}(", parts, ")", depth)
    if isinstance(value, Mapping):
        pairs = [f"{key!r}: {_expression(item, used, depth + 1)}" for key, item in value.items()]
        return _joined("{", pairs, "}", depth)
    if isinstance(value, tuple):
        parts = [_expression(item, used, depth + 1) for item in value]
        return _joined("(", parts, ",)" if len(parts) == 1 else ")", depth)
    return repr(value)


def _is_usual(field: Field[Any], value: object) -> bool:
    if field.default is not MISSING:
        return bool(field.default == value)
    return field.default_factory is not MISSING and field.default_factory() == value


def _joined(start: str, parts: list[str], end: str, depth: int) -> str:
    line = start + ", ".join(parts) + end
    if len(line) + 4 * depth <= WIDTH and "\n" not in line:
        return line
    inner = "    " * (depth + 1)
    text = "".join(f"{inner}{part},\n" for part in parts)
    return f"{start}\n{text}{'    ' * depth}{end.lstrip(',')}"
