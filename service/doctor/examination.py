# SPDX-License-Identifier: GPL-3.0-or-later
"""The list of checks, in the order in which a pilot mends things."""

import time
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path

from service.doctor.checked import Checked, Grade
from service.doctor.flight_controller import check_flight_controller
from service.doctor.host import Host
from service.doctor.machine import check_clock, check_database, check_disk, check_versions
from service.doctor.network import check_ports, check_wifi
from service.doctor.port import (
    check_console,
    check_holder,
    check_modem_manager,
    check_permission,
    check_port,
    holder_of_port,
)
from service.doctor.zenoh import check_zenoh
from service.mission_data import Json
from service.settings import Settings


def examine(
    host: Host, settings: Settings, ask_running: Callable[[], Json], ask_port: Callable[[], Json]
) -> Iterator[Checked]:
    """Yield what each check finds. The port is listened to only if nothing stands in the way of that."""
    fc = settings.fc
    on_port = [check(host, fc) for check in (check_port, check_permission, check_console, check_holder)]
    told = [*(found for found in on_port if found is not None), check_modem_manager(host, fc)]
    yield check_versions(host)
    yield from told
    is_free = not any(found.grade is Grade.PROBLEM for found in told) and holder_of_port(host, fc) is None
    yield from check_flight_controller(fc, ask_running, ask_port if is_free else None)
    yield from check_wifi(host, settings.gcs)
    yield from check_ports(host, settings.gcs)
    yield check_zenoh(settings.zenoh)
    yield check_clock(host, datetime.fromtimestamp(time.time(), UTC))
    state_dir = settings.state_dir or Path()
    yield check_disk(state_dir)
    yield from check_database(state_dir)
