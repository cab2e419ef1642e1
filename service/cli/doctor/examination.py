# SPDX-License-Identifier: GPL-3.0-or-later
"""The checks, in the order to fix their problems."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

from payloads.mission_data import Json
from service.cli.doctor.checked import Checked, Grade
from service.cli.doctor.flight_controller import check_flight_controller
from service.cli.doctor.machine import check_clock, check_database, check_disk, check_power, check_root, check_versions
from service.cli.doctor.network import check_keys, check_ports, check_wifi, check_zenoh
from service.cli.doctor.port import (
    check_candidates,
    check_console,
    check_holder,
    check_no_port,
    check_permission,
    check_port,
    holder_of_port,
)
from service.daemon.client import ControlError
from service.machine.host import Host
from service.machine.raspberry_pi import boot_file, is_mini_uart
from service.settings import Settings
from service.settings.addresses import AddressError, AutoFc, FcAddress, SerialFc, parse_fc

#: The facts of a daemon's status that the checks use.
_STATUS: Mapping[str, type] = {
    **dict.fromkeys(("flight_controller", "state", "where", "store_trouble", "clock_trouble"), str),
    **dict.fromkeys(("speed_baud", "found_s", "bad_checksums", "fc_bytes_received"), float),
    "armed": bool,
    **dict.fromkeys(("refused", "links"), list),
    "port": dict,
}
_FAR_TOO_LARGE = 1 << 53
_ON_PORT = (check_permission, check_console)


def examine(
    host: Host, settings: Settings, ask_running: Callable[[], Json], ask_port: Callable[[], Json]
) -> Iterator[Checked]:
    """Yield the result of each check. The last listens to the port only if the others passed."""
    running = _status(ask_running)
    fc = settings.fc
    if isinstance(fc, AutoFc) and running is not None and running["port"] is None and running["where"] is not None:
        with suppress(AddressError):
            fc = parse_fc(running["where"])  # the daemon was started with --fc
    ports: Sequence[FcAddress] = check_candidates(host) if isinstance(fc, AutoFc) else [fc]
    source = settings.sources.get("fc", "")
    checks: Sequence[Callable[[Host, FcAddress], Checked | None]] = (
        *(partial(check_port, source=source), *_ON_PORT),
        partial(check_holder, source=source),
    )
    results = [found for port in ports for check in checks if (found := check(host, port)) is not None]
    if len(ports) > 1:
        # One port with a flight controller is enough.
        results = [replace(found, grade=Grade.NOTE) if found.grade is Grade.PROBLEM else found for found in results]
    results += [] if ports else [check_no_port()]
    yield check_versions(host)
    yield from filter(None, [check_power()])
    yield from results
    is_free = not any(found.grade is Grade.PROBLEM for found in results)
    is_free = is_free and all(holder_of_port(host, port) is None for port in ports)
    is_mini = any(isinstance(port, SerialFc) and is_mini_uart(host, port.path) for port in ports)
    config = (boot_file(host, "config.txt") or "") if is_mini else ""
    yield from check_flight_controller(fc, running, ask_port if is_free else None, source, config)
    links = [str(link) for link in settings.gcs]
    yield from check_wifi(host, settings.gcs)
    yield from check_ports(host, settings, is_running=running is not None and running["links"] in (None, links))
    yield from check_keys(settings.gcs, settings.access)
    yield check_zenoh(settings.zenoh)
    yield check_clock(host, datetime.fromtimestamp(time.time(), UTC), (running or {}).get("clock_trouble") or "")
    state_dir = settings.state_dir or Path()
    yield from filter(None, [check_root(host)])
    yield check_disk(state_dir)
    yield from check_database(state_dir)


def _status(ask_running: Callable[[], Json]) -> Json | None:
    """The daemon's status, without values of another type: root asks, and the daemon may have been taken over."""
    try:
        status = ask_running()
    except ControlError:
        return None
    return {name: status.get(name) if _fits(status.get(name), kind) else None for name, kind in _STATUS.items()}


def _fits(value: object, kind: type) -> bool:
    if kind is list:
        return isinstance(value, list) and all(isinstance(each, str) for each in value)
    is_number = isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < _FAR_TOO_LARGE
    return is_number if kind is float else isinstance(value, kind)
