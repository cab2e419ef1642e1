# SPDX-License-Identifier: GPL-3.0-or-later
"""Texts for ground stations: in the pieces of STATUSTEXT, and each refusal only once per attempt."""

_SIZE = 50
#: A client repeats a request within 0.7 s; a pilot who tries again takes longer, and gets the reason again.
_QUIET_S = 1.0
#: Beyond this limit a text may be repeated.
_MAX_TEXTS = 16


def cut_text(text: str) -> list[str]:
    """Cut into pieces of 50 characters; the last one is shorter, and may be empty, which ends the text."""
    if len(text) <= _SIZE:
        return [text]
    return [text[at : at + _SIZE] for at in range(0, len(text) + 1, _SIZE)]


def split_text(text: str) -> list[str]:
    """Split at spaces into pieces of 50 characters, padded with at least one space; the last one is shorter.

    A piece shorter than 50 ends the text for clients that join pieces without a separator (STATUSTEXT.chunk_seq).
    """
    pieces: list[str] = []
    while len(text) > _SIZE - bool(pieces):
        cut = text.rfind(" ", 1, _SIZE)
        cut = cut if cut > 0 else _SIZE
        pieces.append(text[:cut].ljust(_SIZE))
        text = text[cut:].lstrip()
    return [*pieces, text]


class RecentTexts:
    """Remembers each text to one ground station until 1 s has passed without a repetition.

    Mission Planner repeats a request up to seven times, and one text is enough.
    """

    def __init__(self) -> None:
        self._sent: dict[str, float] = {}  # oldest first

    def is_new(self, text: str, now: float) -> bool:
        sent_at = self._sent.pop(text, None)
        self._sent[text] = now
        if len(self._sent) > _MAX_TEXTS:
            del self._sent[next(iter(self._sent))]
        return sent_at is None or now >= sent_at + _QUIET_S
