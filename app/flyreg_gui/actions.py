"""All actions of the window in one table: text, keys, menu, and what they do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QMenu

from flyreg_gui.help_window import MOUSE_AND_KEYS

if TYPE_CHECKING:
    from flyreg_gui.main_window import MainWindow

SEPARATOR = ""


@dataclass(frozen=True)
class ActionSpec:
    """One line of the table."""

    name: str
    menu: str
    text: str
    keys: tuple[str, ...]
    do: Callable[[MainWindow], object] | Callable[[MainWindow, bool], object]
    tip: str = ""
    is_on: bool | None = None  # None: not a switch
    needs: str = (
        ""  # "project", "brains", "results", "current", "measured", "snapshots", "neuropils": grey
    )


SPECS = (
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
    ActionSpec(
        "screenshot",
        "Pictures",
        "Of the &window…",
        ("Alt+S",),
        lambda w: w.pictures.save_window(),
    ),
    ActionSpec(
        "picture_of_views",
        "Pictures",
        "Of &all views…",
        (),
        lambda w: w.pictures.save_all_views(),
        needs="results",
    ),
    ActionSpec(
        "picture_of_view",
        "Pictures",
        "Of the &current view…",
        ("Alt+Shift+S",),
        lambda w: w.pictures.save_view(),
        "The view that was clicked last",
        needs="results",
    ),
    ActionSpec(
        "turn",
        "Pictures",
        "&Turning once…",
        (),
        lambda w: w.pictures.save_turn(),
        "An animated GIF, or a folder of pictures",
        needs="results",
    ),
    ActionSpec("quit", "File", "&Quit", ("Ctrl+Q",), lambda w: w.close()),
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
        "landmark_mode",
        "Landmarks",
        "&Landmark mode",
        ("Space",),
        lambda w, on: w.mode.set_on(on),
        "Click a place on the source and the same place on the target to make a landmark",
        is_on=False,
        needs="results",
    ),
    ActionSpec(
        "accept",
        "Landmarks",
        "&Accept suggestions",
        ("Ctrl+Return",),
        lambda w: w.landmark_commands.accept(),
        "Make the selected suggestions landmarks of your own; Delete drops them instead",
        needs="results",
    ),
    ActionSpec(
        "mirror",
        "Landmarks",
        "Add &mirrored twin",
        ("M",),
        lambda w: w.landmark_commands.mirror(),
        "Add the selected landmarks at the same places on the other side of the animal",
        needs="results",
    ),
    ActionSpec(
        "mute",
        "Landmarks",
        "M&ute or unmute",
        ("Ctrl+Backspace", "U"),
        lambda w: w.landmark_commands.toggle_muted(),
        "See what happens without the selected landmarks; they keep their weights",
        needs="results",
    ),
    ActionSpec(
        "solo",
        "Landmarks",
        "&Solo",
        ("S",),
        lambda w: w.landmark_commands.toggle_solo(),
        "Have only the selected landmarks and the corners pull, or all again",
        needs="results",
    ),
    ActionSpec(
        "recolor",
        "Landmarks",
        "&Colour…",
        (),
        lambda w: w.landmark_commands.recolor(),
        "Give the selected landmarks of your own a colour",
        needs="results",
    ),
    ActionSpec(
        "delete",
        "Landmarks",
        "Delete land&marks",
        ("Del", "Backspace"),
        lambda w: w.delete_landmarks(),
        "Removes landmarks of your own; sets those on the boundary to weight 0",
        needs="results",
    ),
    ActionSpec(
        "next_unplaced",
        "Landmarks",
        "&Next one to place",
        ("Ctrl+D",),
        lambda w: w.mode.skip(),
        "Select the next landmark that is not placed on both brains",
        needs="results",
    ),
    ActionSpec(
        "template",
        "Landmarks",
        "&List of landmarks to place…",
        (),
        lambda w: w.landmark_commands.add_template(),
        "Add the names of a list, to be placed one after the other",
        needs="results",
    ),
    ActionSpec(
        "neuropils",
        "Landmarks",
        "Load neu&ropils…",
        (),
        lambda w: w.landmark_commands.load_neuropils(),
        "Load surfaces of neuropils, near which landmarks can be weighted together",
        needs="results",
    ),
    ActionSpec(
        "import_landmarks",
        "Landmarks",
        "&Import landmarks…",
        ("Ctrl+I",),
        lambda w: w.landmark_commands.import_landmarks(),
        "Read landmarks of BigWarp, 3D Slicer, OpenSim Creator, Fiji or flybrains",
        needs="results",
    ),
    ActionSpec(
        "export_landmarks",
        "Landmarks",
        "&Export landmarks…",
        (),
        lambda w: w.landmark_commands.export_landmarks(),
        "Write your own landmarks for BigWarp, 3D Slicer, OpenSim Creator or Fiji",
        needs="project",
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
    ActionSpec(
        "tunnels",
        "View",
        "Show &tunnels",
        ("T",),
        lambda w, on: w.tunnels.set_on(on),
        "Show the tunnels through the brains, and say which one is the oesophagus",
        is_on=False,
        needs="brains",
    ),
    ActionSpec(
        "origins",
        "View",
        "Where the surface &comes from",
        ("O",),
        lambda w, on: w.judging.show_origins(on),
        "Show in colours what was filled, drilled, trimmed or bridged",
        is_on=False,
        needs="results",
    ),
    ActionSpec(
        "blink",
        "View",
        "&Blink A / B",
        ("B",),
        lambda w, on: w.blink.set_on(on),
        "Show the registration with the weights and λ of A and of B in turn",
        is_on=False,
        needs="snapshots",
    ),
    ActionSpec(
        "link",
        "View",
        "&Link cameras",
        ("Ctrl+L",),
        lambda w, on: w.view_area.link.set_on(on),
        "Turn all three brains together",
        is_on=True,
    ),
    ActionSpec(
        "rotation_only",
        "View",
        "Link rot&ation only",
        (),
        lambda w, on: w.view_area.link.set_rotation_only(on),
        "Linked cameras turn together, but each brain is moved and enlarged by itself",
        is_on=False,
    ),
    ActionSpec(
        "home",
        "View",
        "&Reset views",
        ("R",),
        lambda w: w.view_area.go_home(),
        "Show everything as at first: the brains from the front",
        needs="brains",
    ),
    *(
        ActionSpec(
            f"from_{side}",
            "Look from",
            text,
            (key,),
            lambda w, side=side: w.view_commands.look_from(side),
            f"See the whole brains {tip}",
            needs="brains",
        )
        for key, side, text, tip in (
            ("1", "front", "The &front", "from the front"),
            ("2", "back", "The &back", "from behind"),
            ("3", "left", "The animal's &left", "from the animal's left"),
            ("4", "right", "The animal's &right", "from the animal's right"),
            ("5", "top", "The &top", "from above, anterior up"),
            ("6", "bottom", "The b&ottom", "from below, anterior up"),
        )
    ),
    ActionSpec(
        "give_view",
        "View",
        "Others as the one under the &mouse",
        ("Q",),
        lambda w: w.view_commands.give_view(),
        "See all brains as the one under the mouse",
        needs="brains",
    ),
    ActionSpec(
        "take_view",
        "View",
        "The one under the mouse as the sourc&e",
        ("W",),
        lambda w: w.view_commands.take_view(),
        "See the brain under the mouse as the source, or the source as the target",
        needs="brains",
    ),
    ActionSpec(
        "focus",
        "View",
        "&Focus under the mouse",
        ("F",),
        lambda w: w.view_commands.focus(),
        "Bring what is under the mouse to the middle and turn around it",
        needs="results",
    ),
    ActionSpec(
        "fly",
        "View",
        "&Go to the selected landmark",
        ("G",),
        lambda w: w.view_commands.fly_to_selected(),
        "Turn the brains so that the selected landmark faces you",
        needs="results",
    ),
    ActionSpec(
        "blink_target",
        "View",
        "Bl&ink registered and target",
        ("J",),
        lambda w, on: w.view_commands.set_blinking(on),
        "Show the registered source and the target in turn",
        is_on=False,
        needs="results",
    ),
    ActionSpec(
        "cut_through",
        "View",
        "&Cut through the brains",
        ("K",),
        lambda w, on: w.view_area.cut_bar.set_on(on),
        "Cut all brains at corresponding places and look inside",
        is_on=False,
        needs="results",
    ),
    ActionSpec(
        "markers",
        "View",
        "Show lan&dmarks",
        ("V",),
        lambda w, on: w.view_area.set_markers_shown(on),
        "Show or hide landmarks",
        is_on=True,
    ),
    ActionSpec(
        "show_neuropils",
        "View",
        "Show ne&uropils",
        ("I",),
        lambda w, on: w.neuropil_views.set_on(on),
        "Show or hide the neuropils that were loaded, through the surface of their brain",
        is_on=True,
        needs="neuropils",
    ),
    ActionSpec(
        "own_names",
        "View",
        "&Names of your landmarks",
        ("N",),
        lambda w, on: w.view_area.set_own_named(on),
        "Write the names of landmarks of your own beside them",
        is_on=False,
    ),
    *(
        ActionSpec(
            name,
            "View",
            text,
            keys,
            lambda w, direction=direction: w.view_commands.resize_markers(direction),
            f"Draw landmarks {tip}",
        )
        for name, text, keys, direction, tip in (
            ("larger_markers", "Lar&ger landmarks", ("+", "="), 1, "larger"),
            ("smaller_markers", "&Smaller landmarks", ("-",), -1, "smaller"),
        )
    ),
    ActionSpec(
        "dark",
        "View",
        "&Dark or light",
        ("Ctrl+Shift+T",),
        lambda w: w.toggle_dark(),
        "Turn the window dark, or light again",
    ),
    ActionSpec("help", "Help", "&Help pages", ("Shift+F1",), lambda w: w.show_help("Brains")),
    ActionSpec(
        "shortcuts", "Help", "Mouse and &keys", ("F1",), lambda w: w.show_help(MOUSE_AND_KEYS)
    ),
    ActionSpec(
        "method", "Help", "About the &method", (), lambda w: w.show_help("About the method")
    ),
    ActionSpec("tour", "Help", "&Tour of the window", (), lambda w: w.tour.start()),
)


def make_actions(window: MainWindow) -> dict[str, QAction]:
    """Return the actions by name, each ready to be triggered."""
    actions = {}
    for spec in SPECS:
        action = QAction(spec.text, window)
        action.setObjectName(spec.name)
        action.setShortcuts([QKeySequence(key) for key in spec.keys])
        if spec.tip:
            action.setToolTip(spec.tip)
            action.setStatusTip(spec.tip)
        if spec.is_on is None:
            action.triggered.connect(lambda _on, do=spec.do: do(window))
        else:
            action.setCheckable(True)
            action.setChecked(spec.is_on)
            action.toggled.connect(lambda on, do=spec.do: do(window, on))
        actions[spec.name] = action
    return actions


def fill_menu(menu: QMenu, actions: dict[str, QAction], breaks: tuple[str, ...] = ()) -> None:
    """Put the actions of a menu into it, with a line before each of `breaks`."""
    for spec in SPECS:
        if spec.menu == menu.objectName():
            if spec.name in breaks:
                menu.addSeparator()
            menu.addAction(actions[spec.name])


def enable_actions(actions: dict[str, QAction], met: set[str]) -> None:
    """Grey out what cannot be done now."""
    for spec in SPECS:
        actions[spec.name].setEnabled(not spec.needs or spec.needs in met)
