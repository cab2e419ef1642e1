# SPDX-License-Identifier: GPL-3.0-or-later
"""Names of MAVLink parameters, at most 16 characters, for the settings of a flight controller.

A name depends on the setting's name alone, so it is the same on every board and in every version, and files of
parameters stay valid. docs/ground-stations.md has the rule.
"""

from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from functools import lru_cache
from zlib import crc32

LONGEST = 16
_ABBREVIATIONS = {
    "altitude": "alt", "angle": "ang", "attenuation": "att", "autotune": "atun", "battery": "bat", "braking": "brk",
    "channel": "ch", "control": "ctl", "current": "cur", "deadband": "db", "direction": "dir", "display": "disp",
    "distance": "dist", "dynamic": "dyn", "dynamics": "dyn", "failsafe": "fs", "filter": "flt", "indicator": "ind",
    "interval": "intv", "inverted": "inv", "landing": "land", "launch": "lch", "manual": "man", "mission": "msn",
    "motor": "mot", "offset": "ofs", "position": "pos", "procedure": "proc", "servo": "srv", "smoothing": "smth",
    "speed": "spd", "switch": "sw", "threshold": "thr", "throttle": "thl", "voltage": "volt", "warning": "wrn",
}  # fmt: skip
_VOWELS = frozenset("aeiou")


def parameter_names(settings: Iterable[str], taken: Collection[str] = ()) -> Mapping[str, str]:
    """Setting by parameter. The parameters are distinct and in upper case, and none of them is `taken`.

    >>> parameter_names(["p_roll", "gps_ph_settlespeed"])
    {'P_ROLL': 'p_roll', 'GPS_PH_STTLSPD': 'gps_ph_settlespeed'}
    """
    short = {name: _short(name).upper() for name in settings}
    often = Counter([*short.values(), *taken])
    # Of names that would coincide: the beginning, and three digits of a checksum of the whole name.
    distinct = {name: f"{name[: LONGEST - 4]}~{crc32(name.encode()) & 0xFFF:03x}".upper() for name in short}
    return {distinct[name] if often[parameter] > 1 else parameter: name for name, parameter in short.items()}


@lru_cache(2048)  # for each reading of a board's several hundred settings
def _short(name: str) -> str:
    """Abbreviate words, drop the vowels inside words, last word first, and cut the longest words, until it is short."""
    if len(name) <= LONGEST:
        return name
    words = [_ABBREVIATIONS.get(word, word) for word in name.split("_")]
    for at in range(len(words) - 1, -1, -1):
        if len("_".join(words)) > LONGEST:
            words[at] = words[at][:1] + "".join(letter for letter in words[at][1:] if letter not in _VOWELS)
    while len("_".join(words)) > LONGEST:
        longest = max(range(len(words)), key=lambda at: (len(words[at]), at))
        if len(words[longest]) <= 2:
            return "".join(words)[:LONGEST]
        words[longest] = words[longest][:-1]
    return "_".join(words)
