# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks of the flight controller: the reply to a daemon or to doctor itself, and the troubles in a daemon's status."""

import re
from collections.abc import Callable, Iterator

from bridge.controllers.harakiri.profile import UNPATCHED
from bridge.fc.states.base import Closed
from bridge.fc.states.msp import Cli
from bridge.vehicle.incoming import OWN_IDS
from payloads.mission_data import Json
from protocols.mavlink.signing import Check
from protocols.remedies import Fault
from service.cli.doctor.checked import Checked, Grade, note, ok, problem
from service.cli.doctor.fixes import RESTART_BRIDGE
from service.cli.doctor.port import fc_fix, fc_remedy
from service.daemon.client import ControlError
from service.machine.package import page
from service.settings.addresses import FcAddress, SerialFc, TcpFc, UdpFc

#: Damaged replies a minute. A good wire has none for hours.
_MOST_DAMAGED = 6
_LEAST_DAMAGED = 10
_REFUSED = re.compile(r"(\d+) x (.*) \((.*)\)")


def check_flight_controller(
    fc: FcAddress,
    running: Json | None,
    ask_port: Callable[[], Json] | None,
    source: str = "",
    mini_uart_config: str = "",
) -> list[Checked]:
    """Find the flight controller, and the troubles that its line and its stations have.

    `running`: a daemon's status. `ask_port` returns one or raises ControlError. `source`: where `fc` is set.
    `mini_uart_config`: the path of config.txt if the port is the mini-UART.
    """
    return [
        problem(each.check, *Fault.MINI_UART(found=each.found, remedy=each.remedy, config=mini_uart_config), each.fix)
        if mini_uart_config and each.check == "flight controller" and each.grade is Grade.PROBLEM
        else each
        for each in _check(fc, running, ask_port, source)
    ]


def _check(fc: FcAddress, running: Json | None, ask_port: Callable[[], Json] | None, source: str = "") -> list[Checked]:
    if running is not None:
        return [ok("daemon", "running"), _who(fc, running, source), *check_running(running)]
    if ask_port is None:
        return [note("flight controller", *Fault.NOT_CHECKED(fc=fc))]
    try:
        status = ask_port()
    except ControlError as error:
        return [_in_cli() if str(error) == Cli.trouble.text else _unheard(fc, str(error))]
    return [_who(fc, status, source), *check_running(status)]


def _who(fc: FcAddress, status: Json, source: str) -> Checked:
    name = status["flight_controller"]
    if status["state"] == Closed.name:
        return note("flight controller", *Fault.PORT_NOT_OPEN(fc=fc))
    if status["state"] == Cli.name:
        return _in_cli()
    if name is None:
        return _silent(fc, status, source)
    speed = "" if status["speed_baud"] is None else f" at {status['speed_baud']} baud"
    armed = {True: ", ARMED", False: ", disarmed", None: ""}[status["armed"]]
    return ok("flight controller", f"{name}, {status['state']}{speed}{armed}")


def _in_cli() -> Checked:
    return problem("flight controller", *Fault.BOARD_IN_CLI(why=Cli.trouble.text))


def _unheard(fc: FcAddress, why: str) -> Checked:
    if not isinstance(fc, TcpFc | UdpFc):
        return problem("flight controller", *Fault.SILENT_LINE(why=why))
    ping = "" if isinstance(fc, UdpFc) and fc.listens else f" (ping {fc.host}: below 300 ms)"
    return problem("flight controller", *Fault.SILENT_NETWORK(why=why, ping=ping))


def _silent(fc: FcAddress, status: Json, source: str) -> Checked:
    """The likely cause, by what arrives on the line."""
    heard = status.get("fc_bytes_received") or 0
    if not heard:
        return _unheard(fc, f"no reply on {fc}: {status['state']}, and no bytes were received")
    if isinstance(fc, SerialFc) and fc.baud is not None:
        found = Fault.WRONG_SPEED(fc=fc, heard=heard, baud=fc.baud, set_fc=fc_remedy(fc.path, source))
        return problem("flight controller", *found, fc_fix(source))
    return problem("flight controller", *Fault.NO_FRAMES(fc=fc, heard=heard))


def check_running(status: Json) -> Iterator[Checked]:
    """Yield a finding for each trouble in the daemon's status. It may be of doctor's own bridge."""
    if status["flight_controller"] == UNPATCHED.name:
        yield note("missions", *Fault.UNPATCHED_BOARD(page=page("docs/howto/flash-the-patch.md")))
    yield from _line(status)
    yield from _refused(status)
    if status.get("store_trouble"):
        yield problem("store", *Fault.STORE_FAILS(why=status["store_trouble"]), RESTART_BRIDGE)


def _line(status: Json) -> Iterator[Checked]:
    damaged, found_s = status.get("bad_checksums") or 0, status.get("found_s")
    if found_s is None or damaged < _LEAST_DAMAGED or damaged * 60 < _MOST_DAMAGED * found_s:
        return
    yield problem("line", *Fault.BAD_LINE(damaged=damaged, minutes=found_s / 60))


def _refused(status: Json) -> Iterator[Checked]:
    for text in status.get("refused") or ():
        found = _REFUSED.fullmatch(text)
        if found is None:
            continue
        count, why, link = found.groups()
        known = {"count": count, "why": why, "link": link, "page": page("docs/signing.md")}
        if why in (Check.UNSIGNED.value, Check.WRONG.value):
            yield note("key", *Fault.UNSIGNED_STATION(**known))
        elif why == OWN_IDS or why.startswith("addressed to component"):
            yield note("ids", *Fault.WRONG_IDS(**known))
        elif why in (Check.LATE.value, Check.EARLY.value):
            yield note("key", *Fault.LATE_STATION(**known))
