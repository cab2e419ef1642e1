# SPDX-License-Identifier: GPL-3.0-or-later
"""The virtual files of MAVLink FTP: all parameters in one, and their descriptions for ground stations.

Descriptions: https://mavlink.io/en/services/component_information.html, format of `parameter.schema.json`.
"""

import json
import lzma
from collections.abc import Mapping
from typing import Any

from bridge.model.settings import BoardSetting, ValueKind
from protocols.mavlink.ftp import file_crc32
from protocols.mavlink.param_pack import encode_param_pack

_PACK, _GENERAL, _PARAMETERS = "@PARAM/param.pck", "general.json", "parameter.json.xz"
GENERAL_URI = f"mftp:///{_GENERAL}"
_PARAMETER_TYPE = 1


class ParameterFiles:
    """Made when a station asks for them, and kept as long as the parameters are the same.

    Until the settings are known there are no files, and stations request the parameters one by one.
    """

    def __init__(self) -> None:
        self._values: Mapping[str, float] = {}
        self._pack = b""
        self._described: bytes | None = None
        self._settings: Mapping[str, BoardSetting] = {}

    def show(self, values: Mapping[str, float], settings: Mapping[str, BoardSetting]) -> None:
        """Serve these from now on: all parameters, and the flight controller's settings among them."""
        if settings is not self._settings:
            self._settings, self._described = settings, None
        if values != self._values:
            self._values, self._pack = values, encode_param_pack(values)

    def find(self, path: str) -> bytes | None:
        """The content of a file, or None if there is none of this path."""
        files = {
            _PACK: lambda: self._pack,
            _GENERAL: self.general,
            _PARAMETERS: self._descriptions,
        }
        make = files.get(path.partition("?")[0].lstrip("/"))
        return make() if make is not None and self._settings else None

    def general(self) -> bytes:
        """The file that names the others."""
        described = {
            "type": _PARAMETER_TYPE,
            "uri": f"mftp:///{_PARAMETERS}",
            "fileCrc": file_crc32(self._descriptions()),
        }
        return json.dumps({"version": 1, "metadataTypes": [described]}).encode()

    def _descriptions(self) -> bytes:
        if self._described is None:
            described = [_description(name, setting) for name, setting in self._settings.items()]
            # Quick: the usual preset takes over a second on a Pi Zero for files hardly smaller.
            text = json.dumps({"version": 1, "parameters": described})
            self._described = lzma.compress(text.encode(), preset=0)
        return self._described


def _description(parameter: str, setting: BoardSetting) -> dict[str, Any]:
    is_whole = setting.kind is ValueKind.INTEGER
    group, _, rest = setting.name.partition("_")
    described: dict[str, Any] = {
        "name": parameter,
        "type": "Float",
        "shortDesc": setting.name,
        "longDesc": f"{setting.name}: {setting.fixed}" if setting.fixed else setting.name,
        "min": setting.minimum,
        "max": setting.maximum,
        "decimalPlaces": 0 if is_whole else 3,
        "group": group if rest else "general",
        "category": "Flight controller",
    }
    if is_whole:
        described["increment"] = 1
    if setting.unit:
        described["units"] = setting.unit
    if setting.choices:
        first = int(setting.minimum)
        described["values"] = [
            {"value": value, "description": choice} for value, choice in enumerate(setting.choices, first)
        ]
    return described
