# SPDX-License-Identifier: GPL-3.0-or-later
"""Text of others, made safe to show: a terminal would obey escape sequences in it."""

from typing import NewType

#: Foreign text on one line, without control and formatting characters. Made by `plain_text` alone.
PlainText = NewType("PlainText", str)


def plain_text(text: str | bytes) -> PlainText:
    """The text on one line, without control and formatting characters; letters of all languages stay.

    Left out are C0 and C1 controls, marks that reverse the direction of writing, and characters without a glyph. Any
    white space becomes a space, a byte of a file name that is not UTF-8 a question mark, any other such byte U+FFFD.
    """
    known = text.decode(errors="replace") if isinstance(text, bytes) else text
    if known.isprintable():
        return PlainText(known)
    known = known.encode(errors="replace").decode()  # lone surrogates become question marks
    return PlainText("".join(each if each.isprintable() else " " if each.isspace() else "" for each in known))
