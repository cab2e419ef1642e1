# SPDX-License-Identifier: GPL-3.0-or-later
"""Other programs' own MSP code on a share; their sources are not in this repository (CONTRIBUTING.md).

INAV_FC: the --fc of an INAV to use instead of the simulated one, for example its SITL. Its mission is overwritten.
"""

import os
import socket
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.support.benches import Starter
from tests.support.mission_planner import MissionPlanner
from tests.support.programs import free_port


class SharedInav(NamedTuple):
    """A connected Mission Planner, and HOST:PORT of the share."""

    planner: MissionPlanner
    share: str


def sources(name: str) -> Path:
    path = os.environ.get(name)
    if not path:
        pytest.skip(f"NOT RUN: needs the program's sources: {name}=path/to/its/repository")
    return Path(path)


@pytest.fixture
def shared_inav(tmp_path: Path) -> Iterator[SharedInav]:
    with ExitStack() as stack:
        start = Starter(tmp_path, stack)
        fc = os.environ.get("INAV_FC") or start.board("--kind", "inav", tcp=True).fc
        share = f"127.0.0.1:{free_port(socket.SOCK_STREAM)}"
        daemon = start.daemon(fc, config=f'[[share]]\naddress = "tcpin:{share}"\nwrite = true\n')
        daemon.wait()
        planner = stack.enter_context(MissionPlanner(daemon.address))
        planner.connect()
        yield SharedInav(planner, share)
