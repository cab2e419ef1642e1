# SPDX-License-Identifier: GPL-3.0-or-later
"""INAV's own SITL, which is not in this repository: INAV_SITL is the path of its program.

Before 8.0 a craft's sensors stand still there: fc_core.c needs 8.0's `ARMING_FLAG(SIMULATOR_MODE_HITL) ||` before
`lockMainPID()`.
"""

import os
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.inav_sitl import Sitl
from tests.support.programs import free_port


@pytest.fixture
def sitl(tmp_path: Path) -> Iterator[Sitl]:
    binary = os.environ.get("INAV_SITL")
    if not binary:
        pytest.skip("NOT RUN: needs INAV's SITL: INAV_SITL=path/to/inav_9.1.0_SITL")
    board = Sitl(Path(binary), tmp_path, free_port(socket.SOCK_STREAM))
    yield board
    board.close()
