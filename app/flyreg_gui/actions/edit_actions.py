"""The Edit menu: selection, kept weights, preparation, and what repeats a registration."""

from __future__ import annotations

from flyreg_gui.actions.action_spec import ActionSpec

EDIT_ACTIONS = (
    ActionSpec(
        "select_all",
        "Edit",
        "Select &all landmarks",
        ("Ctrl+A",),
        lambda w: w.select_all(),
        needs="results",
    ),
    ActionSpec("escape", "Edit", "Select &nothing", ("Esc",), lambda w: w.escape()),
    *(
        ActionSpec(
            f"{verb}_{name}",
            "Edit",
            text.format(name),
            (f"Ctrl+{modifier}+{name}",),
            lambda w, verb=verb, name=name: getattr(w.blink, verb)(name),
            tip.format(name),
            needs=needs.format(name),
        )
        for verb, text, modifier, tip, needs in (
            ("keep", "Keep weights as {}", "Shift", "Remember weights and λ as {}", "results"),
            ("take", "Take weights {}", "Alt", "Go back to the weights and λ of {}", "snapshot {}"),
        )
        for name in ("A", "B")
    ),
    ActionSpec(
        "drill",
        "Edit",
        "&Drill a channel",
        ("D",),
        lambda w, on: w.drill.set_on(on),
        "Click where the oesophagus opens at the front of a brain, then at its back",
        is_on=False,
        needs="brains",
    ),
    ActionSpec(
        "trim",
        "Edit",
        "Adjust &trimming and cut",
        ("P",),
        lambda w, on: w.trim.set_on(on),
        "Drag the planes that cut the optic lobes off, and the cut between the halves",
        is_on=False,
        needs="brains",
        short="Trim and cut",
    ),
    ActionSpec(
        "copy_command",
        "Edit",
        "Copy as &command line",
        ("Ctrl+Shift+C",),
        lambda w: w.files.copy_command(),
        "The flyreg command that repeats this registration",
        needs="project",
    ),
    ActionSpec(
        "copy_python",
        "Edit",
        "Copy as P&ython",
        ("Ctrl+Alt+C",),
        lambda w: w.files.copy_python(),
        "A program that repeats this registration, to the last digit",
        needs="project",
    ),
    ActionSpec(
        "preferences",
        "Edit",
        "Pre&ferences…",
        ("Ctrl+,",),
        lambda w: w.show_preferences(),
    ),
)
