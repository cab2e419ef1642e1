# SPDX-License-Identifier: GPL-3.0-or-later

import os
import subprocess
import sys

import pytest

from service.links.fc_device import PortError, open_serial

_OPEN = "import serial, sys; held = serial.Serial(sys.argv[1], exclusive=True); print(flush=True); input()"


def test_the_message_names_the_program() -> None:
    near, far = os.openpty()
    name = os.ttyname(far)
    with subprocess.Popen([sys.executable, "-c", _OPEN, name], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as other:
        assert other.stdout is not None
        other.stdout.readline()
        holder, remedy = rf"python\S* \(pid {other.pid}\)", f"name another port, or stop it: sudo kill {other.pid}"
        with pytest.raises(PortError, match=f"{name} is busy: {holder} has it open; {remedy}"):
            open_serial(name)
        other.kill()
    os.close(near)
    os.close(far)
