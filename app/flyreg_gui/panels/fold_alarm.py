"""A notice that the spline folds the surface, which landmarks make it so, and what helps."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QFrame, QGridLayout, QHBoxLayout, QLabel, QPushButton, QToolButton

from flyreg_core import edits
from flyreg_core.results import Results
from flyreg_gui.landmark_table import outlying
from flyreg_gui.session import Session
from flyreg_gui.steps import count_folds
from flyreg_gui.theme import Theme, css

WEAKER = 0.25
"""What a weight is multiplied by to weaken a landmark."""
STRONGER = 10.0
"""What λ is multiplied by to raise it."""
LEAST_SMOOTHING = 1e-4
"""What λ is raised to where it is 0 or almost."""
NAMED = 3
"""As many culprits are named."""


@dataclass(frozen=True)
class Culprit:
    """A landmark near which the surface folds, or one that stands out while it folds."""

    id: str
    name: str
    weight: float
    moved: int  # vertices that were moved to mend folds, nearer to it than to any other
    foretold_um: float | None = None  # where others would put it, if that is unusually far away


@dataclass(frozen=True)
class Folds:
    """What is to be said about the folds of a registration."""

    mended: int  # triangles that the spline flipped and that were turned back
    left: int  # triangles still upside down
    culprits: tuple[Culprit, ...]  # the worst first

    @classmethod
    def of(cls, results: Results) -> Folds:
        """Return the folds of a measured registration."""
        halves = results.registration.halves.values()
        judgement = results.judgement
        near = judgement.folds_by_landmark if judgement else {}
        errors = judgement.leave_one_out_um if judgement else {}
        own = {mark.pair.id for mark in results.landmarks if mark.pair.origin == "user"}
        suspects = outlying(errors) & own  # what the program placed did not fold before
        culprits = [
            Culprit(
                *(pair.id, pair.short_name, pair.weight, near.get(pair.id, 0)),
                foretold_um=errors[pair.id] if pair.id in suspects else None,
            )
            for pair in (mark.pair for mark in results.landmarks)
            if pair.id in near or pair.id in suspects
        ]
        worst = sorted(culprits, key=lambda one: (-(one.foretold_um or 0.0), -one.moved))
        return cls(sum(half.folds_mended for half in halves), count_folds(results), tuple(worst))

    def sentence(self) -> str:
        """Return what happened and where."""
        if self.left:
            what = f"{_triangles(self.left)} of the registered surface lie upside down"
        else:
            what = f"The spline folded {_triangles(self.mended)}, which were laid flat again"
        if self.culprits and (away := self.culprits[0].foretold_um) is not None:
            return f"{what}. “{self.culprits[0].name}” stands out: {_would_put(away)}."
        names = [culprit.name for culprit in self.culprits[:NAMED]]
        named = " and ".join((", ".join(names[:-1]), names[-1]) if names[1:] else names)
        return f"{what}, most near {named}." if named else f"{what}."

    def details(self) -> str:
        """Return how much each culprit has to do with it."""
        return "\n".join(
            f"{culprit.name}: {culprit.moved:,} vertices moved near it"
            + (f"; {_would_put(culprit.foretold_um)}" if culprit.foretold_um is not None else "")
            for culprit in self.culprits
        )


class FoldAlarm(QFrame):
    """The notice, with a button for each remedy; each is one edit that undo takes back.

    The few folds that are mended before the user did anything are told by the status bar alone.
    """

    places_asked = Signal(bool)  # whether colours are to tell where it folded

    def __init__(self, session: Session) -> None:
        super().__init__()
        self.setObjectName("alarm")
        self._session = session
        self._dismissed: tuple[str, ...] | None = None  # whose folds the user has seen
        self._usual: int | None = None  # folds mended before the user did anything
        self.folds = Folds(0, 0, ())
        self._text = QLabel()
        self._text.setWordWrap(True)
        self._text.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self._text.setTextFormat(Qt.TextFormat.PlainText)
        self.weaken_button, self.smooth_button = QPushButton("Weaken"), QPushButton("Smooth")
        self.places_button = QPushButton("Show where")
        self.places_button.setCheckable(True)
        self.places_button.setToolTip("Colour the brains by where folds were mended, or no longer")
        self.close_button = QToolButton()
        self.close_button.setText("✕")
        self.close_button.setAutoRaise(True)
        self.close_button.setToolTip("Dismiss until other landmarks fold the surface")
        layout, buttons = QGridLayout(self), QHBoxLayout()
        layout.setContentsMargins(10, 4, 6, 4)
        layout.addWidget(self._text, 0, 0)
        layout.addWidget(self.close_button, 0, 1, Qt.AlignmentFlag.AlignTop)
        layout.addLayout(buttons, 1, 0)
        layout.setColumnStretch(0, 1)
        buttons.addWidget(self.weaken_button)
        buttons.addWidget(self.smooth_button)
        buttons.addWidget(self.places_button)
        buttons.addStretch(1)
        self.weaken_button.clicked.connect(self.weaken)
        self.smooth_button.clicked.connect(self.raise_smoothing)
        self.places_button.clicked.connect(self.places_asked)
        self.close_button.clicked.connect(self._on_dismissed)
        session.results_changed.connect(self._on_results)
        self.hide()

    @property
    def text(self) -> str:
        """What is on show; empty if nothing is."""
        return "" if self.isHidden() else self._text.text()

    def show_theme(self, theme: Theme) -> None:
        """Take the colours of a theme."""
        ground = "#453a1a" if theme.is_dark else "#fdf3d6"
        self.setStyleSheet(
            f"#alarm {{ background: {ground}; border-bottom: 1px solid {css(theme.faint)}; }}"
            f"#alarm QLabel {{ color: {css(theme.text)}; }}"
        )

    def weaken(self) -> None:
        """Give the worst culprit a quarter of its weight."""
        project = self._session.project
        if project is not None and self.folds.culprits:
            worst = self.folds.culprits[0]
            changed = edits.set_weight(project, worst.id, worst.weight * WEAKER)
            self._session.edit(f"weaken {worst.name}", changed)

    def raise_smoothing(self) -> None:
        """Let the spline follow all landmarks less closely."""
        project = self._session.project
        if project is not None:
            changed = edits.set_smoothing(project, _raised(project.smoothing))
            self._session.edit("raise λ", changed)

    def _on_results(self, results: Results | None) -> None:
        if results is None:
            self._dismissed = self._usual = None
            self.hide()
        elif results.judgement is not None:  # else the hand still moves, and the notice stays
            self.folds = Folds.of(results)
            if self._usual is None:
                own = {pair.id for pair in results.project.pairs}
                is_of_user = any(culprit.id in own for culprit in self.folds.culprits)
                self._usual = 0 if is_of_user else self.folds.mended
            self._show(results)

    def _show(self, results: Results) -> None:
        folds = self.folds
        is_alarming = folds.left > 0 or folds.mended > (self._usual or 0)
        if not is_alarming:
            self._dismissed = None
        self.setVisible(is_alarming and self._culprits() != self._dismissed)
        self._text.setText(folds.sentence())
        self._text.setToolTip(folds.details())
        self.weaken_button.setVisible(bool(folds.culprits))
        if folds.culprits:
            worst = folds.culprits[0]
            self.weaken_button.setText(f"Weaken {worst.name}")
            self.weaken_button.setToolTip(
                f"Weight {worst.weight:.3g} → {worst.weight * WEAKER:.3g} (undo takes it back)"
            )
        smoothing = results.project.smoothing
        self.smooth_button.setText(f"Raise λ to {_raised(smoothing):.2g}")
        self.smooth_button.setToolTip(
            f"The spline follows all landmarks less closely: λ is {smoothing:.2g} now"
        )

    def _culprits(self) -> tuple[str, ...]:
        return tuple(sorted(culprit.id for culprit in self.folds.culprits[:NAMED]))

    def _on_dismissed(self) -> None:
        self._dismissed = self._culprits()
        self.hide()


def _raised(smoothing: float) -> float:
    return max(smoothing * STRONGER, LEAST_SMOOTHING)


def _would_put(away_um: float) -> str:
    return f"the other landmarks would put it {away_um:.0f} µm away"


def _triangles(count: int) -> str:
    return "1 triangle" if count == 1 else f"{count:,} triangles"
