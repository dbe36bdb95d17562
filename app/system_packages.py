"""Find and install what flyreg needs from the operating system.

What is missing is looked for, not guessed from the name of the system.  It is installed only where
that is possible without asking: by apt, as root or by a sudo that wants no password.  Otherwise a
:class:`programs.SetUpError` tells the user what to install.  Standard library only.
"""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
import sys
from typing import TYPE_CHECKING

from programs import SetUpError, run_quietly, say

if TYPE_CHECKING:
    from pathlib import Path

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
    if not missing or shutil.which("apt-get") is None:
        return
    become_root = _words_to_become_root()
    if become_root is None:
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


def _words_to_become_root() -> list[str] | None:
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
    """Raise a SetUpError unless a window can be opened, as far as system packages go."""
    require("a window, unlike the flyreg command,", missing_for_windows(private=private))


def prepare_system(*, window: bool, private: bool) -> None:
    """Install what is missing on this machine, and insist on what Python itself needs."""
    missing = missing_for_python()
    if window:
        missing |= missing_for_windows(private=private)
    install_missing(missing)
    require("the first start", missing_for_python())
