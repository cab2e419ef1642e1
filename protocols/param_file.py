# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of settings, as Mission Planner (.param), MAVProxy (.parm) and QGroundControl (.params) write them.

One setting a line: `NAME,VALUE`, or with white space between them; QGroundControl has system, component, NAME, VALUE
and type, separated by tabs (ParameterManager.cc). A # begins a comment. Two comments are our own, and ground stations
drop them when they write the file again: `# board: ...` names the flight controller that the settings are from, and
`# text: NAME,VALUE` is a setting that is a text.
"""

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from protocols.float32 import is_single
from protocols.plain_text import FileError, PlainText, file_text, plain_text, shown
from protocols.remedies import Fault

_NAME = re.compile(r"[!$-+\--~]{1,64}")
# float() also accepts underscores and digits of any script.
_NUMBER = re.compile(r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:e[-+]?\d+)?", re.ASCII | re.IGNORECASE)
BOARD, _TEXT = "# board: ", "# text: "
_QGC_FIELDS = 5
_MISSION = "QGC WPL"
#: Of XML, JSON and archives.
_STRANGERS = ("<", "{", "[", "PK")
#: Digits that show any single-precision number exactly.
_MOST_DIGITS = 9
_MOST_WHOLE = 2**32
#: The largest board has 981, an INAV with all the mode ranges. A daemon compares them on its event loop.
MOST_SETTINGS = 1500


class ParamFileError(FileError):
    """A file of settings cannot be read or written."""


@dataclass(frozen=True, slots=True)
class ParamFile:
    """The values by name, in the file's order. board: the flight controller they are from; "" if the file lacks it."""

    values: Mapping[str, float | str]
    board: str = ""


def read_param_file(data: bytes, name: str) -> ParamFile:
    """Read a file of settings. ParamFileError names the file `name` and the line."""
    text = file_text(data)
    values: dict[str, float | str] = {}
    seen_at: dict[str, int] = {}
    board = ""
    for number, line in enumerate(text.split("\n"), start=1):
        if line.startswith(BOARD):
            board = plain_text(line.removeprefix(BOARD)).strip()
        if line.startswith(_TEXT):
            fields = line.removeprefix(_TEXT).rstrip("\r").split(",", 1)
        else:
            fields = line.partition("#")[0].replace(",", " ").split()
        if not fields:
            continue
        setting, value = _setting(fields, line, name, f"line {number}")
        if (first := seen_at.setdefault(setting, number)) != number and values[setting] != value:
            former, present = shown_value(values[setting]), shown_value(value)
            fault = Fault.TWO_VALUES(name=setting, first=former, line=first, second=present)
            raise ParamFileError(name, f"line {number}", *fault)
        values[setting] = value
        if len(values) > MOST_SETTINGS:
            raise ParamFileError(name, f"line {number}", *Fault.MANY_SETTINGS(most=MOST_SETTINGS))
    if not values:
        raise ParamFileError(name, "", *Fault.NO_SETTINGS())
    return ParamFile(values, board)


def write_param_file(values: Mapping[str, float | str], board: str = "", comments: Iterable[str] = ()) -> str:
    """The text of a Mission Planner .param file. `read_param_file` reads equal values, see is_equal.

    NaN, as a board with damaged settings may have, is left out.
    """
    heading = [BOARD + board] if board else []
    heading += [f"# {comment}" for comment in comments]
    lines = (
        f"{_TEXT if isinstance(value, str) else ''}{name},{shown_value(value)}"
        for name, value in values.items()
        if isinstance(value, str) or math.isfinite(value)
    )
    return "".join(f"{line}\n" for line in (*heading, *lines))


def is_setting_name(name: str) -> bool:
    """True if a file can hold a setting of this name. No firmware has another."""
    return _NAME.fullmatch(name) is not None and _NUMBER.fullmatch(name) is None


def setting_name(name: bytes) -> PlainText:
    """A board's name of a setting, or empty if it is impossible."""
    text = plain_text(name)
    return text if is_setting_name(text) and text.encode() == name else PlainText("")


def shown_value(value: float | str) -> str:
    """The shortest text of the value. Of a fraction, the shortest that is equal in single precision."""
    if isinstance(value, str):
        return plain_text(value)
    if _is_whole(value):
        return f"{value:.0f}"
    texts = (f"{value:.{digits}g}" for digits in range(1, _MOST_DIGITS))
    return next((text for text in texts if is_single(value, float(text))), f"{value:.{_MOST_DIGITS}g}")


def is_equal(value: float | str, other: float | str) -> bool:
    """True if both are the same number in single precision, which ground stations keep; whole numbers: exactly."""
    if isinstance(value, str) or isinstance(other, str) or value == other:
        return value == other
    return not (_is_whole(value) and _is_whole(other)) and is_single(value, other)


def _is_whole(value: float) -> bool:
    return abs(value) <= _MOST_WHOLE and value == int(value)


def _setting(fields: list[str], line: str, name: str, where: str) -> tuple[str, float | str]:
    if len(fields) == _QGC_FIELDS and all(field.isdecimal() for field in (*fields[:2], fields[4])):
        fields = fields[2:4]
    if len(fields) != 2 and (line.startswith((_MISSION, *_STRANGERS)) or "\0" in line):
        fault = Fault.MISSION_FOR_SETTINGS if line.startswith(_MISSION) else Fault.NO_SETTINGS
        raise ParamFileError(name, where, *fault())
    if len(fields) != 2:
        raise ParamFileError(name, where, *Fault.NOT_A_SETTING(line=shown(line)))
    setting, number = fields
    if not is_setting_name(setting):
        raise ParamFileError(name, where, *Fault.NOT_A_NAME(name=shown(setting)))
    if line.startswith(_TEXT):
        return setting, plain_text(number)
    value = float(number) if _NUMBER.fullmatch(number) else math.nan
    if not math.isfinite(value):
        raise ParamFileError(name, where, *Fault.NOT_A_VALUE(name=setting, value=shown(number)))
    return setting, value
