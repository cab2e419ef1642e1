# SPDX-License-Identifier: GPL-3.0-or-later
"""The actions of the helper. Each recomputes what it changes from this machine. A request can only choose."""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

from payloads.mission_data import Json
from service.cli.doctor.command import examined
from service.cli.doctor.fixes import fix_step
from service.cli.helper.action import Action, HelperRefusal, ThisPi
from service.cli.helper.packages import PREVIOUS, can_update, receive, start_update, update_outcome, version_of
from service.cli.helper.page_settings import change_settings, page_settings
from service.cli.setup.answers import SetupChoices, current_key, earlier_choices, shadowed
from service.cli.setup.change import Machine
from service.cli.setup.command import check_answers
from service.cli.setup.hotspot import hotspot_is_open, hotspot_name
from service.cli.setup.steps import missing_steps
from service.daemon.client import STATUS, ask_daemon
from service.links.serial_ports import serial_ports
from service.machine.helper_socket import MAX_PACKAGE
from service.machine.host import Host
from service.machine.package import version
from service.machine.raspberry_pi import pi_model, wifi_country
from service.settings.load import SERVICE_CONFIG, SERVICE_STATE
from service.settings.passphrase import new_passphrase

_AUTO = "auto"


def overview(pi: ThisPi) -> Json:
    """The answers to setup so far, and the settings. Does not change anything."""
    host = pi.host
    earlier = earlier_choices(host)
    model = pi_model(host)
    return {
        "is_set_up": earlier is not None,
        "fc": (earlier or SetupChoices()).fc,
        "ports": _ports(host),
        "has_key": bool(current_key(host)),
        "hotspot": hotspot_name(host),
        "hotspot_is_open": hotspot_is_open(host),
        "country": wifi_country(host),
        "name": host.read("/etc/hostname").strip(),
        "model": None if model is None else model.name,
        "version": version(),
        "can_update": can_update(host),
        "previous": version_of(host.path(PREVIOUS), Machine(host)),
        "update": update_outcome(host),
        "settings": page_settings(host),
    }


def doctor(pi: ThisPi) -> Json:
    """Doctor's checks. Does not change anything. `fix` names a remedy for the action of that name."""
    host = pi.host
    ask = partial(ask_daemon, None, STATUS)
    # The port is the daemon's, which asks.
    results = examined(host.path(SERVICE_CONFIG), None, host.path(SERVICE_STATE), ask, host, ask_port=ask)
    return {"checks": [each.to_json() | {"fix": each.fix if fix_step(each.fix, host) else None} for each in results]}


def apply_fix(pi: ThisPi, *, fix: str) -> Json:
    """One of the remedies in service/cli/doctor/fixes.py, by name."""
    step = fix_step(fix, pi.host)
    if step is None:
        raise HelperRefusal("This needs no change any more: check again.")
    return pi.make([step])


def answer(
    pi: ThisPi,
    *,
    is_trial: bool = False,
    fc: str = "",
    hotspot: str = "",
    password: str = "",
    country: str = "",
    name: str = "",
    new_key: bool = False,
) -> Json:
    """The answers to setup's questions. Those not given stay. `is_trial`: only show the changes."""
    if bool(hotspot) != bool(password):
        raise HelperRefusal("A hotspot needs a name and a password.")
    check_answers(hotspot or None, password or None, country or None, name or None)
    if fc and fc not in _ports(pi.host):
        raise HelperRefusal("This Pi has no such port for a flight controller: reload the page.")
    earlier = earlier_choices(pi.host) or SetupChoices()
    answers = replace(
        earlier,
        fc=earlier.fc if not fc else None if fc == _AUTO else fc,
        hotspot=(hotspot, password) if hotspot else None,
        country=country.upper() or None,
        name=name or None,
        key=new_passphrase() if new_key else None,
    )
    steps = missing_steps(pi.host, answers)
    warnings = list(shadowed(pi.host, answers))
    made = pi.shown(steps) if is_trial else pi.make(steps)
    return made | {"warnings": warnings, "key": None if is_trial else answers.key}


def install(pi: ThisPi, *, size: int) -> Json:
    """The body is a package of this program: check it, and install it in a separate process."""
    if not 0 < size <= MAX_PACKAGE:
        raise HelperRefusal(f"A package can have at most {MAX_PACKAGE >> 20} MB.")
    return {"version": receive(pi, size)}


def downgrade(pi: ThisPi) -> Json:
    """Go back to the package before the last update."""
    if (known := version_of(pi.host.path(PREVIOUS), Machine(pi.host))) is None:
        raise HelperRefusal("No earlier version is kept: this release was not installed from the page.")
    start_update(pi, PREVIOUS)
    return {"version": known}


def _ports(host: Host) -> list[str]:
    return [_AUTO, *(port.path for port in serial_ports(host) if host.is_tty(port.path))]


#: Everything that the helper does.
ACTIONS: Mapping[str, Action] = {
    "overview": overview,
    "doctor": doctor,
    "fix": apply_fix,
    "answer": answer,
    "settings": change_settings,
    "install": install,
    "downgrade": downgrade,
}
