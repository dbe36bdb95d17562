"""The status bar: what is true of the picture on show."""

from __future__ import annotations

from PySide6.QtWidgets import QLabel, QStatusBar

from flyreg_gui.session import Session
from flyreg_gui.steps import count_folds


class StatusBar(QStatusBar):
    """Folds, mean distance, whether the picture is up to date, and how long that took."""

    def __init__(self, session: Session) -> None:
        super().__init__()
        self._session = session
        self.hint, self.folds, self.distance, self.state = QLabel(), QLabel(), QLabel(), QLabel()
        self.place = QLabel()
        self.addWidget(self.place)
        self.addWidget(self.hint, 1)
        for label in (self.folds, self.distance, self.state):
            self.addPermanentWidget(label)
        self.folds.setToolTip("Triangles that lie upside down after the registration")
        self.distance.setToolTip("Mean distance from the registered surface to the target")
        for signal in (session.state_changed, session.results_changed, session.project_changed):
            signal.connect(self._show)
        self._show()

    def show_hint(self, text: str) -> None:
        """Say what the user can do next."""
        self.hint.setText(text)

    def show_place(self, text: str) -> None:
        """Say where the cursor is."""
        self.place.setText(text)
        self.place.setVisible(bool(text))

    def _show(self, *_news: object) -> None:
        session = self._session
        results = session.results
        flipped = count_folds(results) if results else 0
        self.folds.setText(f"folds {flipped}" if results else "")
        if results is None:
            self.distance.clear()
        elif results.distances is not None:
            mean = results.distances.a_to_b.mean_um
            self.distance.setText(f"mean distance {mean:.2f} µm")
        else:
            self.distance.setText("mean distance …")
        self.state.setText(_state(session))


def _state(session: Session) -> str:
    if session.project is None:
        return ""
    if session.is_up_to_date:
        milliseconds = 1000 * (session.seconds or 0.0)
        took = f"{milliseconds:.0f} ms" if milliseconds < 1000 else f"{milliseconds / 1000:.1f} s"
        return f"up to date, {took}"
    if session.is_running:
        return "updating…" if session.results is not None else "working…"
    return "failed" if session.failure is not None else "not up to date"
