"""The environment is made once, completed when it lacks something, rebuilt when it cannot serve."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import environment
import programs
import pytest


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where the environment of a test goes."""
    place = tmp_path / "environment"
    monkeypatch.setenv("FLYREG_ENVIRONMENT", str(place))
    return place


@pytest.fixture
def commands(folder: Path, monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """The commands that set-up runs; making a virtual environment only makes its outline."""
    given: list[list[str]] = []

    def run_quietly(command: list[str | Path], **_options: object) -> bool:
        given.append([str(word) for word in command])
        if "venv" in given[-1]:
            python = environment.Environment().program("python")
            python.parent.mkdir()
            python.touch()
            (folder / "pyvenv.cfg").write_text(f"home = {Path(sys.executable).parent}\n")
        return True

    monkeypatch.setattr(environment, "run_quietly", run_quietly)
    return given


def kinds(commands: list[list[str]]) -> list[str]:
    """Name the modules that were run: venv or pip."""
    return [command[command.index("-m") + 1] for command in commands]


def test_the_first_call_makes_the_environment_and_the_second_does_nothing(
    folder: Path, commands: list[list[str]]
) -> None:
    environment.set_up("templates")
    assert kinds(commands)[:2] == ["venv", "pip"]
    assert ".[templates]" in commands[1]
    commands.clear()
    assert environment.set_up("templates").folder == folder
    assert commands == []


def test_a_second_extra_is_added_and_the_first_stays(commands: list[list[str]]) -> None:
    environment.set_up("templates")
    commands.clear()
    environment.set_up("test")
    assert "venv" not in kinds(commands)
    assert ".[templates,test]" in commands[0]
    commands.clear()
    environment.set_up("templates")
    assert commands == []


def test_changed_dependencies_are_installed(
    commands: list[list[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    environment.set_up("test")
    commands.clear()
    monkeypatch.setattr(environment, "_packages_digest", lambda: "another")
    environment.set_up("test")
    assert set(kinds(commands)) == {"pip"}


def test_an_interrupted_set_up_is_done_again_from_the_start(
    folder: Path, commands: list[list[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(*_arguments: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(environment, "_install", interrupt)
        with pytest.raises(KeyboardInterrupt):
            environment.set_up("test")
    (folder / "half a package").touch()
    commands.clear()
    environment.set_up("test")
    assert kinds(commands)[:2] == ["venv", "pip"]
    assert not (folder / "half a package").exists()


def test_an_environment_is_made_again_when_the_checkout_has_moved(
    commands: list[list[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    environment.set_up("test")
    commands.clear()
    made_for = {**environment._made_for(), "checkout": "/somewhere/else"}
    monkeypatch.setattr(environment, "_made_for", lambda: made_for)
    environment.set_up("test")
    assert kinds(commands)[0] == "venv"


def test_an_environment_is_made_again_when_its_python_is_gone(
    folder: Path, commands: list[list[str]]
) -> None:
    environment.set_up("test")
    commands.clear()
    (folder / "pyvenv.cfg").write_text(f"home = {folder / 'removed'}\n")
    environment.set_up("test")
    assert kinds(commands)[0] == "venv"


def test_a_folder_made_by_something_else_is_left_alone(
    folder: Path, commands: list[list[str]]
) -> None:
    folder.mkdir()
    (folder / "thesis.txt").touch()
    with pytest.raises(programs.SetUpError, match="was made by something else"):
        environment.set_up("test")
    assert (folder / "thesis.txt").exists()
    assert commands == []


def test_a_place_that_cannot_be_written_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("FLYREG_ENVIRONMENT", str(tmp_path / "file" / "environment"))
    with pytest.raises(programs.SetUpError, match=r"cannot be written.*FLYREG_ENVIRONMENT"):
        environment.set_up("test")


def test_what_pip_says_last_is_shown_when_it_fails(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(environment, "CHECKOUT", Path(__file__).parent)
    with pytest.raises(programs.SetUpError, match="pip's last words are above"):
        environment._install(Path(sys.executable), ["--no-index", "no-such-package-as-this"])
    assert "no-such-package-as-this" in capfd.readouterr().err


@pytest.fixture
def display() -> Iterator[dict[str, str]]:
    """A private display, on the system that has such."""
    if not sys.platform.startswith("linux"):
        pytest.skip("only Linux has displays of this kind")
    with environment.private_display() as variables:
        yield variables


@pytest.mark.window
def test_two_private_displays_do_not_meet(display: dict[str, str]) -> None:
    with environment.private_display() as other:
        assert other["DISPLAY"] != display["DISPLAY"]


@pytest.mark.window
@pytest.mark.usefixtures("display")
def test_a_private_display_ends_with_its_block() -> None:
    with environment.private_display() as other:
        socket = Path("/tmp/.X11-unix") / f"X{other['DISPLAY'][1:]}"
        assert socket.exists()
    assert not socket.exists()


@pytest.mark.window
@pytest.mark.usefixtures("display")
def test_a_display_counts_only_while_it_answers(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with environment.private_display() as other:
        monkeypatch.setenv("DISPLAY", f"{other['DISPLAY']}.0")
        assert environment.has_display()
    assert not environment.has_display()
    assert f"no display answers at DISPLAY={other['DISPLAY']}" in capsys.readouterr().err


@pytest.mark.parametrize("display", ["nonsense", ":", "localhost:"])
def test_a_display_without_a_number_does_not_answer(display: str) -> None:
    assert not environment._answers(display)


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such signals")
@pytest.mark.parametrize(("number", "status"), [(2, 130), (15, 143)])
def test_a_signal_ends_the_program_and_what_it_runs_without_a_traceback(
    number: int, status: int
) -> None:
    folder = Path(environment.__file__).parent
    sleeper = "print('started', flush=True); import time; time.sleep(60)"
    # a shell that runs the tests in the background has its programs ignore Ctrl-C
    code = (
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); "
        f"import sys; sys.path.insert(0, {str(folder)!r}); import programs; "
        f"run = lambda _: programs.run([sys.executable, '-c', {sleeper!r}]); "
        "sys.exit(programs.run_to_exit_status(run))"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline().strip() == b"started"
        process.send_signal(number)
        _, errors = process.communicate(timeout=10)
    assert process.returncode == status
    assert errors == b""


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such signals")
def test_a_signal_that_comes_while_a_program_is_being_started_ends_that_program_too(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    started = []

    class Interrupted(subprocess.Popen):  # type: ignore[type-arg]
        def __init__(self, *arguments: object, **named: object) -> None:
            super().__init__(*arguments, **named)  # type: ignore[call-overload]
            started.append(self)
            signal.raise_signal(signal.SIGINT)

    handler = signal.signal(signal.SIGINT, signal.default_int_handler)
    monkeypatch.setattr(programs.subprocess, "Popen", Interrupted)
    try:
        with pytest.raises(KeyboardInterrupt):
            programs.run([sys.executable, "-c", "import time; time.sleep(60)"])
    finally:
        signal.signal(signal.SIGINT, handler)
    (process,) = started
    assert process.poll() is not None
