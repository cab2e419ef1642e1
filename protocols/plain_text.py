# SPDX-License-Identifier: GPL-3.0-or-later
"""Text from files, programs and the wire, made safe to show: on a terminal escape sequences would be carried out."""


def plain_text(text: str) -> str:
    """The text on one line, without control and formatting characters; letters of all languages stay.

    Left out are C0 and C1 controls, marks that reverse the direction of writing, and characters without a glyph. Any
    white space becomes a space, and a byte of a file name that is not UTF-8 a question mark.
    """
    known = text.encode(errors="replace").decode()  # lone surrogates become question marks
    return "".join(each if each.isprintable() else " " if each.isspace() else "" for each in known)
