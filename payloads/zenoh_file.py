# SPDX-License-Identifier: GPL-3.0-or-later
"""A zenoh configuration file. The files that it names are in its folder, so that the folder can be copied anywhere."""

import json
from pathlib import Path

import zenoh

from storage.small_files import read_bounded

_TLS = "transport/link/tls"
_MAX_BYTES = 1 << 20
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
    """Read a configuration; zenoh.ZError if it is not one, OSError if it or a file that it names cannot be read.

    zenoh itself would look in the working directory, and would read a device or wait for a pipe without end.
    """
    read_bounded(path, _MAX_BYTES)
    config = zenoh.Config.from_file(path)
    for setting in _FILES:
        name = json.loads(config.get_json(setting))
        if name:
            file = path.absolute().parent / name
            if file.exists():
                read_bounded(file, _MAX_BYTES)
            config.insert_json5(setting, json.dumps(str(file)))
    return config
