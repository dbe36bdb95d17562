"""What comes with flyreg besides its code: the help texts and the maker of the demo pair."""

from importlib.resources import files

__all__ = ["read_help"]


def read_help(name: str) -> str:
    """Return a help text by its file name in the `help` folder."""
    return files(__name__).joinpath("help", name).read_text(encoding="utf-8")
