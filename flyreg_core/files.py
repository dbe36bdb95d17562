"""Reading and writing whole files, so that nothing is ever left half written."""

from __future__ import annotations

import contextlib
import errno
import os
from pathlib import Path

from flyreg_core.errors import InputError


def read_bytes(path: Path) -> bytes:
    """Return what is in a file.

    Raises
    ------
    InputError
        There is no such file, it is a folder, empty, or may not be read.
    """
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise InputError(f"there is no file {path}; check its name and folder") from None
    except IsADirectoryError:
        raise InputError(f"{path} is a folder; choose a file in it") from None
    except OSError as error:
        if path.is_dir():  # opening a folder is "permission denied" on Windows
            raise InputError(f"{path} is a folder; choose a file in it") from None
        raise InputError(f"{path} cannot be read: {error.strerror or error}") from error
    if not content:
        raise InputError(f"{path} is empty (0 bytes); copy or export it again")
    return content


def read_text(path: Path) -> str:
    """Return a UTF-8 text file, with or without byte order mark.

    Raises
    ------
    InputError
        As `read_bytes`, or the file is not UTF-8.
    """
    try:
        return read_bytes(path).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(
            f"{path} is not a text file in UTF-8 (byte {error.start + 1}); save it as UTF-8"
        ) from error


def write_atomically(path: Path, content: bytes | str) -> None:
    """Write a file whole or not at all: beside its place, then renamed.

    Parameters
    ----------
    content : bytes or str
        Text is written as UTF-8 with its line ends as they are.

    Raises
    ------
    InputError
        The folder is missing or read-only, or the disk is full. A file that was there is untouched
        then, as it is after Ctrl-C.
    """
    place = path.resolve()  # a link stays a link
    temporary = place.with_name(f".{place.name}.{os.getpid()}.part")
    try:
        with temporary.open("wb") as stream:
            stream.write(content.encode() if isinstance(content, str) else content)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(temporary, place)
    except BaseException as error:
        with contextlib.suppress(OSError):
            temporary.unlink()
        if isinstance(error, OSError):
            raise InputError(f"{path} cannot be written: {_reason(error, place)}") from error
        raise


def check_place(path: Path) -> None:
    """Tell before long work whether a file could be written there, in a folder made if need be.

    Raises
    ------
    InputError
        A folder has the file's name, or the nearest folder that exists is a file or read-only.
    """
    if path.is_dir():
        raise InputError(f"{path} cannot be written: it is a folder; choose another name")
    folder = path.resolve().parent
    while not folder.exists():
        folder = folder.parent
    if not folder.is_dir():
        raise InputError(f"{path} cannot be written: {folder} is a file, not a folder")
    if not os.access(folder, os.W_OK):
        raise InputError(
            f"{path} cannot be written: the folder {folder} is read-only; choose another one"
        )


def make_folder(folder: Path) -> None:
    """Make a folder and those above it.

    Raises
    ------
    InputError
        It cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"the folder {folder} cannot be made: {error.strerror}") from error


def _reason(error: OSError, place: Path) -> str:
    folder = place.parent
    if not folder.is_dir():
        return f"there is no folder {folder}; make it first"
    if place.is_dir():
        return "it is a folder; choose another name"
    if error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        return f"the folder {folder} is read-only; choose another one"
    if error.errno == errno.ENOSPC:
        return "the disk is full; make room or choose another one"
    return error.strerror or str(error)
