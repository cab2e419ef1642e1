# SPDX-License-Identifier: GPL-3.0-or-later
"""Files without a mission, named by their content so that a person learns which file was chosen by mistake."""

import re

from protocols.mission_file.error import MissionFileError

_OWN_FILE = "give the mission's own file"
_SAVE_AS = "save the mission as QGC WPL 110 (.waypoints) or as a QGroundControl plan (.plan)"
_RESTORE = f"{_OWN_FILE}; `naze-bridge settings restore` takes settings"
#: By the first bytes. A telemetry log has the time in eight bytes before each frame.
_BINARY = (
    (re.compile(rb"\0[\0-\xff]{7}[\xfd\xfe]"), "a telemetry log (.tlog)"),
    (re.compile(rb"\xa3\x95"), "an ArduPilot log (.bin)"),
    (re.compile(rb"ULog"), "a PX4 log (.ulg)"),
    (re.compile(rb"\x7fELF"), "a firmware image"),
    (re.compile(rb"\x89PNG|\xff\xd8\xff|GIF8"), "a picture"),
    (re.compile(rb"\x1f\x8b|7z\xbc\xaf|Rar!"), "a compressed archive"),
    (re.compile(rb"%PDF"), "a PDF document"),
    (re.compile(rb"[^\0]{0,4095}\0"), "a binary file"),
)
#: As much of a line as tells its kind: some of the patterns take quadratic time.
_LONGEST = 200
#: By the first line that is not a comment.
_TEXTS = (
    (re.compile(r"RALLY\b.*"), "rally points", _OWN_FILE),
    (re.compile(r"-?\d+\.?\d*\s+-?\d+\.?\d*"), "a fence", _OWN_FILE),
    (re.compile(r"H Product:.*"), "a blackbox log", _SAVE_AS),
    (re.compile(r"\$G[A-Z]{4},.*"), "a log of a GPS receiver", _SAVE_AS),
    (re.compile(r":[0-9A-F]{10,}", re.IGNORECASE), "a firmware image", _SAVE_AS),
    (re.compile(r"(set|feature|aux|serial|defaults|batch|profile)\s.*", re.IGNORECASE), "settings", _RESTORE),
    (re.compile(r"[A-Za-z]\w*[,\s]+[-+.\d]+|\d+\t\d+\t\w+\t\S+\t\d+"), "settings", _RESTORE),
)


def refuse_binary(data: bytes, name: str) -> None:
    """MissionFileError if the file is not text."""
    what = next((what for start, what in _BINARY if start.match(data)), None)
    if what is not None:
        raise MissionFileError(name, "", f"this is {what}", _SAVE_AS)


def refuse_text(text: str, name: str) -> None:
    """MissionFileError if a text without the header of a mission is of a kind that we know."""
    lines = (line.strip() for line in text.splitlines())
    first = next((line for line in lines if line and not line.startswith("#")), "")[:_LONGEST]
    for start, what, remedy in _TEXTS:
        if start.fullmatch(first):
            raise MissionFileError(name, "", f"this file holds {what}", remedy)
