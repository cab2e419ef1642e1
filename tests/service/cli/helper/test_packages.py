# SPDX-License-Identifier: GPL-3.0-or-later
"""An update from a file, with real packages and without apt."""

import subprocess
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path

import pytest

from payloads.mission_data import to_json
from service.cli.helper import packages
from service.cli.helper.action import HelperRefusal, ThisPi, parse_action
from service.cli.helper.actions import ACTIONS
from service.cli.helper.packages import NEW, PREVIOUS, check_package, update, update_outcome, version_of
from service.cli.helper.signature import SIGNERS
from service.cli.setup.change import Machine, SetupError
from service.machine.host import Host
from tests.support.programs import REPOSITORY
from tests.support.release_key import ReleaseKey

_HOST = subprocess.run(["dpkg", "--print-architecture"], capture_output=True, text=True, check=True).stdout.strip()


class Apt(Machine):
    """Installs nothing, but remembers it; `broken`: a version that apt refuses."""

    def __init__(self, host: Host, broken: str = "") -> None:
        super().__init__(host)
        self.installed = "1.0"
        self._host_files = host
        self._broken = broken

    def run(self, command: Sequence[str], timeout_s: float = 60) -> str:
        match command:
            case ["env", _, "apt-get", *_, file]:
                version = version_of(Path(file), Machine(self._host_files)) or ""
                if version == self._broken:
                    raise SetupError(f"`apt-get` failed: no room for {version}")
                if "--simulate" not in command:
                    self.installed = version
            case ["dpkg-query", "--listfiles", _]:
                return "/.\n/usr\n/usr/bin\n/usr/bin/naze-bridge\n/usr/bin/link\n"
            case ["dpkg-query", "--showformat", "${Version}", *_]:
                return self.installed
            case ["dpkg-query", "--status", _]:
                return _control("naze-bridge", self.installed, _HOST, "Status: install ok installed\n")
            case ["systemd-run", *_]:
                return ""
            case _:
                return super().run(command, timeout_s)
        return ""


def _control(name: str, version: str, architecture: str, more: str = "") -> str:
    fields = f"Package: {name}\n{more}Version: {version}\nArchitecture: {architecture}\n"
    return f"{fields}Maintainer: x <x@localhost>\nDescription: x\n"


def packed(folder: Path, name: str = "naze-bridge", version: str = "2.0", architecture: str = _HOST) -> Path:
    (folder / "tree/DEBIAN").mkdir(parents=True, exist_ok=True)
    (folder / "tree/DEBIAN/control").write_text(_control(name, version, architecture))
    (folder / "tree/file").write_bytes(bytes(range(256)) * 100)
    package = folder / "x.deb"
    subprocess.run(["dpkg-deb", "--build", folder / "tree", package], check=True, capture_output=True)
    return package


@pytest.fixture
def host(tmp_path: Path) -> Host:
    host = Host(tmp_path / "root")
    for path in (NEW, "/usr/bin/naze-bridge", "/var/lib/dpkg/info/naze-bridge.postinst"):
        host.path(path).parent.mkdir(parents=True, exist_ok=True)
    host.path("/usr/bin/naze-bridge").write_text("the program\n")
    host.path("/usr/bin/link").symlink_to("naze-bridge")
    host.path("/var/lib/dpkg/info/naze-bridge.postinst").write_text("#!/bin/sh\n")
    host.path("/var/lib/dpkg/info/naze-bridge.postinst").chmod(0o755)
    return host


@pytest.mark.parametrize(
    ("wrong", "why"),
    [
        ({"name": "openssh-server"}, "This is the package of openssh-server, not of naze-bridge"),
        ({"architecture": "s390x"}, f"This package is for s390x; this Pi needs the one for {_HOST}"),
        ({"version": "6.6"}, "does not fit this system: `apt-get` failed: no room for 6.6"),
        ({"version": "1.0~rc1"}, "This package has version 1.0~rc1, older than 1.0, which runs now: go back"),
    ],
)
def test_a_package_that_does_not_fit(tmp_path: Path, host: Host, wrong: dict[str, str], why: str) -> None:
    with pytest.raises(HelperRefusal, match=why):
        check_package(packed(tmp_path, **wrong), Apt(host, broken="6.6"))


def test_a_damaged_package(tmp_path: Path, host: Host) -> None:
    package = packed(tmp_path)
    data = bytearray(package.read_bytes())
    package.write_bytes(data[:-200])
    with pytest.raises(HelperRefusal, match="This package is damaged"):
        check_package(package, Apt(host))
    package.write_text("no package")
    with pytest.raises(HelperRefusal, match="This is not a Debian package"):
        check_package(package, Apt(host))


def test_a_package_that_fits(tmp_path: Path, host: Host) -> None:
    assert check_package(packed(tmp_path), Apt(host)) == "2.0"
    assert check_package(packed(tmp_path, architecture="all"), Apt(host)) == "2.0"


@pytest.mark.parametrize("missing", [0, 1, 5000])
def test_it_is_received(tmp_path: Path, host: Host, monkeypatch: pytest.MonkeyPatch, missing: int) -> None:
    key = ReleaseKey(tmp_path / "key")
    started: list[str] = []
    monkeypatch.setattr(packages, "Machine", Apt)
    monkeypatch.setattr(Apt, "carry_out", lambda _, change: started.append(change.describe()))
    package = packed(tmp_path)
    unsigned, data = package.read_bytes(), key.sign(package).read_bytes()
    action = parse_action(to_json({"action": "install", "size": len(data)}).encode(), ACTIONS)
    pi = ThisPi(host, BytesIO(data[: len(data) - missing]))
    host.path(SIGNERS).parent.mkdir(parents=True)
    host.path(SIGNERS).write_text("# none yet\n")
    with pytest.raises(HelperRefusal, match="built without a key"):
        action(pi)
    key.signers.rename(host.path(SIGNERS))
    if missing:
        with pytest.raises(HelperRefusal, match="not received completely"):
            action(pi)
        assert not host.path(NEW).exists()
        return
    assert action(pi) == {"version": "2.0"}
    assert host.path(NEW).read_bytes() == unsigned
    # What a second request sends does not take the place of the checked package.
    second = parse_action(b'{"action": "install", "size": 6}', ACTIONS)
    with pytest.raises(HelperRefusal, match="not signed"):
        second(ThisPi(host, BytesIO(b"forged")))
    assert host.path(NEW).read_bytes() == unsigned
    assert [path.name for path in host.path(NEW).parent.iterdir()] == ["new.deb"]
    assert started[0].endswith(f"-m service.cli.helper.packages {NEW}")
    # systemd refuses a transient unit with the name of a unit's file.
    unit = next(word.removeprefix("--unit=") for word in started[0].split() if word.startswith("--unit="))
    assert not (REPOSITORY / "systemd" / f"{unit}.service").exists()


def new(tmp_path: Path, host: Host) -> Path:
    return packed(tmp_path).rename(host.path(NEW))


def test_an_update_and_the_way_back(tmp_path: Path, host: Host, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(packages, "_answers", lambda: True)
    apt = Apt(host)
    assert update(new(tmp_path, host), host, apt) == "Version 2.0 was installed; before it was 1.0."
    assert apt.installed == "2.0"
    assert version_of(host.path(PREVIOUS), apt) == "1.0"
    out = tmp_path / "out"
    subprocess.run(["dpkg-deb", "--raw-extract", host.path(PREVIOUS), out], check=True)
    assert (out / "usr/bin/naze-bridge").read_text() == "the program\n"
    assert (out / "usr/bin/link").readlink() == Path("naze-bridge")
    assert (out / "DEBIAN/postinst").exists()
    assert "Status" not in (out / "DEBIAN/control").read_text()
    assert update(host.path(PREVIOUS), host, apt) == "Version 1.0 was installed; before it was 2.0."
    assert version_of(host.path(PREVIOUS), apt) == "2.0"


def test_a_version_that_does_not_run_is_not_kept(tmp_path: Path, host: Host, monkeypatch: pytest.MonkeyPatch) -> None:
    apt = Apt(host)
    monkeypatch.setattr(packages, "_answers", lambda: apt.installed == "1.0")
    told = update(new(tmp_path, host), host, apt, lambda _: None)
    assert told == "Version 2.0 was not kept: the bridge did not start with it. This is 1.0 again."
    assert apt.installed == "1.0"


def test_a_failed_installation_is_reverted(tmp_path: Path, host: Host, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(packages, "_answers", lambda: True)
    apt = Apt(host, broken="2.0")
    assert "no room for 2.0. This is 1.0 again" in update(new(tmp_path, host), host, apt)
    assert apt.installed == "1.0"


def test_the_package_of_an_interrupted_update_stays_until_it_runs(
    tmp_path: Path, host: Host, monkeypatch: pytest.MonkeyPatch
) -> None:
    """naze-bridge-finish-update.service installs it at the next start."""

    class Cut(Apt):
        left = 0

        def run(self, command: Sequence[str], timeout_s: float = 60) -> str:
            if "apt-get" in command and self.left == 0:
                raise KeyboardInterrupt
            self.left -= "apt-get" in command
            return super().run(command, timeout_s)

    monkeypatch.setattr(packages, "_answers", lambda: True)
    for left, version in ((0, "2.0"), (1, "1.0")):  # in the installation, and in the way back
        apt = Cut(host, broken="2.0")
        apt.left = left
        with pytest.raises(KeyboardInterrupt):
            update(new(tmp_path, host), host, apt)
        assert version_of(host.path(PREVIOUS).with_name("installing.deb"), apt) == version


def test_before_the_first_update_there_is_no_outcome(host: Host) -> None:
    assert update_outcome(host) == ""
