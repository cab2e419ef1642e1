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
        with pytest.raises(
            PortError,
            match=rf"{name} is busy: python\S* \(pid {other.pid}\) has it open; name another port, or stop it: sudo kill {other.pid}",
        ):
            open_serial(name)
        other.kill()
    os.close(near)
    os.close(far)
