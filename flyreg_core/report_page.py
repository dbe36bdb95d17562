"""report.html: what was registered, how well, and how to repeat it, on one page that needs no other file.

The page is made of the same facts as report.json: each figure on it names the facts' key that it
shows, and none is computed here.
"""

from __future__ import annotations

import base64
import json
import shlex
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

from flyreg_core.chart import Axis, Line, Mark, Panel, draw_panels
from flyreg_core.color_maps import VIRIDIS
from flyreg_core.facts import Facts
from flyreg_core.files import write_atomically
from flyreg_core.progress import Report, ignore
from flyreg_core.report_pictures import Figure, make_figures
from flyreg_core.results import Results

TEMPLATE, STYLE = "report_page.html", "page.css"
WORST_LANDMARKS = 12
"""As many are listed on their own; all follow, folded away."""
DIGITS = 3
"""Significant digits of a figure; the whole number shows when the mouse rests on it."""
UNMEASURED_UM = 1.0
"""End of the colours of distance where none was measured."""


def write_report(
    place: Path, project_file: str, results: Results, facts: Facts, report: Report = ignore
) -> None:
    """Write the facts of a registration as a page and, beside it, as JSON.

    Parameters
    ----------
    place : Path
        Of the page, .html; the other file has the same name with .json.
    project_file : str
        Name of the project beside both, for the command that repeats the registration.
    facts : mapping
        See `report.register_report`; the page tells times and memory if they are among them, and
        the target registration error if there is `target_registration_error`.

    Raises
    ------
    InputError
        A file cannot be written (see `files.write_atomically`).
    """
    page = make_page(facts, results, project_file, report)
    write_atomically(place.with_suffix(".json"), json.dumps(facts, indent=2) + "\n")
    write_atomically(place, page)


def make_page(facts: Facts, results: Results, project_file: str, report: Report = ignore) -> str:
    """Return the page of a registration; see `write_report`."""
    read = json.loads(json.dumps(facts))  # as others read them: names are text, tuples are lists
    distance = read["distance"]
    distance_um = distance["source_to_target"]["p95_um"] if distance else UNMEASURED_UM
    displacement_um = read["displacement_beyond_affine"]["p95_um"]
    figures = make_figures(results, distance_um, displacement_um, report)
    return render(read, figures, project_file)


def render(facts: Mapping[str, Any], figures: Sequence[Figure], project_file: str) -> str:
    """Return the page of facts as JSON has them, with pictures."""
    command = ["flyreg", "register", "--project", project_file, "-o", "again"]
    return fill_page(
        TEMPLATE,
        facts,
        figures=figures,
        worst=_worst_landmarks(facts["landmark_list"]),
        curves=_curves(facts),
        anchors=["#{:02x}{:02x}{:02x}".format(*color) for color in VIRIDIS.anchors],
        command=shlex.join(command),
    )


def fill_page(template: str, facts: Mapping[str, Any], **more: object) -> str:
    """Return a template of this package filled with facts as JSON has them, in the pages' style."""
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters["data_uri"] = _data_uri
    page = environment.from_string(_text_of(template)).render(
        facts=facts, figure=_Figures(facts), style=Markup(_text_of(STYLE)), **more
    )
    return page.encode("utf-8", "backslashreplace").decode("utf-8")  # names may be no valid text


def _text_of(name: str) -> str:
    return resources.files("flyreg_core").joinpath(name).read_text(encoding="utf-8")


class _Figures:
    """Shows a value of the facts by its key, such as `distance.source_to_target.mean_um`."""

    def __init__(self, facts: Mapping[str, Any]) -> None:
        self._facts = facts

    def __call__(self, key: str, unit: str = "") -> Markup:
        """Return an element that holds the value in full and shows it rounded."""
        value = looked_up(self._facts, key)
        if value is None:
            return Markup('<span class="none">unknown</span>')
        full = json.dumps(value)
        shown = f"{full}{unit}" if isinstance(value, bool) else f"{_rounded(value)}{unit}"
        return Markup('<data value="{}" data-key="{}" title="{}">{}</data>').format(
            full, key, full, shown
        )


def looked_up(facts: Any, key: str) -> Any:
    """Return what the facts have under a key such as `landmark_list.3.weight`.

    What remains of a key goes before its first part: a landmark's id may hold a dot.
    """
    rest = key
    while rest:
        if isinstance(facts, dict) and rest in facts:
            return facts[rest]
        part, _, rest = rest.partition(".")
        facts = facts[int(part)] if isinstance(facts, list) else facts[part]
    return facts


def _rounded(value: object) -> str:
    if isinstance(value, float):
        text = f"{value:.{DIGITS}g}"
        return text if "e" not in text or abs(value) < 1e-4 or abs(value) >= 1e6 else f"{value:.0f}"
    return str(value)


def _worst_landmarks(landmarks: Sequence[Mapping[str, Any]]) -> list[int]:
    """Return the numbers of the landmarks that the others foretell worst."""
    known = [n for n, mark in enumerate(landmarks) if mark["leave_one_out_um"] is not None]
    known.sort(key=lambda n: -landmarks[n]["leave_one_out_um"])
    return known[:WORST_LANDMARKS]


def _curves(facts: Mapping[str, Any]) -> list[Markup]:
    """Return the two curves of lambda as pictures; none if they are not known."""
    foretold, bending = facts["smoothing_by_cross_validation"], facts["residual_against_bending"]
    if foretold is None:
        return []
    panels = (
        _foretold_panel(foretold, facts["smoothing"]),
        _bending_panel(bending, foretold["suggested"]),
    )
    return [Markup(draw_panels([panel], ink="currentColor")) for panel in panels]


def _foretold_panel(known: Mapping[str, Any], smoothing: float) -> Panel:
    marks = [] if known["suggested"] is None else [Mark(known["suggested"], "suggested")]
    if smoothing > 0:
        marks.append(Mark(smoothing, "used"))
    return Panel(
        "How badly landmarks are foretold by the others",
        (Line("score", tuple(known["smoothings"]), tuple(known["scores"])),),
        Axis("smoothing λ", is_logarithmic=True),
        Axis("score", is_logarithmic=True),
        tuple(marks),
    )


def _bending_panel(known: Mapping[str, Any], suggested: float | None) -> Panel:
    residuals, energies = known["residuals_rms_um"], known["bending_energies"]
    marks = [Mark(known["residual_rms_um"], "used")]
    if suggested is not None:
        marks.insert(0, Mark(residuals[known["smoothings"].index(suggested)], "suggested"))
    return Panel(
        "What a small residual costs in bending",
        (Line("bending energy", tuple(residuals), tuple(energies)),),
        Axis("residual of the spline, RMS, µm (λ grows to the right)"),
        Axis("bending energy wᵀKw"),
        tuple(marks),
    )


def _data_uri(webp: bytes) -> str:
    return "data:image/webp;base64," + base64.b64encode(webp).decode("ascii")
