# SPDX-License-Identifier: GPL-3.0-or-later
"""The check of the flight controller: asks a running daemon, else listens on the port."""

from collections.abc import Callable

from bridge.fc.states.base import Closed
from bridge.fc.states.cli import Cli
from payloads.mission_data import Json
from service.cli.doctor.checked import Checked, note, ok, problem
from service.cli.doctor.fixes import set_fc
from service.cli.doctor.port import fc_remedy
from service.daemon.client import ControlError
from service.settings.addresses import FcAddress, SerialFc

_WIRING = "is it powered? TX goes to RX, RX to TX, GND to GND; a Naze's USB socket is empty; MSP is on at this UART"

_AGAIN = "after that, run `sudo naze-bridge doctor` again"


def check_flight_controller(
    fc: FcAddress, running: Json | None, ask_port: Callable[[], Json] | None, source: str = ""
) -> list[Checked]:
    """Find the flight controller.

    `running`: a daemon's status; `ask_port` returns one or raises ControlError. `source`: where `fc` is set.
    """
    if running is not None:
        return [ok("daemon", "running"), _who(fc, running, source)]
    if ask_port is None:
        remedy = "fix its port first, then run `sudo naze-bridge doctor`"
        return [note("flight controller", f"{fc} was not checked", remedy)]
    try:
        return [_who(fc, ask_port(), source)]
    except ControlError as error:
        return [problem("flight controller", str(error), _AGAIN if str(error) == Cli.trouble else _WIRING)]


def _who(fc: FcAddress, status: Json, source: str) -> Checked:
    name = status["flight_controller"]
    if status["state"] == Closed.name:
        return note("flight controller", f"{fc} cannot be opened yet", "see the port, and the daemon's log")
    if status["state"] == Cli.name:
        return problem("flight controller", Cli.trouble, _AGAIN)
    if name is None:
        return _silent(fc, status, source)
    speed = "" if status["speed_baud"] is None else f" at {status['speed_baud']} baud"
    armed = {True: ", ARMED", False: ", disarmed", None: ""}[status["armed"]]
    return ok("flight controller", f"{name}, {status['state']}{speed}{armed}")


def _silent(fc: FcAddress, status: Json, source: str) -> Checked:
    """The likely cause, by what arrives on the line."""
    heard = status.get("fc_bytes_received") or 0
    if not heard:
        found = f"no reply on {fc}: {status['state']}, and not one byte was received"
        return problem("flight controller", found, _WIRING)
    found = f"no reply on {fc}, but {heard} bytes were received that are no frames"
    if isinstance(fc, SerialFc) and fc.baud is not None:
        remedy = f"{fc.baud} baud is probably wrong; let the bridge find the speed: {fc_remedy(fc.path, source)}"
        return problem("flight controller", found, remedy, set_fc(fc.path, source))
    remedy = "is MSP on at this UART, and nothing else (GPS, receiver)? Is TX on RX only, with GND at both ends?"
    return problem("flight controller", found, remedy)
