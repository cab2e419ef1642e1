# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge card`: prepares a freshly written Raspberry Pi OS card, so that the first start needs no terminal.

It adds a folder to the boot partition and one line to what Raspberry Pi Imager left there for the first start: the
script firstrun.sh (bookworm), or cloud-init's user-data (trixie). That line enables a unit, which installs the package,
runs `naze-bridge setup`, removes the folder with its secrets, and restarts the Pi.
"""

import re
import shlex
import shutil
from pathlib import Path

import click
from segno.helpers import make_wifi_data

from service.cli.setup.answers import PAGE_PORT
from service.cli.setup.command import check_answers, secret_line
from service.cli.setup.hotspot import ADDRESS
from service.settings.passphrase import STRONGER, new_passphrase, weakness
from service.web.token import new_token
from storage.os_error import reason
from storage.small_files import open_regular, read_bounded
from terminal.options import PATH
from terminal.secret_text import show_secret
from terminal.sentences import complain, fail

FOLDER = "naze-bridge"
#: deb(5): an ar archive whose first member is debian-binary.
_MAX_BYTES = 1 << 20
_DEB = b"!<arch>\ndebian-binary"
_LOG = "/var/log/naze-bridge-card.log"
_UNIT = "/etc/systemd/system/naze-bridge-card.service"
#: The boot partition's place: from bookworm on, and before.
_FIND = "for boot in /boot/firmware /boot; do [ ! -e $boot/naze-bridge/{0} ] || exec sh $boot/naze-bridge/{0}; done"
#: In firstrun.sh, where no network runs; the Imager's cmdline.txt restarts the Pi after it.
_IN_FIRSTRUN = f"({_FIND.format('enable.sh')})"
#: In user-data, once the system is up.
_IN_USER_DATA = "[sh, /boot/firmware/naze-bridge/enable.sh, start]"
_ENABLE = f"""\
#!/bin/sh
# Written by `naze-bridge card`: enables the unit that sets the bridge up, and repeats it after a start that failed.
cat >{_UNIT} <<'UNIT'
[Unit]
Description=Set naze-bridge up from the boot partition, once
After=NetworkManager.service
[Service]
Type=oneshot
TimeoutStartSec=20min
ExecStart=/bin/sh -c '{_FIND.format("first-boot.sh").replace("$", "$$")}'
UNIT
mkdir -p /etc/systemd/system/multi-user.target.wants
ln -sf {_UNIT} /etc/systemd/system/multi-user.target.wants/
[ "${{1-}}" != start ] || {{ systemctl daemon-reload; systemctl start --no-block naze-bridge-card; }}
"""
_FIRST_BOOT = """\
#!/bin/sh
# Written by `naze-bridge card`. Its log is {log}.
set -eu
here=$(dirname "$(realpath "$0")")
umask 077
exec >>{log} 2>&1
umask 022
dpkg --install "$here"/naze-bridge.deb
state=/var/lib/private/naze-bridge
mkdir -p -m 700 /var/lib/private
install -d -o naze-bridge -m 700 $state
[ -e $state/web-token ] || install -o naze-bridge -m 600 "$here/web-token" $state/web-token
# Status 1 is also doctor's, for a flight controller that is not connected yet.
naze-bridge setup --yes {options} || [ -e /etc/naze-bridge/setup.toml ]
# A separate process opens the hotspot.
while systemctl is-active --quiet naze-bridge-hotspot.timer || systemctl is-active --quiet naze-bridge-hotspot; do
    sleep 1
done
rm -rf "$here"
rm -f {unit} /etc/systemd/system/multi-user.target.wants/naze-bridge-card.service
if [ -d /run/systemd/system ]; then systemctl reboot --no-block; fi
"""


class CardError(Exception):
    """A card that cannot be prepared; one sentence."""


@click.command()
@click.argument("boot", type=PATH)
@click.option("--package", type=PATH, required=True, help="The naze-bridge package for the Pi (.deb).")
@click.option("--hotspot", metavar="SSID", required=True, help="Name of the Pi's Wi-Fi network.")
@click.option("--password-file", type=PATH, required=True, help="File with the hotspot's password.")
@click.option("--country", metavar="CC", required=True, help="Wi-Fi country, such as DE.")
@click.option("--name", metavar="HOST", help="Name of the Pi on the network: HOST.local.")
@click.option("--new-key", is_flag=True, help="Make a MAVLink signing passphrase, required for changes, and show it.")
@click.option("--key-file", type=PATH, help="File with such a passphrase.")
def card(
    boot: Path,
    package: Path,
    hotspot: str,
    password_file: Path,
    country: str,
    name: str | None,
    new_key: bool,
    key_file: Path | None,
) -> None:
    """Prepare a card that Raspberry Pi Imager has just written; BOOT is its boot partition.

    The first start installs the package, sets the bridge up and opens the hotspot, without a network or a terminal.
    """
    if new_key and key_file is not None:
        raise click.UsageError("give either --key-file or --new-key")
    password = secret_line(password_file)
    check_answers(hotspot, password, country, name)
    key = new_passphrase() if new_key else None if key_file is None else secret_line(key_file)
    if key and (weak := weakness(key)) is not None:
        complain(f"warning: the key {weak}; {STRONGER}")
    token = new_token()
    named = ["--hotspot", hotspot, "--country", country.upper(), *(["--name", name] if name else [])]
    secrets = {"password": password, "web-token": token, **({"key": key} if key else {})}
    try:
        prepare(boot, package, named, secrets)
    except CardError as error:
        fail(error)
    except OSError as error:
        fail(f"{error.filename or boot} cannot be changed: {reason(error)}")
    click.echo(f"The card is ready. Put it into the Pi and wait 5 minutes, then join {hotspot!r}.")
    kept_in = boot / FOLDER
    show_secret("Its password", password, f"{kept_in}/password", make_wifi_data(hotspot, password, "WPA"))
    url = f"http://{ADDRESS}:{PAGE_PORT}/"
    click.echo(f"Status page: {url}")
    show_secret("Its token, for changes", token, f"{kept_in}/web-token", f"{url}#token={token}")
    if key:
        show_secret("The key, for ground stations that may make changes", key, f"{kept_in}/key", key)


def prepare(boot: Path, package: Path, options: list[str], secrets: dict[str, str]) -> None:
    """Add the folder and the hook. `options`: of setup; `secrets`: by file name. It may be repeated.

    CardError: this is no freshly written card; nothing was changed.
    """
    if not (boot / "cmdline.txt").exists() or not (boot / "config.txt").exists():
        raise CardError(
            f"{boot} is not the boot partition of a Raspberry Pi OS card: it has no cmdline.txt or config.txt"
        )
    if package.suffix != ".deb" or not package.is_file() or not _is_package(package):
        raise CardError(f"{package} is not a package: build one with `make deb`, or take one from the releases")
    hook, text = _hooked(boot)
    folder = boot / FOLDER
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    shutil.copyfile(package, folder / "naze-bridge.deb")
    for file, secret in secrets.items():
        (folder / file).write_text(f"{secret}\n")
    words = (
        shlex.join(options)
        + ' --password-file "$here/password"'
        + (' --key-file "$here/key"' if "key" in secrets else "")
    )
    _write(folder / "first-boot.sh", _FIRST_BOOT.format(log=_LOG, unit=_UNIT, options=words))
    _write(folder / "enable.sh", _ENABLE)
    _write(hook, text)  # last: a card that was pulled out before it starts as if untouched


def _is_package(path: Path) -> bool:
    with open_regular(path) as file:
        return file.read(len(_DEB)) == _DEB


def _text(path: Path) -> str:
    return read_bounded(path, _MAX_BYTES).decode().replace("\r\n", "\n")


def _write(path: Path, text: str) -> None:
    path.write_bytes(text.encode())  # without carriage returns, even on Windows


def _hooked(boot: Path) -> tuple[Path, str]:
    """The file for the first start, and its text with our line."""
    user_data, firstrun = boot / "user-data", boot / "firstrun.sh"
    if user_data.exists():
        text = _text(user_data)
        if not text.startswith("#cloud-config"):
            raise CardError(f"{user_data} is not cloud-init's: write the card again")
        return user_data, text if _IN_USER_DATA in text else _with_command(user_data, text)
    if not firstrun.exists() or "systemd.run=" not in _text(boot / "cmdline.txt"):
        raise CardError(
            f"{boot} has neither user-data nor firstrun.sh: write the card with Raspberry Pi Imager, and give it a "
            "user name and a password there (Edit settings)"
        )
    text = _text(firstrun)
    first, _, rest = text.partition("\n")
    return firstrun, text if _IN_FIRSTRUN in text else f"{first}\n{_IN_FIRSTRUN}\n{rest}"


def _with_command(file: Path, text: str) -> str:
    """The user-data with our command first in `runcmd`, in the indentation of the others."""
    found = re.search(r"^runcmd:[ \t]*(\S.*)?\n(?:[ \t]*(?:#.*)?\n)*([ \t]*)(?=- )?", text, re.MULTILINE)
    if found is None:
        return f"{text.rstrip()}\n\nruncmd:\n  - {_IN_USER_DATA}\n"
    if found[1] and not found[1].startswith("#"):
        raise CardError(f"{file}: write runcmd as a list of lines that begin with -, not in brackets")
    line = text.index("\n", found.start()) + 1
    return f"{text[:line]}{found[2]}- {_IN_USER_DATA}\n{text[line:]}"
