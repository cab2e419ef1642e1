# SPDX-License-Identifier: GPL-3.0-or-later
"""Text of others, made safe to show, because a terminal would obey escape sequences in it, and files of others."""

import codecs
from typing import NewType

#: Foreign text on one line, without control and formatting characters. Made by `plain_text` alone.
PlainText = NewType("PlainText", str)
_UTF_16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
_LONGEST_QUOTE = 24


def plain_text(text: str | bytes) -> PlainText:
    """The text on one line, without control and formatting characters. Letters of all languages stay.

    Left out are C0 and C1 controls, marks that reverse the direction of writing, and characters without a glyph. Any
    white space becomes a space, a byte of a file name that is not UTF-8 a question mark, any other such byte U+FFFD.
    """
    known = text.decode(errors="replace") if isinstance(text, bytes) else text
    if known.isprintable():
        return PlainText(known)
    known = known.encode(errors="replace").decode()  # lone surrogates become question marks
    return PlainText("".join(each if each.isprintable() else " " if each.isspace() else "" for each in known))


def file_text(data: bytes) -> str:
    """Decode UTF-8, UTF-16 with its mark, or else Windows-1252, as older ground stations write it.

    All line ends become a line feed. Names and numbers in all our formats are ASCII, so only a comment can come out as
    other letters.
    """
    if data.startswith(_UTF_16):
        text = data.decode("utf-16", "replace")
    else:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("cp1252", "replace")
    return text.replace("\r\n", "\n").replace("\r", "\n")


class FileError(Exception):
    """One sentence: the file, the place in it, the problem, the remedy."""

    def __init__(self, name: str, where: str, what: str, remedy: str) -> None:
        place = f"{name}, {where}" if where else name
        super().__init__(f"{place}: {what}; {remedy}")


def shown(found: object) -> str:
    """Quote text from a file: printable, short, on one line."""
    if isinstance(found, list | dict):
        return "a list" if isinstance(found, list) else "an object"
    text = ascii(found)
    return text if len(text) <= _LONGEST_QUOTE else f"{text[:_LONGEST_QUOTE]}..."
