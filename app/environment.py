"""Make what flyreg's programs run in: a virtual environment and, if need be, a display.

Python packages go into ``.venv`` in the checkout, or into the folder that FLYREG_ENVIRONMENT names.
A record in that folder tells what it was made for and whether it was finished, so that a second
call does nothing, and one after an interruption starts afresh.  Standard library only.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import platform
import select
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from programs import SetUpError, end, run_quietly, say

if TYPE_CHECKING:
    from collections.abc import Iterator

CHECKOUT = Path(__file__).resolve().parent.parent
# On Python 3.14 pip cannot install what flybrains depends on; flyreg only reads its files.
TEMPLATES = ["flybrains>=0.6"]
RECORD_NAME = "flyreg-environment.json"
SECONDS_FOR_DISPLAY = 30.0
SECONDS_FOR_ANSWER = 2.0
XVFB = ["Xvfb", "-screen", "0", "1600x1000x24", "+extension", "GLX", "-nolisten", "tcp", "-noreset"]


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
    complete = environment.is_usable()
    if complete:
        extras = sorted({extra, *environment.read_record()["extras"]})
        say(f"completing the Python packages in {folder}")
    else:
        extras = [extra]
        say(f"setting up the Python packages in {folder} (a few minutes, once)")
        _remove(folder)
    environment.write_record(extras, finished=False)
    # The interpreter below any virtual environment: the running one may be in the folder itself.
    base_python = getattr(sys, "_base_executable", None) or sys.executable
    if not complete and not run_quietly([base_python, "-m", "venv", folder]):
        raise SetUpError(f"the virtual environment {folder} could not be made; see above.")
    _install(environment.program("python"), ["-e", f".[{','.join(extras)}]"])
    if sys.version_info >= (3, 14):
        _install(environment.program("python"), ["--no-deps", *TEMPLATES])
    environment.write_record(extras, finished=True)
    say("ready")


def _install(python: Path, what: list[str]) -> None:
    """Install packages with the pip of an environment and the user's own pip configuration."""
    if not run_quietly([python, "-m", "pip", "install", "--no-input", *what], folder=CHECKOUT):
        raise SetUpError(
            "the Python packages could not be installed; pip's last words are above. "
            "When that is mended, give the same command again."
        )


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


def has_display() -> bool:
    """Tell whether a window can be shown to somebody."""
    if not sys.platform.startswith("linux") or os.environ.get("WAYLAND_DISPLAY"):
        return True
    named = os.environ.get("DISPLAY", "")
    if named and not _answers(named):
        say(f"no display answers at DISPLAY={named}")
        return False
    return bool(named)


def _answers(display: str) -> bool:
    """Tell whether an X server listens where DISPLAY says; sessions often outlive theirs."""
    host, _, numbers = display.rpartition(":")
    digits = numbers.split(".")[0]
    if not digits.isdecimal():
        return False
    number = int(digits)
    path = f"/tmp/.X11-unix/X{number}"
    addresses: list[tuple[socket.AddressFamily, Any]] = [
        (socket.AF_UNIX, path),
        (socket.AF_UNIX, f"\0{path}"),
    ]
    if host not in ("", "unix"):
        addresses = [(socket.AF_INET, (host, 6000 + number))]
    for family, address in addresses:
        with socket.socket(family) as attempt, contextlib.suppress(OSError):
            attempt.settimeout(SECONDS_FOR_ANSWER)
            attempt.connect(address)
            return True
    return False


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
        The display did not start.
    """
    if not sys.platform.startswith("linux"):
        yield {}
        return
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
            end(process)


def _read_display_number(descriptor: int, output: IO[bytes]) -> int:
    """Wait for the number that Xvfb writes when it is ready."""
    ready, _, _ = select.select([descriptor], [], [], SECONDS_FOR_DISPLAY)
    number = os.read(descriptor, 20) if ready else b""
    if not number.strip().isdigit():
        output.seek(0)
        last_line = (output.read().decode(errors="replace").splitlines() or ["no message"])[-1]
        raise SetUpError(f"the private display (Xvfb) did not start: {last_line}")
    return int(number)
