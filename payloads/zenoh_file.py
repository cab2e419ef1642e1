# SPDX-License-Identifier: GPL-3.0-or-later
"""A zenoh configuration file. The files that it names are in its folder, so that the folder can be copied anywhere."""

import json
from pathlib import Path

import zenoh

_TLS = "transport/link/tls"
#: Settings that name a file.
_FILES = (
    f"{_TLS}/root_ca_certificate",
    f"{_TLS}/listen_certificate",
    f"{_TLS}/listen_private_key",
    f"{_TLS}/connect_certificate",
    f"{_TLS}/connect_private_key",
    "transport/auth/usrpwd/dictionary_file",
)


def read_zenoh_file(path: Path) -> zenoh.Config:
    """Read a configuration; zenoh.ZError if it is not one. zenoh itself would look in the working directory."""
    config = zenoh.Config.from_file(path)
    for setting in _FILES:
        name = json.loads(config.get_json(setting))
        if name:
            config.insert_json5(setting, json.dumps(str(path.absolute().parent / name)))
    return config
