# SPDX-License-Identifier: GPL-3.0-or-later

import json
import lzma

from pymavlink.mavftp import MAVFTP

from bridge.model.settings import BoardSetting, ValueKind
from bridge.settings.parameter_files import ParameterFiles
from protocols.mavlink.ftp import file_crc32

SETTINGS = {
    "p_roll": BoardSetting("p_roll", ValueKind.INTEGER, 1, 200, 35),
    "failsafe_prcdr": BoardSetting("failsafe_procedure", ValueKind.INTEGER, 0, 1, 0, choices=("LAND", "DROP")),
    "nav_speed_max": BoardSetting("nav_speed_max", ValueKind.FLOAT, 0, 10, 2.5, "m/s"),
}
VALUES = {"SYSID_THISMAV": 1.0, "p_roll": 35.0, "failsafe_prcdr": 0.0, "nav_speed_max": 2.5}


def files() -> ParameterFiles:
    found = ParameterFiles()
    found.show(VALUES, SETTINGS)
    return found


def test_all_parameters_are_one_file_with_or_without_options() -> None:
    for path in ("@PARAM/param.pck", "@PARAM/param.pck?withdefaults=1", "/@PARAM/param.pck"):
        packed = files().find(path)
        assert packed is not None
        found = MAVFTP.ftp_param_decode(packed)
        assert {name.decode(): value for name, value, _ in found.params} == VALUES


def test_the_general_file_names_the_descriptions_and_their_checksum() -> None:
    found = files()
    general = json.loads(found.find("/general.json") or b"")
    (described,) = general["metadataTypes"]
    content = found.find(described["uri"].removeprefix("mftp://"))
    assert content is not None
    assert (general["version"], described["type"], described["fileCrc"]) == (1, 1, file_crc32(content))


def test_a_description_has_the_range_and_the_unit() -> None:
    described = json.loads(lzma.decompress(files().find("parameter.json.xz") or b""))
    assert described["version"] == 1
    p_roll, failsafe, speed = described["parameters"]
    assert (p_roll["name"], p_roll["min"], p_roll["max"], p_roll["shortDesc"]) == ("p_roll", 1, 200, "p_roll")
    assert (p_roll["decimalPlaces"], p_roll["increment"], p_roll["type"]) == (0, 1, "Float")
    assert failsafe["longDesc"] == "failsafe_procedure"
    assert failsafe["values"] == [{"value": 0, "description": "LAND"}, {"value": 1, "description": "DROP"}]
    assert (speed["units"], speed["group"]) == ("m/s", "nav")


def test_until_the_settings_are_known_there_are_no_files() -> None:
    found = ParameterFiles()
    found.show({"SYSID_THISMAV": 1.0}, {})
    assert [found.find(path) for path in ("@PARAM/param.pck", "general.json", "parameter.json.xz", "")] == [None] * 4
