# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks of what a running daemon reports about itself: its line, its stations and its store."""

import re
from collections.abc import Iterator

from bridge.controllers.harakiri.profile import UNPATCHED
from payloads.mission_data import Json
from protocols.mavlink.signing import Check
from service.cli.doctor.checked import Checked, note, problem
from service.cli.doctor.fixes import restart_service, stop_programs
from service.machine.host import Host, Process
from service.machine.package import page

#: Damaged replies a minute. A good wire has none for hours.
_MOST_DAMAGED = 6
_LEAST_DAMAGED = 10
_UNIT = "/naze-bridge.service"
_REFUSED = re.compile(r"(\d+) x (.*) \((.*)\)")


def check_running(status: Json) -> Iterator[Checked]:
    """Yield a finding for each trouble in the daemon's status. It may be of doctor's own bridge."""
    if status["flight_controller"] == UNPATCHED.name:
        remedy = f"telemetry works; for missions flash the patch: {page('docs/howto/flash-the-patch.md')}"
        yield note("missions", "this Harakiri has no mission extension, so it stores none", remedy)
    yield from _line(status)
    yield from _refused(status)
    if status.get("store_trouble"):
        remedy = "see disk and missions below; then: sudo systemctl restart naze-bridge"
        found = f"the daemon cannot store missions: {status['store_trouble']}"
        yield problem("store", found, remedy, restart_service)


def _line(status: Json) -> Iterator[Checked]:
    damaged, found_s = status.get("bad_checksums") or 0, status.get("found_s")
    if found_s is None or damaged < _LEAST_DAMAGED or damaged * 60 < _MOST_DAMAGED * found_s:
        return
    remedy = "shorten the wires, keep them away from motors and regulators, connect GND at both ends, check 3.3 V"
    yield problem("line", f"{damaged} damaged replies in {found_s / 60:.0f} min", remedy)


def _refused(status: Json) -> Iterator[Checked]:
    for text in status.get("refused", ()):
        found = _REFUSED.fullmatch(text)
        if found is None:
            continue
        count, why, link = found.groups()
        if why in (Check.UNSIGNED.value, Check.WRONG.value):
            remedy = (
                f"enter the key in the ground station ({page('docs/signing.md')}); "
                "sudo naze-bridge setup --new-key makes a new one and shows it"
            )
            yield note("key", f"{count} requests on {link} were refused: {why}", remedy)


def check_daemons(host: Host) -> Checked | None:
    """Check that no two daemons have the same port open: they take each other's replies from it."""
    daemons = [each for each in host.processes() if each.is_naze_bridge and "run" in each.arguments]
    by_port: dict[str, list[Process]] = {}
    for daemon in daemons:
        for port in host.ports_of(daemon):
            by_port.setdefault(port, []).append(daemon)
    port, rivals = next(((port, found) for port, found in by_port.items() if len(found) > 1), ("", []))
    if not rivals:
        return None
    rivals.sort(key=lambda each: _UNIT not in host.read(f"/proc/{each.pid}/cgroup"))  # the service first: it stays
    pids = [str(each.pid) for each in rivals]
    remedy = f"stop all but one: sudo kill {' '.join(pids[1:])}"
    found = f"{len(pids)} daemons have {port} open (pids {', '.join(pids)})"
    return problem("daemon", found, remedy, stop_programs(*(each.pid for each in rivals[1:])))
