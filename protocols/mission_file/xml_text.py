# SPDX-License-Identifier: GPL-3.0-or-later
"""XML in mission files: a tree of elements with lower-case names, or a MissionFileError."""

from xml.etree.ElementTree import Element, ParseError, fromstring

from protocols.mission_file.error import MissionFileError

#: Characters. The parsed tree takes up to forty times the memory of the text.
MAX_SIZE = 2 * 2**20


def parse_xml(text: str, name: str) -> Element:
    """The root element. Names of elements and attributes lose their namespace and become lower-case.

    A document type is refused, because the entities in it can grow without limit or name other files.
    """
    if len(text) > MAX_SIZE:
        raise MissionFileError(name, "", "this XML is longer than 2 MB", "save only the path to be flown")
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise MissionFileError(name, "", "this XML has a document type", "delete the line that begins with <!DOCTYPE")
    try:
        root = fromstring(text)  # noqa: S314 - without a document type it has no entities
    except ParseError as error:
        line, _ = error.position
        raise MissionFileError(name, f"line {line}", "this XML is damaged", "save the file again") from None
    for element in root.iter():
        element.tag = element.tag.rpartition("}")[2].lower()
        element.attrib = {key.rpartition("}")[2].lower(): value for key, value in element.attrib.items()}
    return root
