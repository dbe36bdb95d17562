"""What comes with flyreg besides its code: the help texts and the maker of the demo pair."""

from importlib.resources import files
from pathlib import Path

__all__ = ["landmark_lists", "read_help"]


def read_help(name: str) -> str:
    """Return a help text by its file name in the `help` folder."""
    return files(__name__).joinpath("help", name).read_text(encoding="utf-8")


def landmark_lists() -> list[Path]:
    """Return the files with names of landmarks that are placed one after the other."""
    return sorted(Path(str(files(__name__))).joinpath("presets").glob("*.txt"))
