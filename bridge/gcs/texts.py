# SPDX-License-Identifier: GPL-3.0-or-later
"""Texts in the pieces of STATUSTEXT."""

_SIZE = 50


def cut_text(text: str) -> list[str]:
    """Cut into pieces of 50 characters; the last one is shorter, and may be empty, which ends the text."""
    if len(text) <= _SIZE:
        return [text]
    return [text[at : at + _SIZE] for at in range(0, len(text) + 1, _SIZE)]


def split_text(text: str) -> list[str]:
    """Split at spaces into pieces of 50 characters, padded with at least one space; the last one is shorter.

    A piece shorter than 50 ends the text for clients that join them with nothing in between (STATUSTEXT.chunk_seq).
    """
    pieces: list[str] = []
    while len(text) > _SIZE - bool(pieces):
        cut = text.rfind(" ", 1, _SIZE)
        cut = cut if cut > 0 else _SIZE
        pieces.append(text[:cut].ljust(_SIZE))
        text = text[cut:].lstrip()
    return [*pieces, text]
