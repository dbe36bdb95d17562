"""A dialog beside which one piece of work runs, and which ends it when it is closed."""

from __future__ import annotations

from PySide6.QtGui import QCloseEvent
from PySide6.QtWidgets import QDialog, QWidget

from flyreg_gui.work import Work


class WorkingDialog(QDialog):
    """Keeps the work that runs; whoever derives shows whether there is any."""

    def __init__(self, parent: QWidget | None) -> None:
        super().__init__(parent)
        self._work: Work | None = None

    def _show_busy(self, busy: bool) -> None:
        raise NotImplementedError

    def _end(self) -> None:
        """Stop what runs, if anything does."""
        work, self._work = self._work, None
        if work is not None:
            work.close()
            work.deleteLater()
        self._show_busy(False)

    def done(self, result: int) -> None:
        """End the work whichever way the dialog is closed."""
        self._end()
        super().done(result)

    def closeEvent(self, event: QCloseEvent) -> None:
        """End the work when the window's frame is used to close."""
        self._end()
        super().closeEvent(event)
