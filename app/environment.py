"""Set up what flyreg needs on this machine, and run programs there.

``python3 app`` and ``python3 tests`` start here, before anything is installed: this module uses
nothing but the standard library.  Three things may be missing, and each is looked for, not guessed
from the name of the system:

* Python packages: they go into a virtual environment, ``.venv`` in the checkout or the folder that
  FLYREG_ENVIRONMENT names.  A record in it tells what it was made for, and whether it was finished.
* System libraries that a window needs on Linux.
* A display: :func:`private_display` starts one that nobody sees (Xvfb).

System packages are installed only where that is possible without asking: by apt, as root or by a
sudo that wants no password.  Otherwise a :class:`SetUpError` tells the user what to install.
"""

from __future__ import annotations

import contextlib
import ctypes
import hashlib
import json
import os
import platform
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import FrameType

CHECKOUT = Path(__file__).resolve().parent.parent
OLDEST_PYTHON = (3, 11)
RECORD_NAME = "flyreg-environment.json"
SET_UP_FAILED = 3
INTERRUPTED = 130

SECONDS_TO_END = 0.2
SECONDS_TO_REPORT = 0.5
SECONDS_FOR_DISPLAY = 30.0

XVFB = ["Xvfb", "-screen", "0", "1600x1000x24", "+extension", "GLX", "-nolisten", "tcp", "-noreset"]

WINDOW_LIBRARIES = {
    "libEGL.so.1": "libegl1",
    "libGL.so.1": "libgl1",
    "libX11-xcb.so.1": "libx11-xcb1",
    "libX11.so.6": "libx11-6",
    "libdbus-1.so.3": "libdbus-1-3",
    "libfontconfig.so.1": "libfontconfig1",
    "libfreetype.so.6": "libfreetype6",
    "libglib-2.0.so.0": "libglib2.0-0",
    "libgthread-2.0.so.0": "libglib2.0-0",
    "libxcb-cursor.so.0": "libxcb-cursor0",
    "libxcb-glx.so.0": "libxcb-glx0",
    "libxcb-icccm.so.4": "libxcb-icccm4",
    "libxcb-image.so.0": "libxcb-image0",
    "libxcb-keysyms.so.1": "libxcb-keysyms1",
    "libxcb-randr.so.0": "libxcb-randr0",
    "libxcb-render-util.so.0": "libxcb-render-util0",
    "libxcb-render.so.0": "libxcb-render0",
    "libxcb-shape.so.0": "libxcb-shape0",
    "libxcb-shm.so.0": "libxcb-shm0",
    "libxcb-sync.so.1": "libxcb-sync1",
    "libxcb-util.so.1": "libxcb-util1",
    "libxcb-xfixes.so.0": "libxcb-xfixes0",
    "libxcb-xkb.so.1": "libxcb-xkb1",
    "libxcb.so.1": "libxcb1",
    "libxkbcommon-x11.so.0": "libxkbcommon-x11-0",
    "libxkbcommon.so.0": "libxkbcommon0",
}
"""Libraries that Qt and VTK load for a window on Linux, and the Debian packages they are in."""


class SetUpError(Exception):
    """Something that only the user can change; the message is written for the user."""


def say(text: str) -> None:
    """Tell the user on standard error, which leaves standard output to results."""
    print(f"flyreg: {text}", file=sys.stderr, flush=True)


def run_to_exit_status(main: Callable[[list[str]], int]) -> int:
    """Run a program's main function; turn what can stop it into an exit status.

    Parameters
    ----------
    main : callable
        Takes the command line's arguments, returns an exit status.

    Returns
    -------
    int
        What `main` returned, 3 if this machine could not be set up, 130 after Ctrl-C.
    """
    for name in ("SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, _exit_on_signal)
    try:
        _check_python()
        return main(sys.argv[1:])
    except KeyboardInterrupt:
        return INTERRUPTED
    except SetUpError as problem:
        say(str(problem))
        return SET_UP_FAILED


def _exit_on_signal(number: int, _frame: FrameType | None) -> None:
    """Leave through the ``finally`` clauses, which end the programs that were started."""
    raise SystemExit(128 + number)


def _check_python() -> None:
    """Refuse a Python that the packages do not support, before they do so at length."""
    if sys.version_info < OLDEST_PYTHON:
        oldest = ".".join(map(str, OLDEST_PYTHON))
        raise SetUpError(
            f"this is Python {platform.python_version()}, and flyreg needs {oldest} or newer. "
            f"If a newer one is installed, name it: python{oldest} {Path(sys.argv[0]).name}"
        )


# --- Programs -------------------------------------------------------------------------------------


def child_environment(**changes: str) -> dict[str, str]:
    """Copy this process's environment variables, without those that mislead another Python."""
    misleading = ("PYTHONHOME", "PYTHONPATH", "__PYVENV_LAUNCHER__")
    kept = {name: value for name, value in os.environ.items() if name not in misleading}
    return {**kept, **changes}


def run(
    command: list[str | Path],
    variables: dict[str, str] | None = None,
    *,
    folder: Path | None = None,
    interactive: bool = False,
) -> int:
    """Run a program with its output on show; return its exit status.

    Parameters
    ----------
    command : list of str or Path
        The program and its arguments.
    variables : dict, optional
        Environment variables to change.
    folder : Path, optional
        Where it runs; by default in the current folder.
    interactive : bool
        The program may read the keyboard, and is itself told of Ctrl-C by the terminal.  Any other
        program is ended on Ctrl-C without a chance to show how surprised it is.
    """
    process = subprocess.Popen(
        command,
        cwd=folder,
        env=child_environment(**(variables or {})),
        start_new_session=not interactive,
    )
    try:
        status = process.wait()
    except KeyboardInterrupt:
        if interactive:
            _wait(process, SECONDS_TO_REPORT)
        raise
    finally:
        _end(process, whole_session=not interactive)
    return status if status >= 0 else 128 - status


def _wait(process: subprocess.Popen[Any], seconds: float) -> bool:
    """Tell whether a program ends within the given time."""
    try:
        process.wait(seconds)
    except subprocess.TimeoutExpired:
        return False
    return True


def _end(process: subprocess.Popen[Any], *, whole_session: bool = True) -> None:
    """End a program, and all that it started in a session of its own, if it still runs."""
    if process.poll() is not None:
        return
    signals = [signal.SIGTERM, getattr(signal, "SIGKILL", signal.SIGTERM)]
    for number in signals:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            if whole_session and hasattr(os, "killpg"):
                os.killpg(process.pid, number)
            else:
                process.send_signal(number)
        if _wait(process, SECONDS_TO_END):
            return


def run_quietly(command: list[str | Path], *, finish_alone: bool = False) -> bool:
    """Run a program without showing its output, except its last lines if it fails.

    Parameters
    ----------
    command : list of str or Path
        The program and its arguments.
    finish_alone : bool
        On Ctrl-C only ask the program to stop, and leave it to find a safe point by itself.

    Returns
    -------
    bool
        Whether the program's exit status was 0.
    """
    # A file and not a pipe: a program that is left alone must still be able to write.
    with tempfile.TemporaryFile() as output:
        process = subprocess.Popen(
            command,
            cwd=CHECKOUT,
            env=child_environment(PIP_USER="0", PIP_DISABLE_PIP_VERSION_CHECK="1"),
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        try:
            status = process.wait()
        except KeyboardInterrupt:
            if finish_alone:
                with contextlib.suppress(PermissionError):
                    process.send_signal(signal.SIGINT)
            raise
        finally:
            if not finish_alone:
                _end(process)
        if status:
            output.seek(0)
            for line in output.read().decode(errors="replace").splitlines()[-15:]:
                print(f"  {line}", file=sys.stderr)
    return status == 0


# --- System packages ------------------------------------------------------------------------------


def missing_for_python() -> dict[str, str]:
    """Find what this Python lacks to make virtual environments; name it with its Debian package."""
    try:
        import ensurepip  # noqa: F401
        import venv  # noqa: F401
    except ImportError:
        version = ".".join(map(str, sys.version_info[:2]))
        return {f"the modules venv and ensurepip of Python {version}": f"python{version}-venv"}
    return {}


def missing_for_windows(*, private: bool) -> dict[str, str]:
    """Find what a window on Linux lacks; name it with its Debian package.

    Parameters
    ----------
    private : bool
        The window goes to a display that nobody sees.
    """
    if not sys.platform.startswith("linux"):
        return {}
    missing = {name: package for name, package in WINDOW_LIBRARIES.items() if not _loads(name)}
    if private and shutil.which("Xvfb") is None:
        missing["Xvfb"] = "xvfb"
    return missing


def _loads(library: str) -> bool:
    """Tell whether the system finds a shared library."""
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def install_missing(missing: dict[str, str]) -> None:
    """Install system packages, if there are any to install and this user can do so unasked."""
    become_root = _ways_to_become_root()
    if not missing or shutil.which("apt-get") is None or become_root is None:
        return
    packages = sorted(set(missing.values()))
    say(f"installing system packages: {' '.join(packages)}")
    apt: list[str | Path] = [
        *become_root,
        *("env", "DEBIAN_FRONTEND=noninteractive", "NEEDRESTART_MODE=l"),
        *("apt-get", "-q", "-y", "-o", "DPkg::Lock::Timeout=300"),
    ]
    run_quietly([*apt, "update"], finish_alone=True)
    run_quietly([*apt, "install", "--no-install-recommends", *packages], finish_alone=True)


def _ways_to_become_root() -> list[str] | None:
    """Give the words before a command that make it run as root, or None if that needs asking."""
    if not hasattr(os, "geteuid"):
        return None
    if os.geteuid() == 0:
        return []
    if shutil.which("sudo") is None:
        return None
    allowed = subprocess.run(["sudo", "-n", "true"], capture_output=True, check=False)
    return ["sudo", "-n"] if allowed.returncode == 0 else None


def require(purpose: str, missing: dict[str, str]) -> None:
    """Raise a SetUpError that tells what to install, unless nothing is missing."""
    if not missing:
        return
    sentence = f"{purpose} needs what is not installed here: {', '.join(missing)}."
    if shutil.which("apt-get") is None:
        raise SetUpError(f"{sentence} Install it with this system's package manager.")
    packages = " ".join(sorted(set(missing.values())))
    raise SetUpError(
        f"{sentence} Install it with: sudo apt-get install --no-install-recommends {packages}"
    )


def require_window(*, private: bool) -> None:
    """Raise a SetUpError unless a window can be opened, as far as system libraries go."""
    require("a window", missing_for_windows(private=private))


def prepare_system(*, window: bool, private: bool) -> None:
    """Install what is missing on this machine, and insist on what Python itself needs."""
    missing = missing_for_python()
    if window:
        missing |= missing_for_windows(private=private)
    install_missing(missing)
    require("the first start", missing_for_python())


# --- Python packages ------------------------------------------------------------------------------


class Environment:
    """A virtual environment with flyreg in it, and the record of what it was made for.

    Parameters
    ----------
    folder : Path, optional
        Where it is; by default the folder that FLYREG_ENVIRONMENT names, or else ``.venv`` in the
        checkout.
    """

    def __init__(self, folder: Path | None = None) -> None:
        named = os.environ.get("FLYREG_ENVIRONMENT")
        default = Path(named).expanduser() if named else CHECKOUT / ".venv"
        self.folder = (folder or default).absolute()

    def program(self, name: str) -> Path:
        """Give the place of a program in the environment."""
        if os.name == "nt":
            return self.folder / "Scripts" / f"{name}.exe"
        return self.folder / "bin" / name

    def read_record(self) -> dict[str, Any]:
        """Read what the environment was made for; empty if it was not made or is not readable."""
        try:
            record = json.loads((self.folder / RECORD_NAME).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return {}
        return record if isinstance(record, dict) else {}

    def write_record(self, extras: list[str], *, finished: bool) -> None:
        """Write what the environment is made for, and whether it is finished."""
        record = {"made_for": _made_for(), "packages": _packages_digest(), "extras": extras}
        self.folder.mkdir(parents=True, exist_ok=True)
        (self.folder / RECORD_NAME).write_text(
            json.dumps({**record, "finished": finished}, indent=2), encoding="utf-8"
        )

    def is_usable(self) -> bool:
        """Tell whether it was finished once, for this checkout and a Python that is still here."""
        record = self.read_record()
        if not record.get("finished") or record.get("made_for") != _made_for():
            return False
        return self.program("python").exists() and _home_of_python(self.folder).is_dir()

    def has(self, extra: str) -> bool:
        """Tell whether nothing needs to be done before programs with this extra run."""
        record = self.read_record()
        same = record.get("packages") == _packages_digest()
        return same and extra in record.get("extras", []) and self.is_usable()

    def is_foreign(self) -> bool:
        """Tell whether something is there that this program did not make."""
        if not self.folder.exists() or (self.folder / RECORD_NAME).exists():
            return False
        return not self.folder.is_dir() or any(self.folder.iterdir())


def _made_for() -> dict[str, str]:
    """Describe what a virtual environment cannot outlive: its checkout's place and its Python."""
    version = ".".join(map(str, sys.version_info[:2]))
    python = f"{platform.python_implementation()} {version} {platform.machine()}"
    return {"checkout": str(CHECKOUT), "python": python}


def _packages_digest() -> str:
    """Digest the file that says which packages are needed."""
    return hashlib.sha256((CHECKOUT / "pyproject.toml").read_bytes()).hexdigest()


def _home_of_python(folder: Path) -> Path:
    """Give the folder of the Python that a virtual environment was made with."""
    try:
        lines = (folder / "pyvenv.cfg").read_text(encoding="utf-8").splitlines()
    except OSError:
        return folder / "nowhere"
    values = [line.partition("=")[2].strip() for line in lines if line.startswith("home")]
    return Path(values[0]) if values else folder / "nowhere"


def set_up(extra: str) -> Environment:
    """Make the virtual environment, or complete it; do nothing if it is ready.

    Parameters
    ----------
    extra : str
        The group of optional dependencies in pyproject.toml to install.

    Returns
    -------
    Environment
        The environment, ready for use.

    Raises
    ------
    SetUpError
        The folder cannot be used, or pip failed.
    """
    environment = Environment()
    if environment.has(extra):
        return environment
    try:
        with _one_at_a_time(environment.folder):
            if not environment.has(extra):
                _build(environment, extra)
    except OSError as problem:
        raise SetUpError(
            f"{environment.folder} cannot be written ({problem.strerror}). "
            "Name another folder in the environment variable FLYREG_ENVIRONMENT."
        ) from problem
    return environment


def _build(environment: Environment, extra: str) -> None:
    """Make or complete the environment; the record says in the meantime that it is unfinished."""
    folder = environment.folder
    if environment.is_foreign():
        raise SetUpError(
            f"{folder} was made by something else and is left as it is. Move it away, or name "
            "another folder in the environment variable FLYREG_ENVIRONMENT."
        )
    extras = [extra]
    if environment.is_usable():
        extras = sorted({extra, *environment.read_record()["extras"]})
        say(f"completing the Python packages in {folder}")
    else:
        say(f"setting up the Python packages in {folder} (a few minutes, once)")
        _remove(folder)
    new = not folder.exists()
    environment.write_record(extras, finished=False)
    python = environment.program("python")
    # The interpreter below any virtual environment: the running one may be in the folder itself.
    base_python = getattr(sys, "_base_executable", None) or sys.executable
    if new and not run_quietly([base_python, "-m", "venv", folder]):
        raise SetUpError(f"the virtual environment {folder} could not be made; see above.")
    install = ["-m", "pip", "install", "--no-input", "-e", f".[{','.join(extras)}]"]
    if not run_quietly([python, *install]):
        raise SetUpError(
            "the Python packages could not be installed; pip's last words are above. "
            "When that is mended, give the same command again."
        )
    environment.write_record(extras, finished=True)
    say("ready")


def _remove(folder: Path) -> None:
    """Remove a folder so that an interruption leaves nothing that looks whole."""
    unused = folder.with_name(f"{folder.name}.unused")
    if unused.exists():
        shutil.rmtree(unused)
    if folder.exists():
        folder.rename(unused)
        shutil.rmtree(unused)


@contextlib.contextmanager
def _one_at_a_time(folder: Path) -> Iterator[None]:
    """Wait until no other process sets up the same folder, and keep others waiting."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    with folder.with_name(f"{folder.name}.lock").open("w") as lock:
        told = False
        while not _try_to_lock(lock.fileno()):
            if not told:
                say("waiting for another process that sets up the same folder")
                told = True
            time.sleep(0.2)
        yield


def _try_to_lock(descriptor: int) -> bool:
    """Lock an open file until it is closed, unless another process has locked it."""
    try:
        if sys.platform == "win32":
            import msvcrt

            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError):
        return False
    return True


# --- Display --------------------------------------------------------------------------------------


def has_display() -> bool:
    """Tell whether a window can be shown to somebody."""
    if not sys.platform.startswith("linux"):
        return True
    return any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))


@contextlib.contextmanager
def private_display() -> Iterator[dict[str, str]]:
    """Start a display that nobody sees, and end it when the block is left, however it is left.

    Yields
    ------
    dict
        The environment variables of programs that are to use it; none on macOS and Windows, where
        windows need no such display.

    Raises
    ------
    SetUpError
        What a window needs is not installed, or the display did not start.
    """
    if not sys.platform.startswith("linux"):
        yield {}
        return
    require_window(private=True)
    reading, writing = os.pipe()
    with tempfile.TemporaryFile() as output, tempfile.TemporaryDirectory() as folder:
        process = subprocess.Popen(
            [*XVFB, "-displayfd", str(writing)],
            pass_fds=[writing],
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            # Ctrl-C in a terminal must not take the display from programs that are still ending.
            start_new_session=True,
        )
        try:
            os.close(writing)
            yield {
                "DISPLAY": f":{_read_display_number(reading, output)}",
                "WAYLAND_DISPLAY": "",
                "QT_QPA_PLATFORM": "xcb",
                "LIBGL_ALWAYS_SOFTWARE": "1",
                "XDG_RUNTIME_DIR": os.environ.get("XDG_RUNTIME_DIR") or folder,
            }
        finally:
            os.close(reading)
            _end(process)


def _read_display_number(descriptor: int, output: IO[bytes]) -> int:
    """Wait for the number that Xvfb writes when it is ready."""
    ready, _, _ = select.select([descriptor], [], [], SECONDS_FOR_DISPLAY)
    number = os.read(descriptor, 20) if ready else b""
    if not number.strip().isdigit():
        output.seek(0)
        last_line = (output.read().decode(errors="replace").splitlines() or ["no message"])[-1]
        raise SetUpError(f"the private display (Xvfb) did not start: {last_line}")
    return int(number)
