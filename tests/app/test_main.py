import subprocess
import sys

import pytest
from flyreg_gui.main import USAGE_ERROR, Request, main, parse


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["a.ply"], "name two, a source and a target"),
        (["a.ply", "b.ply", "c.ply"], "at most two brains"),
        (["--demo", "a.ply", "b.ply"], "--demo brings its own brains"),
        (["--screenshot", "x.png"], "--screenshot needs something to show"),
        (["--source-unit", "inch", "a.ply", "b.ply"], "invalid choice"),
        (["--frobnicate"], "unrecognized arguments"),
    ],
)
def test_wrong_usage_is_said_in_a_sentence(arguments, sentence, capsys):
    with pytest.raises(SystemExit) as stop:
        main(arguments)
    assert stop.value.code == USAGE_ERROR
    assert sentence in capsys.readouterr().err


def test_the_command_line_is_understood(tmp_path):
    assert parse([]) == Request()
    assert parse(["p.flyreg"]).project.name == "p.flyreg"
    assert parse(["FCWB", "JFRC2", "--target-unit", "nm"]).brains == ("FCWB", "JFRC2")
    assert parse(["--demo", "--screenshot", "x.png"]).demo


def test_help_comes_without_loading_qt_or_vtk():
    script = (
        "import sys\nfrom flyreg_gui.main import main\n"
        "try:\n    main(['--help'])\nexcept SystemExit:\n    pass\n"
        "slow = {'PySide6', 'vtkmodules', 'pyvista', 'numpy'} & set(sys.modules)\n"
        "sys.exit(repr(slow) if slow else 0)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True,
        text=True,
        check=False,
        env={"PYTHONPATH": ":".join(sys.path)},
    )
    assert done.returncode == 0, done.stderr
    assert "Exit status" in done.stdout
