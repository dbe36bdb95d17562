"""The Help menu."""

from __future__ import annotations

from flyreg_gui.actions.action_spec import ActionSpec
from flyreg_gui.help_window import MOUSE_AND_KEYS

HELP_ACTIONS = (
    ActionSpec("help", "Help", "&Help pages", ("Shift+F1",), lambda w: w.show_help("Brains")),
    ActionSpec(
        "shortcuts", "Help", "Mouse and &keys", ("F1",), lambda w: w.show_help(MOUSE_AND_KEYS)
    ),
    ActionSpec(
        "method", "Help", "About the &method", (), lambda w: w.show_help("About the method")
    ),
    ActionSpec("tour", "Help", "&Tour of the window", (), lambda w: w.tour.start()),
)
