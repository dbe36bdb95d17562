"""A project as a program, and as a command."""

from __future__ import annotations

import os
import shlex
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings

from flyreg_core.arguments import make_parser
from flyreg_core.cli import _COMMANDS
from flyreg_core.project import Project
from flyreg_core.script import python_program, register_command
from tests.core.test_project_file import PROJECT, projects


def project_of(program: str) -> Project:
    """Run a program up to its project."""
    names: dict[str, Project] = {}
    exec(program[: program.index("results =")], names)
    return names["project"]


@settings(deadline=None, max_examples=25)
@given(project=projects())
def test_the_program_holds_the_project_to_the_last_digit(project):
    told = project_of(python_program(project))
    assert told == replace(project, view={}, snapshots={})


def test_the_program_leaves_out_what_is_as_usual_and_keeps_to_the_width():
    program = python_program(PROJECT)
    assert "smoothing=" not in program
    assert "snapshots" not in program
    assert max(map(len, program.splitlines())) < 130
    compile(program, "program", "exec")


@pytest.mark.skipif(os.name == "nt", reason="the quotes of another shell")
def test_the_command_is_one_that_flyreg_understands():
    path = Path("/some where/it's mine.flyreg")
    words = shlex.split(register_command(path))
    arguments = make_parser(dict.fromkeys(_COMMANDS, print)).parse_args(words[1:])
    assert words[0] == "flyreg"
    assert arguments.project == path
