"""What can be done while trimming besides dragging."""

from __future__ import annotations

from PySide6.QtWidgets import QHBoxLayout, QLabel, QPushButton, QVBoxLayout, QWidget

from flyreg_core import edits
from flyreg_gui.preparing import ROLES
from flyreg_gui.session import Session
from flyreg_gui.trim_mode import TrimMode

TEXT = (
    "Drag a dot in the view of a brain. What is grey is cut off; what is darker lies behind the "
    "cut. A double click on a dot puts it back to its automatic place."
)


class TrimmingPanel(QWidget):
    """How to trim, and two buttons; hidden while nobody trims."""

    def __init__(self, session: Session, trim: TrimMode) -> None:
        super().__init__()
        self._session, self._trim = session, trim
        text = QLabel(TEXT)
        text.setWordWrap(True)
        self.reset_button, self.end_button = QPushButton("Back to automatic"), QPushButton("Done")
        self.reset_button.setToolTip("Have the program place the planes and cuts of both brains")
        self.reset_button.clicked.connect(trim.reset_all)
        self.end_button.clicked.connect(lambda: trim.set_on(False))
        buttons = QHBoxLayout()
        buttons.addWidget(self.reset_button)
        buttons.addWidget(self.end_button)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 4, 0, 4)
        layout.addWidget(text)
        layout.addLayout(buttons)
        trim.changed.connect(self._show)
        session.project_changed.connect(self._show)
        self._show()

    def _show(self, *_news: object) -> None:
        self.setVisible(self._trim.is_on)
        project = self._session.project
        self.reset_button.setEnabled(
            project is not None
            and any(edits.reset_trimming(project, role) != project for role in ROLES)
        )
