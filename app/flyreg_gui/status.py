"""The status bar: what is true of the picture on show."""

from __future__ import annotations

from statistics import fmean, median

from PySide6.QtWidgets import QLabel, QStatusBar

from flyreg_core.results import Results
from flyreg_gui.session import Session
from flyreg_gui.steps import count_folds

FORETOLD = (
    "How far from its target each landmark would end if it were left out and the others foretold it: "
    "median and mean"
)
GAP = (
    "The most that sewing the halves together moved their common boundary along its curve; "
    "in the delivered surface it is closed"
)
FEWER = "fewer triangles while it moves"
STATE = (
    "Whether what is drawn follows from the project, and the time it took; where drawing is slow, "
    "what moves has fewer triangles until the hand is off it"
)


class StatusBar(QStatusBar):
    """Where the cursor is; how good the registration is; whether the picture is exact, and its time."""

    def __init__(self, session: Session) -> None:
        super().__init__()
        self._session, self._is_light = session, False
        self.place, self.hint = QLabel(), QLabel()
        self.folds, self.distance, self.foretold = QLabel(), QLabel(), QLabel()
        self.gap, self.state = QLabel(), QLabel()
        self.addWidget(self.place)
        self.addWidget(self.hint, 1)
        for label, tip in (
            (self.folds, "Triangles that lie upside down; those that the spline had folded"),
            (self.distance, "Mean distance from the registered surface to the target"),
            (self.foretold, FORETOLD),
            (self.gap, GAP),
            (self.state, STATE),
        ):
            label.setToolTip(tip)
            self.addPermanentWidget(label)
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

    def show_lightness(self, on: bool) -> None:
        """Say whether what moves is drawn with fewer triangles."""
        self._is_light = on
        self._show()

    def _show(self, *_news: object) -> None:
        results = self._session.results
        labels = (self.folds, self.distance, self.foretold, self.gap)
        for label, text in zip(labels, _numbers(results), strict=True):
            label.setText(text)
            label.setVisible(bool(text))
        state = _state(self._session)
        self.state.setText(f"{state}, {FEWER}" if state and self._is_light else state)


def _numbers(results: Results | None) -> tuple[str, str, str, str]:
    """Return folds, distance, leave-one-out and seam gap; "…" for what is still to be measured."""
    if results is None:
        return "", "", "", ""
    halves = results.registration.halves.values()
    mended = sum(half.folds_mended for half in halves)
    folds = f"folds {count_folds(results)}" + (f" ({mended} mended)" if mended else "")
    measured, judged = results.distances, results.judgement
    distance = "…" if measured is None else f"{measured.a_to_b.mean_um:.2f} µm"
    foretold = "…"
    if judged is not None:
        errors = list(judged.leave_one_out_um.values())
        foretold = (
            f"median {median(errors):.2f}, mean {fmean(errors):.2f} µm" if errors else "unknown"
        )
    gap = max(half.gap_um for half in halves)
    return folds, f"distance {distance}", f"leave-one-out {foretold}", f"seam {gap:.2f} µm"


def _state(session: Session) -> str:
    """Return whether the picture is exact; a preview is what a moving hand gets."""
    if session.project is None:
        return ""
    if session.beside:
        return f"{session.beside} on show"
    if session.is_up_to_date:
        milliseconds = 1000 * (session.seconds or 0.0)
        took = f"{milliseconds:.0f} ms" if milliseconds < 1000 else f"{milliseconds / 1000:.1f} s"
        return f"exact, {took}" if session.is_complete else f"preview, {took}"
    if session.is_running:
        return "updating…" if session.results is not None else "working…"
    return "failed" if session.failure is not None else "not up to date"
