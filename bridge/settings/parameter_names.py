# SPDX-License-Identifier: GPL-3.0-or-later
"""Names of MAVLink parameters, at most 16 characters, for the settings of a flight controller.

A name depends on the setting's name alone, so it is the same on every board and in every version, and files of
parameters stay valid. docs/ground-stations.md has the rule.
"""

from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from zlib import crc32

LONGEST = 16
#: Harakiri's own MAVLink cuts these names after the 16th character, so that several are equal.
_NAMES = {
    "LED_ControlChannel": "LED_CtrlChannel",
    "LED_Toggle_Delay1": "LED_Tog_Delay1",
    "LED_Toggle_Delay2": "LED_Tog_Delay2",
    "LED_Toggle_Delay3": "LED_Tog_Delay3",
    "gps_ph_settlespeed": "gps_ph_setlspeed",
    "gps_ph_brakemaxangle": "gps_ph_brkmaxang",
    "gps_ph_minbrakepercent": "gps_ph_minbrkpct",
    "nav_controls_heading": "nav_ctrl_heading",
    "pitch_direction_l": "pitch_dir_l",
    "pitch_direction_r": "pitch_dir_r",
    "power_adc_channel": "power_adc_chan",
    "roll_direction_l": "roll_dir_l",
    "roll_direction_r": "roll_dir_r",
    "vbatmaxcellvoltage": "vbatmaxcellvolt",
    "vbatmincellvoltage": "vbatmincellvolt",
}
_HASH_SIZE = 3
_VOWELS = frozenset("aeiou")


def parameter_names(settings: Iterable[str], taken: Collection[str] = ()) -> Mapping[str, str]:
    """Setting by parameter; the parameters are distinct and in upper case, and none of them is `taken`."""
    short = {name: _short(name).upper() for name in settings}
    often = Counter([*short.values(), *taken])
    return {_hashed(name).upper() if often[parameter] > 1 else parameter: name for name, parameter in short.items()}


def _short(name: str) -> str:
    """Drop the vowels inside words, last word first, until the name is short enough."""
    if len(name) <= LONGEST:
        return name
    if name in _NAMES:
        return _NAMES[name]
    words = name.split("_")
    for at in range(len(words) - 1, -1, -1):
        words[at] = words[at][:1] + "".join(letter for letter in words[at][1:] if letter not in _VOWELS)
        if len("_".join(words)) <= LONGEST:
            return "_".join(words)
    return _hashed(name)


def _hashed(name: str) -> str:
    """The beginning, and three digits of a checksum of the whole name."""
    return f"{name[: LONGEST - _HASH_SIZE - 1]}~{crc32(name.encode()) & 0xFFF:03x}"
