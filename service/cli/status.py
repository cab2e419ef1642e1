# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge status`: the bridge and the vehicle, for people; `--json` for scripts."""

from collections.abc import Iterator, Sequence

import click

from payloads.mission_data import Json
from service.cli.daemon_client import BridgeClient, bridge_options
from service.daemon.client import STATUS
from service.machine.host import Host
from service.machine.raspberry_pi import is_mini_uart
from service.settings.addresses import client_hosts, parse_gcs
from service.settings.web import ListenAddress, parse_listen
from terminal.sentences import say

_MINUTE_S, _HOUR_S, _DAY_S = 60, 3600, 86400
_OLD_S = 5.0


@click.command()
@bridge_options
def status(client: BridgeClient) -> None:
    """Show the state of the bridge and the vehicle: connections, mode, GPS fix, battery, mission."""
    facts, host = client.ask(STATUS), Host()
    client.show(facts, lambda: _print_lines(list(status_lines(facts, host.ipv4_addresses(), host))))


def _print_lines(lines: Sequence[tuple[str, str]]) -> None:
    width = max(len(name) for name, _ in lines)
    for name, text in lines:
        say(text, prefix=f"{name:{width}}  ", indent=width + 2)


def status_lines(facts: Json, addresses: list[str], host: Host) -> Iterator[tuple[str, str]]:
    """Yield a name and a text for each line. `addresses` are this machine's own."""
    yield "Bridge", f"naze-bridge {facts['version']}, running for {duration(facts['uptime_s'])}"
    yield "Flight controller", _flight_controller(facts, host)
    if facts["flight_controller"] is not None:
        armed = {True: "ARMED", False: "disarmed", None: "arming state unknown"}[facts["armed"]]
        yield "Vehicle", ", ".join(filter(None, (armed, facts["mode"]))) + _age(facts["status_age_s"])
        yield "GPS", _gps(facts) + _age(facts["gps_age_s"])
        battery = "unknown" if facts["battery_v"] is None else f"{facts['battery_v']:.1f} V"
        yield "Battery", battery + _age(facts["battery_age_s"])
        yield "Mission", _mission(facts)
        yield "Settings", _settings(facts)
        if (wrong := facts["declination"]) is not None:
            text = "{} deg off at this place: naze-bridge settings set {} {} && naze-bridge settings save"
            yield "Compass", text.format(*wrong)
        if facts["round_trip_ms"] is not None:
            lost = f"lost requests: {facts['requests_lost']}, bad checksums: {facts['bad_checksums']}"
            yield "Serial line", f"round trip {facts['round_trip_ms']} ms, {lost}"
    yield "Ground stations", ", ".join(facts["ground_stations"]) or "none"
    for link in facts["links"]:
        yield "Connect to", _reachable(link, addresses)
    if facts["page"] is not None:
        page = parse_listen(facts["page"])
        if facts["page_trouble"]:
            yield "Page", f"{page} cannot be opened: {facts['page_trouble']}; see sudo naze-bridge doctor"
        else:
            yield "Page", f"http://{ListenAddress(client_hosts(page.host, addresses)[0], page.port)}/"
    if facts["store_trouble"]:
        yield "Missions", f"kept in memory only: {facts['store_trouble']}"
    if facts["clock_trouble"]:
        yield "Clock", facts["clock_trouble"]
    for text in facts["recording"]:
        yield "Recording", text
    for text in facts.get("ports_passed_over", ()):
        yield "Port skipped", text
    for text in facts["refused"]:
        yield "Refused", text


def duration(seconds: float) -> str:
    """A time in the two largest units: "2 h 5 min"."""
    whole = int(seconds)
    if whole < _MINUTE_S:
        return f"{whole} s"
    if whole < _HOUR_S:
        return f"{whole // _MINUTE_S} min"
    if whole < _DAY_S:
        return f"{whole // _HOUR_S} h {whole % _HOUR_S // _MINUTE_S} min"
    return f"{whole // _DAY_S} d {whole % _DAY_S // _HOUR_S} h"


def _age(seconds: float | None) -> str:
    """Said of values that are no longer polled, or not answered: the others arrive at least every 2 s."""
    return "" if seconds is None or seconds < _OLD_S else f", {duration(seconds)} ago"


def _flight_controller(facts: Json, host: Host) -> str:
    if facts["flight_controller"] is None:
        doubt = ", the mini-UART; see sudo naze-bridge doctor" if is_mini_uart(host, facts["where"]) else ""
        return facts["trouble"] or f"none yet: searching on {facts['where']}{doubt}"
    speed = "" if facts["speed_baud"] is None else f" at {facts['speed_baud']} baud"
    since = "" if facts["found_s"] is None else f", for {duration(facts['found_s'])}"
    firmware = "" if facts["firmware_version"] is None else f", firmware {facts['firmware_version']},"
    return f"{facts['flight_controller']}{firmware} on {facts['where']}, {facts['state']}{speed}{since}"


def _gps(facts: Json) -> str:
    if facts["satellites"] is None:
        return "no data"
    fix = {None: "fix unknown", "none": "no fix"}.get(facts["fix"], f"{facts['fix']} fix")
    return f"{fix}, {facts['satellites']} satellites"


def _mission(facts: Json) -> str:
    count = facts["mission_records"]
    if count is None:
        return "not read yet"
    if not count:
        return "none stored"
    stored = f"{count} records, checksum {facts['mission_checksum']}"
    return f"{stored}, {facts['mission_state']} at item {item}" if (item := facts["mission_item"]) else stored


def _settings(facts: Json) -> str:
    if facts["settings_seal"] is None:
        return "not read yet"
    change = facts["settings_changed"]
    last = "" if change is None else f"; {duration(facts['settings_changed_s'])} ago: {change}"
    return f"seal {facts['settings_seal']}{last}"


def _reachable(link: str, addresses: list[str]) -> str:
    """The address to enter in a ground station for a link that listens; other links as configured."""
    address = parse_gcs(link)
    protocol = {"udpin": "UDP", "tcpin": "TCP"}.get(address.kind)
    if protocol is None:
        return link
    return f"{protocol} {' or '.join(client_hosts(address.host, addresses))}, port {address.port}"
