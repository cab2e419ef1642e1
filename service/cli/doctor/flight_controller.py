# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks of the flight controller: the reply to a daemon or to doctor itself, and the troubles in a daemon's status."""

import re
from collections.abc import Callable, Iterator
from dataclasses import replace

from bridge.controllers.harakiri.profile import UNPATCHED
from bridge.fc.states.base import Closed
from bridge.fc.states.mute import Cli
from bridge.vehicle.incoming import OWN_IDS
from payloads.mission_data import Json
from protocols.mavlink.signing import Check
from service.cli.doctor.checked import Checked, Grade, note, ok, problem
from service.cli.doctor.fixes import RESTART_BRIDGE
from service.cli.doctor.port import fc_fix, fc_remedy
from service.daemon.client import ControlError
from service.machine.package import page
from service.settings.addresses import FcAddress, SerialFc, TcpFc, UdpFc

_WIRING = "is it powered? TX goes to RX, RX to TX, GND to GND; a Naze's USB socket is empty; MSP is on at this UART"

_AGAIN = "after that, run `sudo naze-bridge doctor` again"
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
    better = f"printf '\\n[all]\\ndtoverlay=disable-bt\\n' | sudo tee -a {mini_uart_config} && sudo reboot"
    return [
        replace(
            each,
            found=f"{each.found}; the port is the mini-UART",
            remedy=f"{each.remedy} If all that is right, give the header Bluetooth's UART: {better}",
        )
        if mini_uart_config and each.check == "flight controller" and each.grade is Grade.PROBLEM
        else each
        for each in _check(fc, running, ask_port, source)
    ]


def _check(fc: FcAddress, running: Json | None, ask_port: Callable[[], Json] | None, source: str = "") -> list[Checked]:
    if running is not None:
        return [ok("daemon", "running"), _who(fc, running, source), *check_running(running)]
    if ask_port is None:
        remedy = "fix its port first, then run `sudo naze-bridge doctor`"
        return [note("flight controller", f"{fc} was not checked", remedy)]
    try:
        status = ask_port()
    except ControlError as error:
        return [problem("flight controller", str(error), _AGAIN if str(error) == Cli.trouble.text else _wiring(fc))]
    return [_who(fc, status, source), *check_running(status)]


def _who(fc: FcAddress, status: Json, source: str) -> Checked:
    name = status["flight_controller"]
    if status["state"] == Closed.name:
        return note("flight controller", f"{fc} cannot be opened yet", "see the port, and the daemon's log")
    if status["state"] == Cli.name:
        return problem("flight controller", Cli.trouble.text, _AGAIN)
    if name is None:
        return _silent(fc, status, source)
    speed = "" if status["speed_baud"] is None else f" at {status['speed_baud']} baud"
    armed = {True: ", ARMED", False: ", disarmed", None: ""}[status["armed"]]
    return ok("flight controller", f"{name}, {status['state']}{speed}{armed}")


def _wiring(fc: FcAddress) -> str:
    if isinstance(fc, TcpFc | UdpFc):
        host = "" if isinstance(fc, UdpFc) and fc.listens else f" (ping {fc.host}: below 300 ms)"
        return f"is it on, in this network{host}, is this its port for MSP, and no other program connected to it?"
    return _WIRING


def _silent(fc: FcAddress, status: Json, source: str) -> Checked:
    """The likely cause, by what arrives on the line."""
    heard = status.get("fc_bytes_received") or 0
    if not heard:
        found = f"no reply on {fc}: {status['state']}, and not one byte was received"
        return problem("flight controller", found, _wiring(fc))
    found = f"no reply on {fc}, but {heard} bytes were received that are no frames"
    if isinstance(fc, SerialFc) and fc.baud is not None:
        remedy = f"{fc.baud} baud is probably wrong; let the bridge find the speed: {fc_remedy(fc.path, source)}"
        return problem("flight controller", found, remedy, fc_fix(source))
    remedy = "is MSP on at this UART, and nothing else (GPS, receiver)? Is TX on RX only, with GND at both ends?"
    return problem("flight controller", found, remedy)


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
        yield problem("store", found, remedy, RESTART_BRIDGE)


def _line(status: Json) -> Iterator[Checked]:
    damaged, found_s = status.get("bad_checksums") or 0, status.get("found_s")
    if found_s is None or damaged < _LEAST_DAMAGED or damaged * 60 < _MOST_DAMAGED * found_s:
        return
    remedy = "shorten the wires, keep them away from motors and regulators, connect GND at both ends, check 3.3 V"
    yield problem("line", f"{damaged} damaged replies in {found_s / 60:.0f} min", remedy)


def _refused(status: Json) -> Iterator[Checked]:
    for text in status.get("refused") or ():
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
        elif why == OWN_IDS or why.startswith("addressed to component"):
            remedy = "in that program: its own sysid such as 255, and the vehicle's ids, by default 1 and 1, as target"
            yield note("ids", f"{count} messages on {link} were ignored: {why}", remedy)
        elif why in (Check.LATE.value, Check.EARLY.value):
            remedy = "set the clocks of the ground station and of the Pi; then: naze-bridge signing reset"
            yield note("key", f"{count} requests on {link} were refused: {why}", remedy)
