"""ParaView's collections of files by time, which end in .pvd."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ..errors import ContactError


@dataclass(frozen=True)
class Entry:
    """A file of a collection.

    Attributes
    ----------
    time
        As text, to the digit.
    part
        Number among the files of one time.
    file
        Name, in the folder of the collection.
    """

    time: str
    part: int
    file: str


def read(path: Path) -> list[Entry]:
    """Files of a collection; none where there is no such file.

    Raises
    ------
    ContactError
        If it cannot be read.
    """
    if not path.exists():
        return []
    try:
        sets = ElementTree.parse(path).getroot().iter("DataSet")
        return [
            Entry(one.attrib["timestep"], int(one.get("part", 0)), one.attrib["file"])
            for one in sets
        ]
    except (OSError, ElementTree.ParseError, KeyError, ValueError) as error:
        raise ContactError(f"{path} cannot be read: {error}") from None


def write(path: Path, entries: Sequence[Entry]) -> None:
    """Write a collection in place of an older one, which is there until then."""
    root = ElementTree.Element("VTKFile", type="Collection", version="1.0")
    collection = ElementTree.SubElement(root, "Collection")
    for one in entries:
        ElementTree.SubElement(
            collection, "DataSet", timestep=one.time, part=str(one.part), file=one.file
        )
    ElementTree.indent(root)
    new = path.with_name(path.name + ".new")
    ElementTree.ElementTree(root).write(new, encoding="utf-8", xml_declaration=True)
    new.replace(path)
