# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge setup`."""

import re
import socket
import time
from contextlib import suppress
from difflib import unified_diff
from pathlib import Path

import click

from protocols.remedies import Fault
from service.cli.doctor.command import diagnose
from service.cli.setup.answers import (
    GCS_PORT,
    KEY_FILE,
    PAGE_PORT,
    SetupChoices,
    current_key,
    earlier_choices,
    shadowed,
)
from service.cli.setup.change import Machine, Run, SetupError, Step, WriteFile, is_root
from service.cli.setup.hotspot import ADDRESS, JOIN_S, hotspot_name
from service.cli.setup.steps import missing_steps
from service.daemon.client import STATUS, ControlError, ask_daemon
from service.machine.host import Host
from service.machine.raspberry_pi import pi_model
from service.settings.addresses import AddressError, parse_fc
from service.settings.load import SERVICE_STATE
from service.settings.passphrase import new_passphrase, weakness
from service.web.token import DEFAULT_NAME
from storage.os_error import reason
from storage.small_files import read_bounded
from terminal.command_group import PATH
from terminal.sentences import complain, fail, print_code, say, show_secret

_MOST_SSID = 32
#: A passphrase by IEEE 802.11.
_PASSWORD = re.compile("[ -~]{8,63}")
#: The search spends 9 s on a port: three are tried by then.
_SEARCH_S = 30
#: The service may have been taken over: a token must not act on root's terminal.
_TOKEN = re.compile("[!-~]{1,256}")
_HOST_NAME = re.compile("[A-Za-z0-9](?:[A-Za-z0-9-]{0,61}[A-Za-z0-9])?")


@click.command()
@click.option("--fc", metavar="FC", help="The flight controller, as for `run`. Default: the last answer, else auto.")
@click.option("--hotspot", metavar="SSID", help="Open a Wi-Fi network of this name. Default: keep the current one.")
@click.option("--password-file", type=PATH, help="File with the hotspot's password.")
@click.option("--keep-hotspot", is_flag=True, help="Keep the hotspot even if no device joins it within 3 minutes.")
@click.option("--country", metavar="CC", help="Wi-Fi country, such as DE: the radio stays off without one.")
@click.option("--name", metavar="HOST", help="Name of this machine on the network: HOST.local.")
@click.option("--page/--no-page", default=None, help="Serve the status page, or not.")
@click.option("--key-file", type=PATH, help="File with a MAVLink signing passphrase: required for changes.")
@click.option("--new-key", is_flag=True, help="Make such a passphrase and show it; it replaces the present one.")
@click.option("--yes", is_flag=True, help="Do not ask questions: use the options, the last answers and the defaults.")
@click.option("--dry-run", is_flag=True, help="Show the changes without making them.")
@click.option("--root", type=PATH, default="/", hidden=True)
def setup(
    fc: str | None,
    hotspot: str | None,
    password_file: Path | None,
    keep_hotspot: bool,
    country: str | None,
    name: str | None,
    page: bool | None,
    key_file: Path | None,
    new_key: bool,
    yes: bool,
    dry_run: bool,
    root: Path,
) -> None:
    """Set this Raspberry Pi up: UART, settings, Wi-Fi, status page, service.

    May be run again at any time: earlier answers are kept unless an option changes them. Exit code 1: a change failed,
    or doctor found a problem.
    """
    if not (yes or dry_run or is_root()):
        fail(Fault.NOT_ROOT.text())  # before the questions
    host = Host(root)
    try:
        fc = None if fc is None else str(parse_fc(fc))
    except AddressError as error:
        raise click.UsageError(str(error)) from error
    click.echo(f"This is a {model.name}." if (model := pi_model(host)) else "This is not a known Raspberry Pi model.")
    password = None if password_file is None else secret_line(password_file)
    key = None if key_file is None else secret_line(key_file)
    check_answers(hotspot, password, country, name)  # before the questions
    if hotspot is not None and host.path("/run/systemd/system").exists() and not host.wifi_cards():
        raise click.UsageError(Fault.NO_HOTSPOT_CARD.text())
    if key is not None and new_key:
        raise click.UsageError(Fault.TWO_KEYS.text())
    earlier = earlier_choices(host)
    if earlier is not None:
        _print_kept(host, earlier.fc, page=earlier.page)
        fc, page = earlier.fc if fc is None else fc, earlier.page if page is None else page
    elif not yes and not dry_run:
        if hotspot is None and click.confirm("Open a Wi-Fi hotspot, for the field? (no: keep the current network)"):
            hotspot = click.prompt("Its name", default=socket.gethostname())
            country = country or click.prompt("Your country, two letters")
        if page is None:
            page = click.confirm("Serve the status page to browsers on the network?", default=True)
        if key is None and not new_key and not current_key(host):
            new_key = click.confirm("Require a key to change missions or settings, and make one?")
    if hotspot is not None and password is None:
        if yes or dry_run:
            raise click.UsageError(Fault.NO_PASSWORD.text())
        password = click.prompt("Its password, 8 characters or more", hide_input=True, confirmation_prompt=True)
    check_answers(hotspot, password, country, name)
    answers = SetupChoices(
        fc=None if fc == "auto" else fc,
        page=page is not False,
        hotspot=None if hotspot is None or password is None else (hotspot, password),
        country=None if country is None else country.upper(),
        name=name,
        key=new_passphrase() if new_key else key,
        keeps_hotspot=keep_hotspot,
    )
    used = answers.key or current_key(host)
    if used and (weak := weakness(used)) is not None:
        complain("warning: " + Fault.WEAK_KEY.text(why=f"the key {weak}"))
    for sentence in shadowed(host, answers):
        complain(f"warning: {sentence}")
    steps = missing_steps(host, answers)
    _show(host, steps)
    if dry_run:
        return
    machine = Machine(host)
    if steps:
        if not is_root():
            fail(Fault.NOT_ROOT.text())
        if not yes and not click.confirm("Make these changes?", default=True):
            raise click.Abort
        _carry_out([step for step in steps if not step.cuts_network], machine)
    _print_addresses(host, answers)
    if new_key:
        click.echo("\nIn Mission Planner enter the key under Setup, Advanced, MAVLink Signing, Add.")
        show_secret("The key, for ground stations that may make changes", str(answers.key), KEY_FILE, str(answers.key))
    is_well = True
    if any(step.needs_reboot for step in steps):
        click.echo("\nReboot once for the UART: sudo reboot. After that: sudo naze-bridge doctor")
    elif host.path("/run/systemd/system").exists():
        if steps:
            _await_flight_controller()
        is_well = diagnose()
    _switch_network([step for step in steps if step.cuts_network], machine, hotspot, ask=not yes, is_kept=keep_hotspot)
    if not is_well:
        raise SystemExit(1)


def _switch_network(steps: list[Step], machine: Machine, hotspot: str | None, *, ask: bool, is_kept: bool) -> None:
    """Open the hotspot last: it may end the connection over which setup is run."""
    if any(isinstance(change, Run) for step in steps for change in step.changes):
        click.echo(f"\nNow the Wi-Fi changes to the hotspot {hotspot!r}: a connection over the present network ends.")
        if not is_kept:
            click.echo(f"Join it within {JOIN_S // 60} minutes, or the Pi returns to the present network.")
        if ask:
            click.prompt("Press Enter when you have noted the above", default="", show_default=False)
    _carry_out(steps, machine)


def _print_kept(host: Host, fc: str | None, *, page: bool) -> None:
    hotspot = hotspot_name(host)
    kept = [
        f"flight controller {fc or 'auto'}",
        f"status page {'on' if page else 'off'}",
        "a key is required for changes" if current_key(host) else "no key: anyone on the network can make changes",
        *([f"hotspot {hotspot!r}"] if hotspot else []),
    ]
    click.echo(f"Already set up: {', '.join(kept)}. To change this, use options: naze-bridge setup --help")


def _show(host: Host, steps: list[Step]) -> None:
    if not steps:
        click.echo("Everything is set up already.")
        return
    click.echo("\nTo do:")
    for number, step in enumerate(steps, 1):
        click.echo(f"{number}. {step.purpose}{' (needs a reboot)' if step.needs_reboot else ''}")
        for change in step.changes:
            click.echo(f"     {change.describe()}")
            if isinstance(change, WriteFile) and not change.secret:
                before, after = host.read(change.path).splitlines(), change.text.splitlines()
                for line in list(unified_diff(before, after, lineterm="", n=0))[2:]:
                    if not line.startswith("@@"):
                        say(line, prefix="       ", indent=7)


def _carry_out(steps: list[Step], machine: Machine) -> None:
    for step in steps:
        click.echo(f"{step.purpose} ... ", nl=False)
        try:
            for change in step.changes:
                machine.carry_out(change)
        except SetupError as error:
            click.echo("failed")
            fail(Fault.FAILED_CHANGE.text(why=error))
        click.echo("done")


def _await_flight_controller() -> None:
    """Give the service that was just started time to find it, so that doctor's verdict is right."""
    click.echo(f"\nLooking for the flight controller, up to {_SEARCH_S} s ...")
    for _ in range(_SEARCH_S):
        with suppress(ControlError):
            if ask_daemon(None, STATUS)["flight_controller"] is not None:
                return
        time.sleep(1)


def _print_addresses(host: Host, answers: SetupChoices) -> None:
    addresses = [ADDRESS] if answers.hotspot else host.ipv4_addresses()
    name = answers.name or host.read("/etc/hostname").strip()
    local = [f"{name}.local"] if name and host.path("/etc/avahi").exists() else []
    where = " or ".join([*local, *addresses]) or "this machine's address"
    click.echo(f"\nMission Planner: choose UDPCl, Connect, host {where}, port {GCS_PORT}")
    if answers.page:
        _print_page(host, (addresses or local or ["localhost"])[0])


def _print_page(host: Host, address: str) -> None:
    url = f"http://{address}:{PAGE_PORT}/"
    click.echo(f"Status page: {url}")
    if secret := page_token(host):
        show_secret("Its token, for changes", secret, f"{SERVICE_STATE}/{DEFAULT_NAME}", f"{url}#token={secret}")
    else:
        print_code(url)


def page_token(host: Host) -> str:
    """The status page's token, or empty if there is none that can be shown."""
    path = host.path(f"{SERVICE_STATE}/{DEFAULT_NAME}")
    try:
        token = read_bounded(path, 1 << 10, follows_links=False).decode().strip()
    except (OSError, ValueError):
        return ""
    return token if _TOKEN.fullmatch(token) else ""


@click.command()
@click.option("--root", type=PATH, default="/", hidden=True)
def token(root: Path) -> None:
    """Show the status page's token, and a QR code that opens the page with it."""
    host = Host(root)
    if not is_root():
        fail(Fault.TOKEN_NOT_ROOT.text())
    if not page_token(host):
        fail(Fault.NO_TOKEN.text())
    _print_page(host, next(iter(host.ipv4_addresses()), "localhost"))


def check_answers(ssid: str | None, password: str | None, country: str | None, name: str | None) -> None:
    """Refuse answers that cannot be used, each with one sentence (click.UsageError)."""
    if ssid is not None and not (ssid.isprintable() and 0 < len(ssid.encode()) <= _MOST_SSID):
        raise click.UsageError(Fault.NOT_AN_SSID.text(text=repr(ssid), most=_MOST_SSID))
    if password is not None and not _PASSWORD.fullmatch(password):
        raise click.UsageError(Fault.NOT_A_PASSWORD.text())
    if country is not None and not re.fullmatch("[A-Za-z]{2}", country):
        raise click.UsageError(Fault.NOT_A_COUNTRY.text(text=repr(country)))
    if name is not None and not _HOST_NAME.fullmatch(name):
        raise click.UsageError(Fault.NOT_A_HOST_NAME.text(text=repr(name)))


def secret_line(path: Path) -> str:
    """The only line of a file; click.UsageError if it holds anything else."""
    try:
        lines = read_bounded(path, 1 << 10).decode().removesuffix("\n").removesuffix("\r").split("\n")
    except OSError as error:
        raise click.UsageError(Fault.UNREADABLE_FILE.text(why=f"{path} cannot be read: {reason(error)}")) from error
    except UnicodeDecodeError:
        raise click.UsageError(Fault.SECRET_LINES.text(path=path)) from None  # the error would quote the secret
    if len(lines) != 1 or not lines[0].isprintable() or lines[0].strip() != lines[0] or not lines[0]:
        raise click.UsageError(Fault.SECRET_LINES.text(path=path))
    return lines[0]
