"""What the Landmarks menu does with the selected landmarks, and with files of landmarks."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QColorDialog, QFileDialog, QInputDialog

from flyreg_core import edits, mesh_formats
from flyreg_core.brain_files import UM_PER_UNIT
from flyreg_core.errors import FlyregError
from flyreg_core.landmark_files import (
    FORMATS,
    LandmarkFormat,
    read_landmark_pairs,
    read_template,
    to_landmark_pairs,
    to_named_pairs,
)
from flyreg_core.landmarks import LandmarkPair
from flyreg_core.named_pairs import NamedPair
from flyreg_core.neuropils import near_neuropil, near_place, open_neuropils
from flyreg_core.project import Project, Role
from flyreg_core.twins import twin_of
from flyreg_gui.failures import sentence_for
from flyreg_gui.panels.neighbourhood import SELECTED
from flyreg_gui.preparing import ROLES
from flyreg_gui.steps import short_name

if TYPE_CHECKING:
    from flyreg_gui.main_window import MainWindow

LANDMARK_FILTER = "Landmarks (*.csv *.txt *.json *.fcsv *.points);;All files (*)"
TEMPLATE_FILTER = "Lists of names (*.txt *.csv);;All files (*)"
NEUROPIL_FILTER = f"Surfaces ({' '.join('*' + end for end in mesh_formats.ENDINGS)});;All files (*)"
EXPORT_FILTERS = {f"{kind.title} (*{kind.ending})": kind for kind in FORMATS}
LARGEST_FACTOR_WEIGHT = 1e6


class LandmarkCommands:
    """Edits that concern several landmarks; each is one undo step."""

    def __init__(self, window: MainWindow) -> None:
        self._window = window
        self._session, self._selection = window.session, window.selection

    # The selected landmarks

    def accept(self) -> None:
        """Make the selected suggestions landmarks of the user's own."""
        project = self._session.project
        chosen = self._window.landmarks.suggested
        if project is not None and chosen:
            self._session.edit(
                f"accept {_named(chosen)}", edits.accept_suggestions(project, chosen)
            )

    def mirror(self) -> None:
        """Add the twins of the selected landmarks on the other side of the animal."""
        project, results = self._session.project, self._session.results
        chosen = [pair for pair in self._window.landmarks.chosen if pair.origin == "user"]
        if project is None or results is None:
            return
        if not chosen:
            self._window.show_problem("Select landmarks of your own to add their mirrored twins.")
            return
        twins = [twin_of(pair, results.source.flat, results.target.flat) for pair in chosen]
        known = {pair.name for pair in project.pairs}
        new = [twin for twin in twins if twin.name not in known]
        if not new:
            self._window.show_problem(f"There is a landmark named {twins[0].name} already.")
            return
        self._session.edit(f"add twin of {_named(chosen)}", edits.merge_pairs(project, new))
        names = {twin.name for twin in new}
        self._selection.select(pair.id for pair in self._pairs() if pair.name in names)

    def toggle_muted(self) -> None:
        """Mute the selected landmarks, or have them pull again if all of them are muted."""
        project, chosen = self._session.project, self._selection.ids
        if project is not None and chosen:
            on = not all(identifier in project.muted for identifier in chosen)
            verb = "mute" if on else "unmute"
            muted = edits.set_muted(project, chosen, on)
            self._session.edit(f"{verb} {_named(self._window.landmarks.chosen)}", muted)

    def set_acting(self, identifier: str, on: bool) -> None:
        """Have one landmark pull or not, as its tick in the table says."""
        project = self._session.project
        if project is None:
            return
        if project.solo:
            others = set(project.solo)
            chosen = others | {identifier} if on else others - {identifier}
            self._session.edit("change solo", edits.set_solo(project, chosen))
        else:
            text = "unmute landmark" if on else "mute landmark"
            self._session.edit(text, edits.set_muted(project, [identifier], not on))

    def toggle_solo(self) -> None:
        """Have only the selected landmarks pull, or all again."""
        project, chosen = self._session.project, self._selection.ids
        if project is not None and project.solo:
            self._session.edit("end solo", edits.set_solo(project, []))
        elif project is not None and chosen:
            solo = edits.set_solo(project, chosen)
            self._session.edit(f"solo {_named(self._window.landmarks.chosen)}", solo)

    def recolor(self) -> None:
        """Ask for a colour for the selected landmarks of the user's own."""
        project = self._session.project
        chosen = [pair for pair in self._window.landmarks.chosen if pair.origin == "user"]
        if project is None or not chosen:
            self._window.show_problem("Select landmarks of your own to give them a colour.")
            return
        first = chosen[-1].color
        color = QColorDialog.getColor(QColor(*first) if first else QColor(), self._window)
        if color.isValid():
            ids = [pair.id for pair in chosen]
            tint = (color.red(), color.green(), color.blue())
            colored = edits.recolor_pairs(project, ids, tint)
            self._session.edit(f"colour {_named(chosen)}", colored)

    def weigh_near(self, place: str, reach_um: float, factor: float) -> None:
        """Select the landmarks near a place; multiply their weights by a factor."""
        project, results = self._session.project, self._session.results
        if project is None or results is None:
            return
        if place == SELECTED:
            mark = next(
                (m for m in results.landmarks if m.pair.id == self._selection.current), None
            )
            if mark is None:
                self._window.show_problem("Select the landmark whose neighbourhood is meant.")
                return
            found = near_place(mark.target_point, "target", results.landmarks, reach_um)
            near = sorted(found, key=lambda identifier: identifier == mark.pair.id)  # stays current
        else:
            neuropil = self._window.neuropils.by_name[place]
            near = [*near_neuropil(neuropil, results.landmarks, reach_um)]
        if not near:
            self._window.show_problem(
                f"No landmark lies within {reach_um:.0f} µm of {place}; widen the reach, or add one."
            )
            return
        self._window.show_problem("")
        if factor != 1.0:
            self._multiply(project, near, factor, place)
        self._selection.select(near)
        self._window.say(_near_in_words(len(near), place, reach_um, factor))

    def _multiply(self, project: Project, near: Iterable[str], factor: float, place: str) -> None:
        pairs = {pair.id: pair.weight for pair in self._pairs()}
        weights = {
            identifier: float(
                f"{np.clip(pairs[identifier] * factor, 0, LARGEST_FACTOR_WEIGHT):.3g}"
            )
            for identifier in near
            if identifier in pairs
        }
        verb = "raise" if factor > 1 else "lower"
        text = f"{verb} {len(weights)} weights near {place}"
        self._session.edit(text, edits.set_each_weight(project, weights))

    # Files

    def import_landmarks(self) -> None:
        """Ask for a file of landmarks and take them over."""
        path = self._ask_for_file("Import landmarks", LANDMARK_FILTER)
        if path is not None:
            self.import_from(path)

    def import_from(self, path: Path) -> None:
        """Take the landmarks of a file over; those of known names move."""
        self._try(lambda project: self._imported(project, path), f"import {path.name}")

    def _imported(self, project: Project, path: Path) -> Project | None:
        named = read_landmark_pairs(path)
        if not any(pair.source and pair.target for pair in named):
            role = self._ask_for_role(f"The landmarks of {path.name} are places of the")
            if role is None:
                return None
            named = read_landmark_pairs(path, role)
        units = (project.source.input.unit, project.target.input.unit)
        pairs = to_landmark_pairs(named, *(UM_PER_UNIT[unit] for unit in units))
        self._window.say(f"{len(pairs)} landmarks of {path.name}")
        return edits.merge_pairs(project, pairs)

    def export_landmarks(self) -> None:
        """Ask for a file and write the user's own landmarks; weights stay in the project."""
        project = self._session.project
        if project is None:
            return
        suggestion = Path(self._window.preferences.folder) / "landmarks.csv"
        text, chosen = QFileDialog.getSaveFileName(
            self._window, "Export landmarks", str(suggestion), ";;".join(EXPORT_FILTERS)
        )
        if not text:
            return
        units = (project.source.input.unit, project.target.input.unit)
        named = to_named_pairs(project.pairs, *(UM_PER_UNIT[unit] for unit in units))
        kind = _kind_to_write(EXPORT_FILTERS.get(chosen, FORMATS[0]), Path(text))
        path = _with_ending(Path(text), kind.ending)
        try:
            kind.write(path, named)
        except (FlyregError, OSError) as error:
            self._window.show_problem(sentence_for(error))
            return
        on_curves = sum(pair.kind != "interior" for pair in project.pairs)
        self._window.say(_exported_in_words(named, kind, path, on_curves))

    def add_template(self, path: Path | None = None) -> None:
        """Add the names of a list as landmarks that are to be placed one after the other."""
        path = path or self._ask_for_file("Landmarks to place", TEMPLATE_FILTER)
        if path is None:
            return
        self._try(
            lambda project: edits.add_unplaced(project, read_template(path)),
            f"add the landmarks of {path.stem}",
        )
        if self._window.mode.unplaced:
            self._selection.select([self._window.mode.unplaced[0].id])
            self._window.mode.set_on(True)

    def load_neuropils(self) -> None:
        """Ask for files with surfaces of neuropils and take them into the project."""
        project = self._session.project
        if project is None:
            return
        texts, _ = QFileDialog.getOpenFileNames(
            self._window, "Load neuropils", self._window.preferences.folder, NEUROPIL_FILTER
        )
        if not texts:
            return
        role = self._ask_for_role("The neuropils are drawn in the coordinates of the")
        if role is None:
            return
        unit = edits.brain_of(project, role).input.unit

        def with_files(project: Project) -> Project:
            for text in texts:
                project = edits.add_neuropils(project, open_neuropils(Path(text), role, unit))
            return project

        known = set(self._window.neuropils.by_name)
        self._try(with_files, "load neuropils")
        new = [name for name in self._window.neuropils.by_name if name not in known]
        if new:
            self._window.landmarks.neighbourhood.choose(new[0])
            self._window.say(f"Loaded {', '.join(new)}: select or weigh the landmarks near them")

    # What the commands share

    def _try(self, change: Callable[[Project], Project | None], text: str) -> None:
        project = self._session.project
        if project is None:
            return
        try:
            changed = change(project)
        except (FlyregError, OSError) as error:
            self._window.show_problem(sentence_for(error))
            return
        if changed is not None:
            self._window.show_problem("")
            self._session.edit(text, changed)

    def _ask_for_file(self, title: str, filters: str) -> Path | None:
        folder = self._window.preferences.folder
        text, _ = QFileDialog.getOpenFileName(self._window, title, folder, filters)
        return Path(text) if text else None

    def _ask_for_role(self, question: str) -> Role | None:
        project = self._session.project
        if project is None:
            return None
        items = [f"{role}: {short_name(edits.brain_of(project, role).input)}" for role in ROLES]
        text, is_answered = QInputDialog.getItem(
            self._window, "Which brain?", f"{question} …", items, 0, False
        )
        return ("source" if text.startswith("source") else "target") if is_answered else None

    def _pairs(self) -> list[LandmarkPair]:
        model = self._window.landmarks.model
        return [model.pair(row) for row in range(model.rowCount())]


def _kind_to_write(chosen: LandmarkFormat, path: Path) -> LandmarkFormat:
    """Return the format that was chosen, or that of the name's ending if the usual one was left."""
    fitting = [kind for kind in FORMATS if path.suffix.lower() == Path(f"a{kind.ending}").suffix]
    is_left = chosen is FORMATS[0] and chosen not in fitting
    return fitting[0] if is_left and fitting else chosen


def _with_ending(path: Path, ending: str) -> Path:
    """Return a path with the last part of an ending, or with all of it in place of another one."""
    is_right = path.suffix.lower() == Path(f"a{ending}").suffix
    return path if is_right else path.with_suffix(ending)


def _exported_in_words(
    named: Sequence[NamedPair], kind: LandmarkFormat, path: Path, on_curves: int
) -> str:
    """Say how many landmarks were written, and what the file does not tell."""
    written = [pair for pair in named if kind.holds(pair)]
    count = "1 landmark" if len(written) == 1 else f"{len(written)} landmarks"
    texts = [f"Exported {count} to {path}"]
    if lacking := len(named) - len(written):
        texts.append(f"not placed and left out: {lacking}")
    if not kind.has_flags and (unused := sum(not pair.is_active for pair in written)):
        texts.append(f"not in use, which the file cannot say: {unused}")
    if on_curves:
        texts.append(f"{on_curves} on curves stay in the project")
    return "; ".join(texts)


def _near_in_words(count: int, place: str, reach_um: float, factor: float) -> str:
    """Return how many landmarks were found near a place, and what became of them."""
    what = "1 landmark lies" if count == 1 else f"{count} landmarks lie"
    done = "selected" if factor == 1.0 else f"weights × {factor:g}"
    if count == 1 and place == SELECTED:
        alone = "" if factor == 1.0 else f"Weight × {factor:g}. "
        return f"{alone}No other landmark lies within {reach_um:.0f} µm; widen the reach for more"
    return f"{what} within {reach_um:.0f} µm of {place}: {done}"


def _named(pairs: Iterable[LandmarkPair]) -> str:
    names = [pair.name for pair in pairs]
    return names[0] if len(names) == 1 else f"{len(names)} landmarks"
