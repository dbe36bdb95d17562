"""The File menu: brains, projects and pictures in and out."""

from __future__ import annotations

from flyreg_gui.actions.action_spec import ActionSpec

FILE_ACTIONS = (
    ActionSpec(
        "open_brains", "File", "Open &brains…", ("Ctrl+N",), lambda w: w.files.open_brains()
    ),
    ActionSpec(
        "templates",
        "File",
        "Open &templates…",
        ("Ctrl+Shift+N",),
        lambda w: w.files.open_templates(),
        "Choose among the template brains of flybrains by their pictures",
    ),
    ActionSpec(
        "open_project", "File", "&Open project…", ("Ctrl+O",), lambda w: w.files.open_project()
    ),
    ActionSpec("demo", "File", "Open the &demo", (), lambda w: w.files.open_demo()),
    ActionSpec(
        "save", "File", "&Save project", ("Ctrl+S",), lambda w: w.files.save(), needs="project"
    ),
    ActionSpec(
        "save_as",
        "File",
        "Save project &as…",
        ("Ctrl+Shift+S",),
        lambda w: w.files.save_as(),
        needs="project",
    ),
    ActionSpec(
        "export",
        "File",
        "&Export registered mesh…",
        ("Ctrl+E",),
        lambda w: w.files.export(),
        needs="current",
    ),
    ActionSpec(
        "report",
        "File",
        "Save &report…",
        (),
        lambda w: w.reports.save(),
        "Write a web page with pictures and all figures, and the project that repeats it",
        needs="measured",
    ),
    ActionSpec(
        "report_on_points",
        "File",
        "Save report, measured on po&ints…",
        (),
        lambda w: w.reports.save_on_points(),
        "Name corresponding points; the page tells how far from where they belong they land",
        needs="measured",
    ),
    ActionSpec(
        "compare",
        "File",
        "Compare with ot&her methods…",
        (),
        lambda w: w.comparing.show(),
        "Lay the source on the target by other methods too, and show what each comes to",
        needs="project",
    ),
    ActionSpec(
        "export_vertex_pairs",
        "File",
        "Export &vertex pairs for navis…",
        (),
        lambda w: w.taking_away.export_vertex_pairs(),
        "Write where 1,000 vertices of the source go, for navis.transforms.TPStransform",
        needs="current",
    ),
    ActionSpec(
        "carry_points",
        "File",
        "&Carry points to the target…",
        (),
        lambda w: w.taking_away.carry_points(),
        "Read points near the source's surface and write them on the target",
        needs="current",
    ),
    ActionSpec(
        "carry_points_back",
        "File",
        "Carry points &back to the source…",
        (),
        lambda w: w.taking_away.carry_points(is_inverse=True),
        "Read points near the target's surface and write them on the source",
        needs="current",
    ),
    ActionSpec("quit", "File", "&Quit", ("Ctrl+Q",), lambda w: w.close()),
    ActionSpec(
        "screenshot",
        "Pictures",
        "Of the &window…",
        ("Alt+S",),
        lambda w: w.pictures.save_window(),
        short="Picture of the window",
    ),
    ActionSpec(
        "picture_of_views",
        "Pictures",
        "Of &all views…",
        (),
        lambda w: w.pictures.save_all_views(),
        needs="results",
        short="Picture of all views",
    ),
    ActionSpec(
        "picture_of_view",
        "Pictures",
        "Of the &current view…",
        ("Alt+Shift+S",),
        lambda w: w.pictures.save_view(),
        "The view that was clicked last",
        needs="results",
        short="Picture of the current view",
    ),
    ActionSpec(
        "turn",
        "Pictures",
        "&Turning once…",
        (),
        lambda w: w.pictures.save_turn(),
        "An animated GIF, or a folder of pictures",
        needs="results",
        short="Turning picture",
    ),
)
