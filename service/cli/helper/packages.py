# SPDX-License-Identifier: GPL-3.0-or-later
"""An update from a file: received and checked by the helper, installed by a process that outlives the old program.

Only a signed package is read further, and only a newer one installed: an older one may have known faults.

That process first packs the installed files again, so that it can go back, and does so by itself if the
bridge does not run with the new package: `python -m service.cli.helper.packages FILE`.
"""

import os
import shutil
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from service.cli.helper.action import DELAY_S, HelperRefusal, ThisPi
from service.cli.helper.signature import SIGNERS, check_signature, has_key
from service.cli.setup.change import Machine, Run, SetupError, WriteFile, later
from service.daemon.client import STATUS, ControlError, ask_daemon
from service.machine.host import Host

#: Not in /run, which is memory.
_FOLDER = "/var/lib/naze-bridge-helper"
NEW, PREVIOUS, _OUTCOME = f"{_FOLDER}/new.deb", f"{_FOLDER}/previous.deb", f"{_FOLDER}/outcome"
_RECEIVED = f"{_FOLDER}/received.deb"
_NAME = "naze-bridge"
_PIECE = 1 << 16
_DPKG_INFO = "/var/lib/dpkg/info"
_CONTROL_FILES = ("postinst", "prerm", "postrm", "triggers", "md5sums", "conffiles")
_TIMEOUT_S = 900
#: By then the new daemon answers, even on a Pi Zero.
_START_S = 60
_SHOW = ("dpkg-deb", "--show", "--showformat", "${Package}\n${Version}\n${Architecture}")
_APT = (
    "env",
    "DEBIAN_FRONTEND=noninteractive",
    "apt-get",
    "install",
    "--yes",
    "--allow-downgrades",
    "--option",
    "Dpkg::Options::=--force-confold",
)


def receive(pi: ThisPi, size: int) -> str:
    """Store the body, check that it is this program's package for this machine, and start the update; the version."""
    if not can_update(pi.host):
        raise HelperRefusal("This package was built without a key for updates: install it with apt in a terminal.")
    path = pi.host.path(_RECEIVED)
    path.parent.mkdir(parents=True, exist_ok=True)
    left = size
    with path.open("wb") as file:
        while left and (piece := pi.body.read(min(left, _PIECE))):
            file.write(piece)
            left -= len(piece)
    try:
        if left:
            raise HelperRefusal("The package was not received completely: send it again.")
        check_signature(path, pi.host.path(SIGNERS))
        found = check_package(path, Machine(pi.host))
        # Another request may come before the update starts: what it sends is not checked yet.
        path.replace(pi.host.path(NEW))
        start_update(pi, NEW)
    finally:
        path.unlink(missing_ok=True)
    return found


def can_update(host: Host) -> bool:
    """True if the installed package knows a key for releases."""
    return has_key(host.read(SIGNERS))


def check_package(path: Path, machine: Machine) -> str:
    """The version of a signed package that can be installed here; HelperRefusal if it is damaged or does not fit."""
    try:
        name, version, architecture = machine.run((*_SHOW, str(path))).split()
    except (SetupError, ValueError):
        raise HelperRefusal("This is not a Debian package (.deb), or it is damaged.") from None
    own = machine.run(("dpkg", "--print-architecture")).strip()
    if name != _NAME:
        raise HelperRefusal(f"This is the package of {name}, not of {_NAME}.")
    if architecture not in (own, "all"):
        raise HelperRefusal(f"This package is for {architecture}; this Pi needs the one for {own}.")
    installed = machine.run(("dpkg-query", "--showformat", "${Version}", "--show", _NAME)).strip()
    try:
        machine.run(("dpkg", "--compare-versions", version, "ge", installed))
    except SetupError:
        way = "go back to the version before the last update below, or use apt in a terminal"
        raise HelperRefusal(
            f"This package has version {version}, older than {installed}, which runs now: {way}."
        ) from None
    try:
        # Unpacks everything once: a damaged file fails here and not half-way through the installation.
        machine.run(("dpkg-deb", "--contents", str(path)), _TIMEOUT_S)
    except SetupError:
        raise HelperRefusal("This package is damaged: fetch it again.") from None
    try:
        machine.run((*_APT, "--simulate", str(path)), _TIMEOUT_S)
    except SetupError as error:
        raise HelperRefusal(f"This package does not fit this system: {error}") from error
    return version


def version_of(path: Path, machine: Machine) -> str | None:
    """The version of a package file, or None if there is none."""
    try:
        return machine.run((*_SHOW, str(path))).split()[1] if path.exists() else None
    except (SetupError, IndexError):
        return None


def start_update(pi: ThisPi, package: str) -> None:
    """Install a checked package in a separate process, after the reply."""
    program = (sys.executable, "-I", "-m", "service.cli.helper.packages", package)
    Machine(pi.host).carry_out(Run(later(program, DELAY_S, "naze-bridge-update")))


def update_outcome(host: Host) -> str:
    """The result of the last update, a sentence, or empty before the first."""
    return host.read(_OUTCOME).strip()


def update(package: Path, host: Host, machine: Machine, sleep: Callable[[float], None] = time.sleep) -> str:
    """Install the package. If the bridge does not run with it, return to the previous. Returns the outcome."""
    was_running = _answers()
    # Moved first: it may be the previous. naze-bridge-finish-update.service installs it after a power cut, so it
    # must be on the disk: dpkg takes zeros for the end of a package.
    os.sync()
    installing, kept = package.rename(host.path(f"{_FOLDER}/installing.deb")), host.path(PREVIOUS)
    version, former = version_of(installing, machine), pack_installed(kept, host, machine)
    outcome = f"Version {version} was installed; before it was {former}."
    try:
        machine.run((*_APT, str(installing)), _TIMEOUT_S)
        why = "the bridge did not start with it" if was_running and not _runs_again(sleep) else ""
    except SetupError as error:
        why = f"apt failed: {str(error).rpartition(' failed: ')[2]}"  # without its long command
    if why:
        kept.replace(installing)
        machine.run((*_APT, str(installing)), _TIMEOUT_S)
        outcome = f"Version {version} was not kept: {why}. This is {former} again."
    installing.unlink()
    return outcome


def pack_installed(package: Path, host: Host, machine: Machine) -> str | None:
    """Pack the installed files as the package that they came from. Returns the version."""
    root = package.with_suffix(".tree")
    shutil.rmtree(root, ignore_errors=True)
    control = root / "DEBIAN"
    control.mkdir(parents=True)
    for name in machine.run(("dpkg-query", "--listfiles", _NAME)).splitlines():
        source, target = host.path(name), root / name.lstrip("/")
        if source.is_symlink():
            target.symlink_to(source.readlink())
        elif source.is_dir():
            target.mkdir(parents=True, exist_ok=True)
        elif source.exists():
            shutil.copy2(source, target)
    fields = machine.run(("dpkg-query", "--status", _NAME))
    kept = [line for line in fields.splitlines() if not line.startswith(("Status:", "Conffiles:", " /etc/"))]
    (control / "control").write_text("\n".join(kept) + "\n")
    for name in _CONTROL_FILES:
        if (file := host.path(f"{_DPKG_INFO}/{_NAME}.{name}")).exists():
            shutil.copy2(file, control / name)
    # Fast rather than small: a Pi Zero would compress for minutes.
    packed = package.with_suffix(".new")
    machine.run(("dpkg-deb", "--root-owner-group", "-Zgzip", "-z1", "--build", str(root), str(packed)), _TIMEOUT_S)
    os.sync()
    packed.replace(package)
    shutil.rmtree(root)
    return version_of(package, machine)


def _runs_again(sleep: Callable[[float], None]) -> bool:
    for _ in range(_START_S):
        if _answers():
            return True
        sleep(1)
    return False


def _answers() -> bool:
    try:
        ask_daemon(None, STATUS)
    except ControlError:
        return False
    return True


def main(arguments: Sequence[str]) -> None:
    (name,) = arguments
    host = Host()
    machine = Machine(host)
    try:
        outcome = update(host.path(name), host, machine)
    except (SetupError, OSError) as error:
        outcome = f"The update failed: {error}"
    machine.carry_out(WriteFile(_OUTCOME, f"{outcome}\n"))
    sys.stdout.write(f"{outcome}\n")


if __name__ == "__main__":
    main(sys.argv[1:])
