"""Landmarks of Fiji's Name Landmarks and Register: the points of one brain as XML."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from xml.etree import ElementTree

from flyreg_core.errors import LandmarkError
from flyreg_core.files import write_atomically
from flyreg_core.named_pairs import NamedPair, Role, Row, end_of, one_ended, parse_point

PROLOGUE = """<?xml version="1.0" encoding="UTF-8"?>
<!DOCTYPE namedpointset [
  <!ELEMENT namedpointset (pointworld*)>
  <!ELEMENT pointworld EMPTY>
  <!ATTLIST namedpointset version CDATA #REQUIRED>
  <!ATTLIST pointworld set (true|false) #REQUIRED>
  <!ATTLIST pointworld name CDATA #REQUIRED>
  <!ATTLIST pointworld x CDATA #IMPLIED>
  <!ATTLIST pointworld y CDATA #IMPLIED>
  <!ATTLIST pointworld z CDATA #IMPLIED>
]>

"""
"""What Fiji begins its files with."""
NOT_IN_XML = re.compile("[^\\t\\n\\r\\x20-\\ud7ff\\ue000-\\ufffd\\U00010000-\\U0010ffff]")


def read_fiji(text: str, path: Path, role: Role) -> list[Row]:
    """Read what Fiji's Name Landmarks writes: names that are placed or not, in the world's units."""
    try:
        named = list(ElementTree.fromstring(text).iter("pointworld"))
    except ElementTree.ParseError as error:
        raise LandmarkError(f"{path} is damaged ({error}); export it again") from error
    rows: list[Row] = []
    for number, point in enumerate(named, start=1):
        place, cells = f"point {number}", [point.get(axis) for axis in "xyz"]
        position = parse_point(cells, f"{path}, {place}") if point.get("set") != "false" else None
        name = (point.get("name") or f"F-{number}").strip()
        rows.append((place, one_ended(name, position, role)))
    return rows


def write_fiji(path: Path, pairs: Iterable[NamedPair], role: Role) -> None:
    """Write the points of one brain as Fiji reads them (.points).

    Whether a landmark is active has no place in this format.

    Raises
    ------
    LandmarkError
        A name has a character that XML cannot hold.
    InputError
        The file cannot be written.
    """
    root = ElementTree.Element("namedpointset", version="1.0")
    for pair in pairs:
        if NOT_IN_XML.search(pair.name):
            raise LandmarkError(
                f"the name {pair.name!r} has a character that Fiji's files cannot hold; rename it"
            )
        end = end_of(pair, role)
        point = ElementTree.SubElement(
            root, "pointworld", set="true" if end else "false", name=pair.name
        )
        for axis, value in zip("xyz", end or (), strict=False):
            point.set(axis, repr(float(value)))
    ElementTree.indent(root)
    write_atomically(path, PROLOGUE + ElementTree.tostring(root, encoding="unicode") + "\n")
