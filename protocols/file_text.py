# SPDX-License-Identifier: GPL-3.0-or-later
"""The text of a file that a person brings, whatever program wrote it."""

import codecs

_UTF_16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


def file_text(data: bytes) -> str:
    """Decode UTF-8, UTF-16 with its mark, or else Windows-1252, as older ground stations write it.

    Names and numbers in all our formats are ASCII, so only a comment can come out as other letters.
    """
    if data.startswith(_UTF_16):
        return data.decode("utf-16", "replace")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", "replace")
