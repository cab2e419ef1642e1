# SPDX-License-Identifier: GPL-3.0-or-later
"""All settings of INAV's own SITL reach a ground station soon after a restart, from what the daemon remembers."""

import time
from contextlib import ExitStack
from pathlib import Path

from pymavlink import mavutil

from tests.support.benches import Starter
from tests.support.inav_sitl import Sitl

#: The SITL of INAV 9.1 has more settings.
_LEAST = 600
#: QGroundControl repeats its request after 5 s if no parameter came.
_AGAIN_S = 5.0


def parameters(address: tuple[str, int], within_s: float) -> int:
    """The number of parameters once all have arrived, or after this time."""
    link = mavutil.mavlink_connection(f"udpout:{address[0]}:{address[1]}", source_system=255, source_component=190)
    began, asked_at, counts = time.monotonic(), 0.0, dict[int, int]()
    while (now := time.monotonic()) < began + within_s:
        if not counts and now > asked_at + _AGAIN_S:
            link.mav.heartbeat_send(6, 8, 192, 0, 4)
            link.mav.param_request_list_send(1, 1)
            asked_at = now
        value = link.recv_match(type="PARAM_VALUE", blocking=True, timeout=0.05)
        if value is not None:
            counts[value.param_index] = value.param_count
            if list(counts.values()).count(value.param_count) == value.param_count > _LEAST:
                break
    link.close()
    return len(counts)


def test_all_settings_arrive_within_20_s_of_a_restart(sitl: Sitl, tmp_path: Path) -> None:
    with ExitStack() as stack:
        daemon = Starter(tmp_path, stack).daemon(sitl.line())
        daemon.wait()
        count = parameters(daemon.address, 120)
        assert count > _LEAST
        daemon.kill_and_restart()
        assert parameters(daemon.address, 20) == count
