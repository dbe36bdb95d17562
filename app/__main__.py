"""Start flyreg from a checkout: ``python3 app [ARGUMENTS]``.

Sets up what is missing, then opens the window.  Without arguments the window shows how one template
brain is registered to another; where there is no display, the registration runs in the terminal
and a picture of the window goes into a file.  Arguments are passed on to ``flyreg-gui``.
"""

from __future__ import annotations

import sys
from pathlib import Path

import environment
import programs
import system_packages

EXAMPLE = ["FCWB", "JFRC2"]
ARGUMENTS_WITHOUT_WINDOW = {"-h", "--help", "--version"}


def main(arguments: list[str]) -> int:
    """Do what the command line says; return the exit status."""
    if ARGUMENTS_WITHOUT_WINDOW.intersection(arguments):
        system_packages.prepare_system(window=True, private=False)
        return programs.run([environment.set_up("templates").program("flyreg-gui"), *arguments])
    if environment.has_display():
        return open_window(arguments or EXAMPLE, private=False)
    if not arguments:
        return register_example()
    if any(argument.split("=")[0] == "--screenshot" for argument in arguments):
        return open_window(arguments, private=True)
    raise programs.SetUpError(
        "there is no display to show the window on. "
        "Add --screenshot FILE.png to have it drawn into a file."
    )


def open_window(arguments: list[str], *, private: bool) -> int:
    """Open the window on the user's display or on a private one; return its exit status."""
    system_packages.prepare_system(window=True, private=private)
    system_packages.require_window(private=private)
    program = environment.set_up("templates").program("flyreg-gui")
    if not private:
        return programs.run([program, *arguments])
    with environment.private_display() as variables:
        return programs.run([program, *arguments], variables)


def register_example() -> int:
    """Register one template brain to another without a display; say where the results are."""
    system_packages.prepare_system(window=True, private=True)
    python_environment = environment.set_up("templates")
    output = Path.cwd() / "flyreg-output" / "-to-".join(EXAMPLE)
    status = programs.run(
        [python_environment.program("flyreg"), "register", *EXAMPLE, "-o", output]
    )
    if status:
        return status
    print(f"Registered surface: {output / 'registered.ply'}")
    print(f"Report:             {output / 'report.json'}", flush=True)
    picture = output / "window.png"
    window = [python_environment.program("flyreg-gui"), output / "project.flyreg"]
    system_packages.require_window(private=True)
    with environment.private_display() as variables:
        status = programs.run([*window, "--screenshot", picture], variables)
    if not status:
        print(f"Picture of the window: {picture}")
    return status


if __name__ == "__main__":
    sys.exit(programs.run_to_exit_status(main))
