"""What the user is told when something goes wrong: a sentence, never a traceback."""

from __future__ import annotations

import sys
import traceback
from datetime import datetime
from pathlib import Path
from types import TracebackType

from PySide6.QtCore import QObject, QStandardPaths, Signal

from flyreg_core.errors import FlyregError


def log_path() -> Path:
    """Return the file that internal errors are written to."""
    state = QStandardPaths.StandardLocation.GenericStateLocation
    folder = QStandardPaths.writableLocation(state)
    return Path(folder) / "flyreg" / "errors.log"


def sentence_for(error: BaseException) -> str:
    """Return what to tell the user about an error; an unexpected one goes to the log file."""
    if isinstance(error, FlyregError):
        return str(error)
    if isinstance(error, OSError) and error.filename:
        return f"{error.filename}: {error.strerror}"
    return _log(error)


def as_sentence(text: str) -> str:
    """Return a text with a capital at its beginning, unless it begins with the name of a file."""
    first = text.split(maxsplit=1)[0] if text.strip() else ""
    return text if set("./\\_") & set(first.rstrip(",.:;")) else text[:1].upper() + text[1:]


def _log(error: BaseException) -> str:
    path = log_path()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("a", encoding="utf-8") as log:
            log.write(f"{datetime.now().astimezone().isoformat(timespec='seconds')}\n")
            log.write("".join(traceback.format_exception(error)) + "\n")
    except OSError:
        sys.stderr.write("".join(traceback.format_exception(error)))
        return f"An internal error occurred, and its details could not be written to {path}"
    return f"An internal error occurred; its details are in {path}"


class ExceptionCatcher(QObject):
    """Takes exceptions that no code caught, so that a slot that fails does not end the program."""

    caught = Signal(str)  # the sentence for the user

    def install(self) -> None:
        """Become the interpreter's hook for uncaught exceptions."""
        sys.excepthook = self._on_exception

    def _on_exception(
        self, kind: type[BaseException], error: BaseException, trace: TracebackType | None
    ) -> None:
        if issubclass(kind, KeyboardInterrupt):
            sys.__excepthook__(kind, error, trace)
            return
        self.caught.emit(sentence_for(error))
