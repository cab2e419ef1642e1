# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge card`: prepares a new Raspberry Pi OS card for a first start without a terminal.

It adds a folder to the boot partition and one line to what Raspberry Pi Imager left there for the first start: the
script firstrun.sh (bookworm), or cloud-init's user-data (trixie). That line enables a unit, which installs the package,
runs `naze-bridge setup`, removes the folder with the secrets, and restarts the Pi.
"""

import re
import shlex
import shutil
import tarfile
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import click
from segno.helpers import make_wifi_data

from protocols.plain_text import plain_text
from protocols.remedies import Fault
from service.cli.helper.action import HelperRefusal
from service.cli.helper.signature import SIGNERS, check_signature, has_key, is_signed
from service.cli.setup.answers import PAGE_PORT
from service.cli.setup.command import check_answers, secret_line
from service.cli.setup.hotspot import ADDRESS, CONNECTION
from service.cli.setup.steps import renamed_user_data
from service.machine.package import shipped
from service.settings.passphrase import new_passphrase, weakness
from service.web.token import new_token
from storage.os_error import reason
from storage.small_files import open_regular, read_bounded
from terminal.command_group import PATH
from terminal.sentences import complain, fail, show_secret

FOLDER = "naze-bridge"
_LOG = "/var/log/naze-bridge-card.log"
_UNIT = "/etc/systemd/system/naze-bridge-card.service"
#: A user's files for the first start may be long.
_MAX_BYTES = 1 << 20
_ARCHITECTURES = ("arm64", "armhf")
_LINK = "/etc/systemd/system/multi-user.target.wants/naze-bridge-card.service"
RESULT = "naze-bridge-RESULT.txt"
_PAGE = f"http://{ADDRESS}:{PAGE_PORT}/"
#: A package: an ar archive of tar archives (deb(5)).
_MAGIC = b"!<arch>\n"
_HEADER_SIZE, _SIZE = 60, slice(48, 58)
_MOST_CONTROL = 1 << 20
#: The boot partition's place: from bookworm on, and before.
_FIND = "for boot in /boot/firmware /boot; do [ ! -e $boot/naze-bridge/{0} ] || exec sh $boot/naze-bridge/{0}; done"
#: Once the folder is renamed, all is done. A power cut may have left a part of it.
_CLEAN_UP = f"rm -rf /boot/firmware/{FOLDER}.done /boot/{FOLDER}.done; rm -f {_UNIT} {_LINK}"
#: In firstrun.sh, where the network does not run. The Imager's cmdline.txt restarts the Pi after it.
_IN_FIRSTRUN = f"({_FIND.format('enable.sh')})"
#: In user-data, once the system is up.
_IN_USER_DATA = "[sh, /boot/firmware/naze-bridge/enable.sh, start]"
_ENABLE = f"""\
#!/bin/sh
# Written by `naze-bridge card`: enables the unit that sets the bridge up, and repeats it until it succeeds.
cat >{_UNIT} <<'UNIT'
[Unit]
Description=Set naze-bridge up from the boot partition, once
After=NetworkManager.service
StartLimitIntervalSec=0
[Service]
Type=oneshot
TimeoutStartSec=20min
Restart=on-failure
RestartSec=30
ExecStart=/bin/sh -c '{f"{_FIND.format('first-boot.sh')}; {_CLEAN_UP}".replace("$", "$$")}'
UNIT
mkdir -p {_LINK.rpartition("/")[0]}
ln -sf {_UNIT} {_LINK}
sync # the system soon notes that its first start is over
[ "${{1-}}" != start ] || {{ systemctl daemon-reload; systemctl start --no-block naze-bridge-card; }}
"""
#: Each step may be cut by the end of the power, and is then repeated. The result is for a person with the card in a PC,
#: the LED for a person without one. `led` gets the times on and off, ms (the kernel's ledtrig-timer).
_FIRST_BOOT = """\
#!/bin/sh
# Written by `naze-bridge card`. Its log is {log}.
set -eu
here=$(dirname "$(realpath "$0")")
result=$(dirname "$here")/{result}
umask 077
exec >>{log} 2>&1
umask 022
tell() {{
    printf '%s\\r\\n' "$@" >"$result.new"
    mv "$result.new" "$result"
    sync
}}
led() {{
    for led in /sys/class/leds/ACT /sys/class/leds/led0; do
        if [ -e $led ]; then echo timer >$led/trigger && echo $1 >$led/delay_on && echo $2 >$led/delay_off || true; fi
    done
}}
step() {{
    step=$1 remedy=$2 failed=${{3:-1000 1000}}
    echo "-- $step"
    led 100 100
    tell "naze-bridge is not set up yet. Now: $step." "Leave the Pi on for 5 minutes. If this text stays: $remedy"
}}
fail() {{
    led $failed
    tell "naze-bridge is not set up: $step failed. The Pi tries again every 30 s while it is on." \\
        "$remedy" "" "The end of the log:" "$(tail -n 5 {log})"
}}
trap '[ $? = 0 ] || fail' EXIT
package="$here/naze-bridge.deb" format='${{db:Status-Status}} ${{Version}}'
step 'installing the package' 'Prepare the card again, with a package that you fetched again.'
wanted="installed $(dpkg-deb --field "$package" Version)"
if [ "$(dpkg-query --showformat="$format" --show naze-bridge || true)" != "$wanted" ]; then
    dpkg --install "$package"
fi
step 'storing the token' 'Write the card again: its file system is damaged or full.'
state=/var/lib/private/naze-bridge
mkdir -p -m 700 /var/lib/private
install -d -o naze-bridge -m 700 $state
if [ ! -s $state/web-token ]; then
    install -o naze-bridge -m 600 "$here/web-token" $state/web-token.new
    mv $state/web-token.new $state/web-token
fi
step 'setting the Pi up' 'Look at the end of the log, and prepare the card again with other answers.'
# Status 1 is also doctor's, for a flight controller that is not connected yet, and a hotspot's that does not open.
naze-bridge setup --yes --keep-hotspot {options} || [ -e /etc/naze-bridge/setup.toml ]
step 'opening the hotspot' 'Does this Pi have Wi-Fi, and is the country right? Then prepare the card again.' '100 1900'
LC_ALL=C nmcli --get-values GENERAL.STATE connection show {connection} | grep -x activated
led 100 0
tell 'naze-bridge is set up. The Pi restarts once; then join its hotspot:' {ssid} '' 'The status page: {page}'
mv "$here" "$here.done"
{clean_up}
if [ -d /run/systemd/system ]; then systemctl reboot --no-block; fi
"""


class CardError(Exception):
    """A card that cannot be prepared, in one sentence."""


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
    """Prepare a card that Raspberry Pi Imager has just written; BOOT is the boot partition.

    The first start installs the package, sets the bridge up and opens the hotspot, without a network or a terminal.
    """
    if new_key and key_file is not None:
        raise click.UsageError(Fault.TWO_KEYS.text())
    password = secret_line(password_file)
    check_answers(hotspot, password, country, name)
    key = new_passphrase() if new_key else None if key_file is None else secret_line(key_file)
    if key and (weak := weakness(key)) is not None:
        complain("warning: " + Fault.WEAK_KEY.text(why=f"the key {weak}"))
    token = new_token()
    secrets = {"password": password, "web-token": token, **({"key": key} if key else {})}
    try:
        click.echo(f"Package: {prepare(boot, package, hotspot, country.upper(), name, secrets)}.")
    except CardError as error:
        fail(error)
    except OSError as error:
        fail(f"{error.filename or boot} cannot be changed: {reason(error)}")
    click.echo(f"The card is ready. Put it into the Pi and wait 5 minutes, then join {hotspot!r}.")
    show_secret("Its password", password, f"{boot / FOLDER}/password", make_wifi_data(hotspot, password, "WPA"))
    click.echo(f"Status page: {_PAGE}")
    show_secret("Its token, for changes", token, f"{boot / FOLDER}/web-token", f"{_PAGE}#token={token}")
    if key:
        show_secret("The key, for ground stations that may make changes", key, f"{boot / FOLDER}/key", key)


def prepare(boot: Path, package: Path, ssid: str, country: str, name: str | None, secrets: dict[str, str]) -> str:
    """Add the folder and the hook. `name`: the Pi's, if chosen. `secrets`: by file name. It may be repeated.

    Returns the checked properties of the package. CardError: this is not a freshly written card, and unchanged.
    """
    if not (boot / "cmdline.txt").exists() or not (boot / "config.txt").exists():
        raise CardError(
            f"{boot} is not the boot partition of a Raspberry Pi OS card: it has no cmdline.txt or config.txt"
        )
    checked = _check_package(package, boot)
    hook = _hooked(boot, name)
    folder = boot / FOLDER
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    (boot / RESULT).unlink(missing_ok=True)
    shutil.copyfile(package, folder / "naze-bridge.deb")
    for file, secret in secrets.items():
        (folder / file).write_text(f"{secret}\n")
    words = (
        shlex.join(["--country", country, *(["--name", name] if name else []), "--hotspot", ssid])
        + ' --password-file "$here/password"'
        + (' --key-file "$here/key"' if "key" in secrets else "")
    )
    _write(folder / "first-boot.sh", _first_boot(ssid, words))
    _write(folder / "enable.sh", _ENABLE)
    if hook is not None:
        _write(*hook)  # last: a card that was pulled out before it starts as if untouched
    return checked


def _first_boot(ssid: str, options: str) -> str:
    named = {"connection": CONNECTION, "ssid": shlex.quote(ssid), "page": _PAGE, "clean_up": _CLEAN_UP}
    return _FIRST_BOOT.format(log=_LOG, result=RESULT, options=options, **named)


def _check_package(path: Path, boot: Path) -> str:
    try:
        package = read_package(path)
    except ValueError as error:
        raise CardError(f"{error}. Releases have packages, and `make deb` builds one") from error
    needed = _architecture(boot)
    if package.name != "naze-bridge":
        raise CardError(f"{path} is the package of {package.name}, not of naze-bridge")
    if package.architecture not in _ARCHITECTURES or needed not in (package.architecture, None):
        wanted = needed or " or ".join(_ARCHITECTURES)
        raise CardError(f"{path} is for {package.architecture}; this card needs the one for {wanted}")
    return f"{package.version} for {package.architecture}, complete, {_check_signed(path)}"


def _check_signed(package: Path) -> str:
    """The signature's state. A package that does not match the signature that it carries is refused."""
    keys = Path(SIGNERS) if Path(SIGNERS).exists() else shipped("deb/signers")
    if not is_signed(package):
        return "not signed"
    if not (keys.exists() and has_key(read_bounded(keys, _MAX_BYTES).decode())):
        return "signed, but this naze-bridge has no key to check it"
    with TemporaryDirectory() as folder:
        copied = Path(folder, "package")
        shutil.copyfile(package, copied)
        try:
            check_signature(copied, keys)
        except HelperRefusal as error:
            raise CardError(f"{package}: {error}") from error
    return "signed by naze-bridge's releases"


def _architecture(boot: Path) -> str | None:
    """The architecture of the card's system, by its kernels, or None if they do not decide it."""
    is_32_bit = any((boot / f"kernel{kind}.img").exists() for kind in ("", "7", "7l"))
    if not is_32_bit:
        return "arm64" if (boot / "kernel8.img").exists() else None
    return None if re.search("^arm_64bit=1", _text(boot / "config.txt"), re.MULTILINE) else "armhf"


def _text(path: Path) -> str:
    try:
        return read_bounded(path, _MAX_BYTES).decode().replace("\r\n", "\n")
    except UnicodeDecodeError:
        raise CardError(f"{path} is not text in UTF-8: write the card again") from None


def _write(path: Path, text: str) -> None:
    path.write_bytes(text.encode())  # without carriage returns, even on Windows


def _hooked(boot: Path, name: str | None) -> tuple[Path, str] | None:
    """The file for the first start, and the text with our line, or None if the Pi has already begun."""
    user_data, firstrun = boot / "user-data", boot / "firstrun.sh"
    if user_data.exists():
        text = _text(user_data)
        if not text.startswith("#cloud-config"):
            raise CardError(f"{user_data} is not cloud-init's: write the card again")
        text = renamed_user_data(text, name) if name else text
        return user_data, text if _IN_USER_DATA in text else _with_command(user_data, text)
    if not firstrun.exists() and (boot / FOLDER / "first-boot.sh").exists():
        return None
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


class PackageFile(NamedTuple):
    """The fields as in the control file."""

    name: str
    version: str
    architecture: str


def read_package(path: Path) -> PackageFile:
    """Read a package's description; ValueError, one sentence, if it is damaged or not a package."""
    try:
        lines = map(plain_text, _control(path).splitlines())
        fields = dict(line.split(": ", 1) for line in lines if ": " in line)
        return PackageFile(fields["Package"], fields["Version"], fields["Architecture"])
    except OSError as error:
        raise ValueError(f"{path} cannot be read: {reason(error)}") from error
    except (ValueError, KeyError, EOFError, tarfile.TarError):
        raise ValueError(f"{path} is not a Debian package (.deb), or it is damaged: fetch it again") from None


def _control(path: Path) -> bytes:
    """The control file; reads to the end of the package, which a download may lack."""
    with open_regular(path) as file:
        size = path.stat().st_size
        if file.read(len(_MAGIC)) != _MAGIC:
            raise ValueError
        control = b""
        while header := file.read(_HEADER_SIZE):
            length = int(header[_SIZE])
            if header.startswith(b"control.tar") and length <= _MOST_CONTROL:
                with tarfile.open(fileobj=BytesIO(file.read(length))) as archive:
                    (member,) = (each for each in archive if each.name in ("control", "./control"))
                    found = archive.extractfile(member)
                    control = b"" if found is None else found.read(_MOST_CONTROL)
                file.seek(length % 2, 1)
            else:
                file.seek(length + length % 2, 1)
        if file.tell() > size:
            raise ValueError
        return control
