# SPDX-License-Identifier: GPL-3.0-or-later
"""The manual page, naze-bridge(1), from the --help texts: `python -m generators.man_page`."""

import sys

from generators.cli_page import helps
from service.cli.main import main
from service.machine.package import version

_HEAD = """\
.TH NAZE-BRIDGE 1 "" "naze-bridge {version}" "User Commands"
.SH NAME
naze-bridge \\- bridge between a flight controller on a serial port and MAVLink ground stations
.SH DESCRIPTION
Sits on a Raspberry Pi between a Naze32 with Harakiri (or INAV, MultiWii) and Mission Planner, QGroundControl or
MAVProxy. Missions are checked, written to the flight controller and verified there.
First steps: sudo naze-bridge setup.
"""
_TAIL = """\
.SH FILES
.TP
/etc/naze-bridge/config.toml
Settings, each with its default.
.TP
/var/lib/naze-bridge
Stored missions and telemetry logs.
.SH SEE ALSO
/usr/share/doc/naze-bridge
"""


def man_page(version: str) -> str:
    """The page in roff."""
    sections = "".join(f".SH {_escaped(name.upper())}\n.nf\n{_escaped(text)}\n.fi\n" for name, text in helps(main))
    return _HEAD.format(version=version) + sections + _TAIL


def _escaped(text: str) -> str:
    lines = text.replace("\\", "\\e").replace("-", "\\-").splitlines()
    return "\n".join(f"\\&{line}" if line.startswith((".", "'")) else line for line in lines)


if __name__ == "__main__":
    sys.stdout.write(man_page(version()))
