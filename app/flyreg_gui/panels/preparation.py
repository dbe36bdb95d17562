"""The settings by which brains are prepared; they act when they are applied, not while typed."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations, product
from typing import Any

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QDoubleValidator, QIntValidator, QValidator
from PySide6.QtWidgets import (
    QComboBox,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QPushButton,
    QSpinBox,
    QVBoxLayout,
    QWidget,
)

from flyreg_core.landmarks import Pairing
from flyreg_core.project import Brain, Project
from flyreg_core.results import PreparedBrain, Results
from flyreg_gui.curves_dialog import CurvesDialog
from flyreg_gui.session import Session

PAIRINGS: tuple[Pairing, ...] = ("shape", "coordinate", "arc length", "nearest")
PAIRING_TIP = (
    "What tells which places belong together: the shapes of both brains; or, each brain by itself, "
    "the same share of the way along the animal's axis, the same share of the curve's length, or "
    "the nearest place in the flat domain"
)


class OptionalNumber(QLineEdit):
    """A number, or nothing: then the program finds it and says in grey what it found."""

    def __init__(self, name: str, kind: type[QValidator] = QDoubleValidator) -> None:
        super().__init__()
        self.setValidator(kind(self))
        self.setAccessibleName(name)
        self.setMinimumWidth(56)

    def value(self) -> float | None:
        """Return the number; None if the field is empty."""
        text = self.text().strip()
        return float(text) if text and self.hasAcceptableInput() else None

    def show_value(self, value: float | None) -> None:
        """Show a number, or that there is none."""
        self.setText("" if value is None else f"{value:g}")

    def show_found(self, value: float | None) -> None:
        """Say in grey what the program found."""
        self.setPlaceholderText("auto" if value is None else f"{value:.0f}")


class OptionalCount(OptionalNumber):
    """A whole number, or nothing."""

    def __init__(self, name: str) -> None:
        super().__init__(name, QIntValidator)

    def count(self) -> int | None:
        """Return the number; None if the field is empty."""
        value = self.value()
        return None if value is None else round(value)

    def show_value(self, value: float | None) -> None:
        """Show a number with all its digits, or that there is none."""
        self.setText("" if value is None else f"{value:.0f}")


class BrainFields:
    """The settings of one brain: a column of the form."""

    def __init__(self, role: str) -> None:
        self.right = OptionalNumber(f"Trim right of {role}")
        self.left = OptionalNumber(f"Trim left of {role}")
        self.shift = OptionalNumber(f"Cut shift of {role}")
        self.shift.setPlaceholderText("0")
        self.voxels = _spin_box(f"Voxels across {role}", 20, 400)
        self.vertices = OptionalCount(f"Vertices of {role}")
        self.passes = _spin_box(f"Smoothing passes of {role}", 0, 5000)
        self.pose = QComboBox()
        self.pose.addItem(FOUND, None)
        for axes in POSES:
            self.pose.addItem(axes, axes)
        self.pose.setAccessibleName(f"Pose of {role}")
        self.pose.setMinimumWidth(56)
        self.pose.setSizeAdjustPolicy(
            QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon
        )

    @property
    def widgets(self) -> tuple[QWidget, ...]:
        """The fields from top to bottom."""
        fields = (self.pose, self.right, self.left, self.shift)
        return (*fields, self.voxels, self.vertices, self.passes)

    def show(self, brain: Brain, prepared: PreparedBrain | None) -> None:
        """Show the settings of a brain, and what was found where they leave it open."""
        planes = prepared.torus.planes if prepared is not None else None
        self.right.show_value(brain.trim.right)
        self.right.show_found(planes.right if planes else None)
        self.left.show_value(brain.trim.left)
        self.left.show_found(planes.left if planes else None)
        self.shift.show_value(brain.cut.shift_um or None)
        self.voxels.setValue(brain.solid.voxels_across)
        self.vertices.show_value(brain.simplify.vertices)
        self.vertices.show_found(len(prepared.surface.vertices) if prepared else None)
        self.passes.setValue(brain.smooth.passes)
        self.pose.setCurrentIndex(self.pose.findData(brain.pose.axes))

    def applied_to(self, brain: Brain) -> Brain:
        """Return the brain with the settings of the form."""
        return replace(
            brain,
            trim=replace(brain.trim, right=self.right.value(), left=self.left.value()),
            cut=replace(brain.cut, shift_um=self.shift.value() or 0.0),
            solid=replace(brain.solid, voxels_across=self.voxels.value()),
            simplify=replace(brain.simplify, vertices=self.vertices.count()),
            smooth=replace(brain.smooth, passes=self.passes.value()),
            pose=replace(brain.pose, axes=self.pose.currentData()),
        )


FOUND = "auto"
POSES = sorted(
    ("".join(axes) for order in permutations(("LR", "DV", "PA")) for axes in product(*order)),
    key=lambda axes: (sum(letter not in "LVP" for letter in axes), axes != "LVP"),
)
"""All there are, the usual ones first."""
LABELS = (
    (
        "Pose",
        "Towards which side of the animal x, y and z grow in the file: Left or Right, Dorsal or "
        "Ventral, Anterior or Posterior; auto: found from the shape. LVP is how templates lie",
    ),
    (
        "Trim right, µm",
        "Where the animal's right optic lobe is cut off, left of the midplane: negative; grey: found",
    ),
    (
        "Trim left, µm",
        "Where the animal's left optic lobe is cut off, left of the midplane; grey: found",
    ),
    ("Cut shift, µm", "How far behind the automatic place the halves are divided"),
    ("Voxels across", "How finely the brain is cut into voxels, from dorsal to ventral"),
    (
        "Vertices",
        "How many the main brain has: fewer make it simpler (see Costs), more are added where the other "
        "brain asks for them; grey: as many as there are",
    ),
    ("Smoothing passes", "How often the surface is averaged before it is divided"),
)


class PreparationForm(QWidget):
    """The form with its Apply button."""

    applied = Signal(object)  # Project

    def __init__(self, session: Session) -> None:
        super().__init__()
        self._session = session
        self.source, self.target = BrainFields("source"), BrainFields("target")
        self.pairing = QComboBox()
        self.pairing.addItems(PAIRINGS)
        self.pairing.setToolTip(PAIRING_TIP)
        self.per_seam = _spin_box("Landmarks per seam", 0, 99)
        self.per_side = _spin_box("Landmarks per side", 0, 99)
        self.curves_button = QPushButton("Costs…")
        self.curves_button.setToolTip("Show what simplifying and smoothing cost the brains' shape")
        self.apply_button = QPushButton("Apply")
        self.reset_button = QPushButton("Reset")
        self._arrange()
        self._connect()
        self._on_project(session.project)

    def _arrange(self) -> None:
        grid = QGridLayout()
        grid.setHorizontalSpacing(6)
        grid.setVerticalSpacing(4)
        for column, text in enumerate(("Source", "Target"), start=1):
            heading = QLabel(text)
            heading.setAlignment(Qt.AlignmentFlag.AlignCenter)
            grid.addWidget(heading, 0, column)
            grid.setColumnStretch(column, 1)
        for row, (label, tip) in enumerate(LABELS, start=1):
            grid.addWidget(_label(label, tip), row, 0)
            for column, fields in enumerate((self.source, self.target), start=1):
                widget = fields.widgets[row - 1]
                widget.setToolTip(tip)
                grid.addWidget(widget, row, column)
        row = len(LABELS) + 1
        grid.addWidget(_label("Paired by", PAIRING_TIP), row, 0)
        grid.addWidget(self.pairing, row, 1, 1, 2)
        for below, (label, tip, box) in enumerate(
            (
                ("Seam landmarks", "How many landmarks lie on each seam", self.per_seam),
                ("Side landmarks", "How many landmarks lie on each side of a half", self.per_side),
            ),
            start=row + 1,
        ):
            box.setToolTip(tip)
            grid.addWidget(_label(label, tip), below, 0)
            grid.addWidget(box, below, 1, 1, 2)
        buttons = QHBoxLayout()
        buttons.addWidget(self.curves_button)
        buttons.addStretch(1)
        buttons.addWidget(self.reset_button)
        buttons.addWidget(self.apply_button)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 4, 0, 4)
        layout.addLayout(grid)
        layout.addLayout(buttons)

    def _connect(self) -> None:
        for fields in (self.source, self.target):
            for widget in fields.widgets:
                _changed_signal(widget).connect(self._on_typed)
        for widget in (self.pairing, self.per_seam, self.per_side):
            _changed_signal(widget).connect(self._on_typed)
        self.curves_button.clicked.connect(self._on_curves)
        self.apply_button.clicked.connect(self._on_apply)
        self.reset_button.clicked.connect(self._on_reset)
        self._session.project_changed.connect(self._on_project)
        self._session.results_changed.connect(self._on_results)

    def _form_project(self) -> Project | None:
        project = self._session.project
        if project is None:
            return None
        boundary = replace(
            project.boundary,
            per_seam=self.per_seam.value(),
            per_side=self.per_side.value(),
            pairing=PAIRINGS[self.pairing.currentIndex()],
        )
        return replace(
            project,
            source=self.source.applied_to(project.source),
            target=self.target.applied_to(project.target),
            boundary=boundary,
        )

    def _on_apply(self) -> None:
        project = self._form_project()
        if project is not None:
            self.applied.emit(project)

    def _on_curves(self) -> None:
        if self._session.results is not None:
            CurvesDialog(self._session.results, self).show()

    def _on_reset(self) -> None:
        self._show(self._session.project, self._session.results)

    def _on_typed(self) -> None:
        project = self._form_project()
        differs = project is not None and project != self._session.project
        self.apply_button.setEnabled(differs)
        self.reset_button.setEnabled(differs)

    def _on_project(self, project: Project | None) -> None:
        self.setEnabled(project is not None)
        self._show(project, self._session.results)

    def _on_results(self, results: Results | None) -> None:
        self.curves_button.setEnabled(results is not None)
        if not self.apply_button.isEnabled():  # what is being typed stays
            self._show(self._session.project, results)

    def _show(self, project: Project | None, results: Results | None) -> None:
        self.curves_button.setEnabled(results is not None)
        if project is not None:
            self.source.show(project.source, results.source if results else None)
            self.target.show(project.target, results.target if results else None)
            self.pairing.setCurrentIndex(PAIRINGS.index(project.boundary.pairing))
            self.per_seam.setValue(project.boundary.per_seam)
            self.per_side.setValue(project.boundary.per_side)
        self._on_typed()


def _label(text: str, tip: str) -> QLabel:
    label = QLabel(text)
    label.setToolTip(tip)
    return label


def _spin_box(name: str, low: int, high: int) -> QSpinBox:
    box = QSpinBox()
    box.setRange(low, high)
    box.setAccessibleName(name)
    box.setMinimumWidth(56)
    return box


def _changed_signal(widget: QWidget) -> Any:
    if isinstance(widget, QLineEdit):
        return widget.textChanged
    if isinstance(widget, QComboBox):
        return widget.currentIndexChanged
    return widget.valueChanged  # type: ignore[attr-defined]
