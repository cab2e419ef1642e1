# SPDX-License-Identifier: GPL-3.0-or-later
"""The Debian package: its contents, and installation to purge on a machine without a network.

It is built once, for this machine and two Pythons, because pip is slow. `make deb` builds it for all.
"""

import os
import re
import shutil
import struct
import subprocess
import tarfile
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path

import pytest

from deb.build import PYTHONS, build, fetch
from service.cli import card
from service.cli.helper.signature import SIGNERS
from service.machine.helper_socket import UNITS
from tests.support.bare_root import BareRoot

_REPOSITORY = Path(__file__).resolve().parents[2]
_MISSION = _REPOSITORY / "examples" / "naze-field.waypoints"
_SCHEMA = "storage/schema.sql"
_ELF_MACHINES = {"amd64": 62, "arm64": 183, "armhf": 40}
#: `dpkg --print-architecture` of this machine must be one of them.
_HOST = subprocess.run(["dpkg", "--print-architecture"], capture_output=True, text=True, check=True).stdout.strip()
_ASK_VERSION = "import sys; print('%d.%d' % sys.version_info[:2])"
#: The bare root's version, and another.
_OWN = subprocess.run(
    ["/usr/bin/python3", "-c", _ASK_VERSION], capture_output=True, text=True, check=True
).stdout.strip()
_PYTHONS = (_OWN, next(python for python in PYTHONS if python != _OWN))
_WHEEL_MACHINES = {"arm64": ("aarch64",), "armhf": ("armv7l", "aarch64")}
#: Starts the daemon in the background like the unit, with the folders that systemd would create.
_START = """
mkdir -p /var/lib/naze-bridge /run/naze-bridge
export STATE_DIRECTORY=/var/lib/naze-bridge RUNTIME_DIRECTORY=/run/naze-bridge
sed -n 's/^ExecStart=/exec /p' /usr/lib/systemd/system/naze-bridge.service > /run/start
(sh /run/start >/run/log 2>&1 & echo $! >/run/pid)
for turn in $(seq 300); do naze-bridge status 2>/dev/null | grep -q ', MSP' && exit 0; sleep 0.1; done
cat /run/log; exit 1
"""
#: What setup leaves outside the package.
_AS_AFTER_SETUP = """
cd /etc
mkdir -p NetworkManager/dnsmasq-shared.d NetworkManager/system-connections avahi/services
touch NetworkManager/system-connections/naze-bridge-hotspot.nmconnection avahi/services/naze-bridge.service
touch NetworkManager/dnsmasq-shared.d/naze-bridge-captive.conf
touch naze-bridge/setup.toml naze-bridge/gcs.key
mkdir -p /var/lib/naze-bridge-helper
touch naze-bridge/page.toml /var/lib/naze-bridge-helper/previous.deb
"""
_UNITS = (
    *(".service", "-captive.socket", "-captive.service"),
    *(f"-helper-{unit}{kind}" for unit in UNITS for kind in (".socket", "@.service")),
)
#: Every file written since with one of the secrets in it, also as in a key file: name, owner and mode.
# The overlay's own files, because other programs write to the machine meanwhile.
_SECRETS = """
cd /mnt && find . -newer /root/before -type f -size -4M \\
    -exec grep -lF -e '{0}' -e 'correct\\shorse' -e '{1}' -e '{2}' {{}} + | xargs -r stat -c '%n %U %a'
"""
_EXPECTED_SECRETS = [
    "./etc/NetworkManager/system-connections/naze-bridge-hotspot.nmconnection root 600",
    "./etc/naze-bridge/gcs.key naze-bridge 600",
    "./var/lib/private/naze-bridge/web-token naze-bridge 600",
]
_LED = "cd /sys/class/leds/ACT && echo -n $(cat trigger delay_on delay_off)"
_STOP = "kill $(cat /run/pid); while grep -q . /proc/$(cat /run/pid)/cmdline; do sleep 0.1; done"


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    # Compression would take longer than everything else.
    return build(_HOST, _PYTHONS, tmp_path_factory.mktemp("package"), compression="none")


@pytest.fixture(scope="module")
def without_libraries(package: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The package with service/ only, for tests of its scripts: these compile all modules at each installation."""
    folder = tmp_path_factory.mktemp("without-libraries")
    with unpacked(package, folder) as control:
        for library in (control.parents[1] / "usr/lib/naze-bridge/lib").glob("*/site-packages/*"):
            if library.is_dir() and library.name != "service":
                shutil.rmtree(library)
    return folder / "repacked.deb"


@pytest.fixture(scope="module")
def wheels(package: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of wheels, first those of the package that are for every Python and machine."""
    folder = tmp_path_factory.mktemp("fetched") / "wheels"
    folder.mkdir()
    for wheel in (_REPOSITORY / "build" / "deb" / _HOST / "wheels").glob("*-none-any.whl"):
        shutil.copy(wheel, folder)
    return folder


@pytest.fixture
def root(package: Path, tmp_path: Path) -> Iterator[BareRoot]:
    with BareRoot(tmp_path) as root:
        root.put(package, "/root/naze-bridge.deb")
        yield root


def with_version(package: Path, version: str, folder: Path) -> Path:
    """The package under another version, with a module that no other has."""
    with unpacked(package, folder) as control:
        own = control.parents[1] / f"usr/lib/naze-bridge/lib/python{_OWN}/site-packages/v{version}"
        own.mkdir()
        (own / "module.py").touch()
        control.write_text(re.sub(r"^Version: .*", f"Version: {version}", control.read_text(), flags=re.MULTILINE))
    return folder / "repacked.deb"


@contextmanager
def unpacked(package: Path, folder: Path) -> Iterator[Path]:
    """Unpack the package, yield its control file, and pack it again as repacked.deb."""
    contents = folder / "contents"
    subprocess.run(["dpkg-deb", "--raw-extract", package, contents], check=True)
    yield contents / "DEBIAN" / "control"
    command: list[str | Path] = [
        "dpkg-deb",
        "--root-owner-group",
        "-Znone",
        "--build",
        contents,
        folder / "repacked.deb",
    ]
    subprocess.run(command, check=True, capture_output=True)
    shutil.rmtree(contents)


def files_of(package: Path) -> dict[str, tarfile.TarInfo]:
    return {member.name.removeprefix("."): member for member in _archive(package)}


def _archive(package: Path) -> tarfile.TarFile:
    data = subprocess.run(["dpkg-deb", "--fsys-tarfile", package], capture_output=True, check=True).stdout
    return tarfile.open(fileobj=BytesIO(data))


def test_the_package_has_the_expected_files(package: Path) -> None:
    files = files_of(package)
    for expected in (
        *(f"/usr/lib/naze-bridge/lib/python{python}/site-packages/{_SCHEMA}" for python in _PYTHONS),
        "/usr/bin/naze-bridge",
        SIGNERS,
        *(f"/usr/lib/systemd/system/naze-bridge{name}" for name in _UNITS),
        "/usr/lib/udev/rules.d/60-naze-bridge.rules",
        "/usr/lib/sysusers.d/naze-bridge.conf",
        "/usr/share/naze-bridge/config.toml",
        "/usr/share/doc/naze-bridge/examples/config.toml",
        "/usr/share/doc/naze-bridge/copyright",
        "/usr/share/doc/naze-bridge/changelog.gz",
        *(f"/usr/share/doc/naze-bridge/firmware/{name}" for name in ("apply", "naze_mission.c", "harakiri_guard.h")),
        "/usr/share/man/man1/naze-bridge.1.gz",
        "/usr/share/bash-completion/completions/naze-bridge",
    ):
        assert expected in files
    assert not [name for name in files if "/simulator/sky" in name]
    dialects = {name.partition("/dialects/")[2] for name in files if "/pymavlink/dialects/" in name}
    assert dialects - {""} == {"__init__.py", "v20", "v20/__init__.py", "v20/all.py"}
    assert {(member.uid, member.gid) for member in files.values()} == {(0, 0)}
    assert not [name for name, member in files.items() if member.mode & 0o022 and not member.issym()]
    described = subprocess.run(["dpkg-deb", "--field", package], capture_output=True, text=True, check=True).stdout
    assert f"Architecture: {_HOST}\n" in described


def test_the_libraries_are_for_the_architecture_and_both_pythons(package: Path) -> None:
    with _archive(package) as archive:
        # A file shared by both Pythons is a hard link without contents.
        libraries = [each for each in archive if each.name.endswith(".so") and each.isfile() and not each.islnk()]
        machines = set()
        for member in libraries:
            content = archive.extractfile(member)
            assert content is not None
            machines.add(struct.unpack_from("<H", content.read(20), 18)[0])
    assert machines == {_ELF_MACHINES[_HOST]}
    for python in _PYTHONS:
        assert [each for each in libraries if f"cpython-{python.replace('.', '')}" in each.name]


@pytest.mark.parametrize(("architecture", "python"), [("armhf", PYTHONS[0]), ("arm64", PYTHONS[-1])])
def test_every_library_has_a_pinned_wheel(architecture: str, python: str, wheels: Path) -> None:
    before = set(wheels.iterdir())
    fetch(architecture, python, wheels)
    machines = ("any", *_WHEEL_MACHINES[architecture])
    assert [wheel for wheel in {*wheels.iterdir()} - before if not wheel.stem.endswith(machines)] == []


def test_the_pages_links_are_intact(package: Path) -> None:
    files = files_of(package)
    with _archive(package) as archive:
        for member in archive:
            if not member.name.startswith("./usr/share/doc/naze-bridge/") or not member.name.endswith(".md"):
                continue
            content = archive.extractfile(member)
            assert content is not None
            for link in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", content.read().decode()):
                target = os.path.normpath(Path(member.name.removeprefix(".")).parent / link)
                assert target in files or f"{target}/" in files, f"{member.name}: {link}"


def test_the_package_is_free_of_build_machine_paths(package: Path) -> None:
    with _archive(package) as archive:
        for member in archive:
            content = archive.extractfile(member) if member.isfile() else None
            assert content is None or str(_REPOSITORY).encode() not in content.read(), member.name


@pytest.mark.timeout(1800)  # dpkg compiles all libraries
def test_it_is_installed_used_upgraded_removed_and_purged(
    package: Path, without_libraries: Path, root: BareRoot, tmp_path: Path
) -> None:
    assert "sudo naze-bridge setup" in root.run("dpkg --install /root/naze-bridge.deb")
    assert root.run("id --name --user naze-bridge") == "naze-bridge\n"
    assert "Harakiri source tree" in root.run("/usr/share/doc/naze-bridge/firmware/apply --help")
    # Not enabled by default.
    assert "naze-bridge" not in root.run("ls /etc/systemd/system/multi-user.target.wants")
    # The byte code is installed, because the service cannot write it.
    assert root.run("find /usr/lib/naze-bridge -name 'daemon.cpython-*.pyc'")
    root.run("echo 'fc = \"sim:\"' >> /etc/naze-bridge/config.toml")
    root.put(_MISSION, "/root/naze-field.waypoints")

    printed = root.run("naze-bridge demo --once")
    assert "the flight controller holds 13, read back from it and compared" in printed

    assert "this command is in the package naze-bridge-sim" in root.run("naze-bridge fly --help", status=1)
    (sim,) = package.parent.glob("naze-bridge-sim_*_all.deb")
    root.put(sim, "/root/naze-bridge-sim.deb")
    root.run("dpkg --install /root/naze-bridge-sim.deb")
    assert "Judge the real flight" in root.run("naze-bridge fly --help")
    assert "--inav-version" in root.run("naze-bridge sim --help")
    root.run("dpkg --remove naze-bridge-sim && ! ls -d /usr/lib/naze-bridge/lib/*/site-packages/simulator/sky")

    root.run(_START)
    assert "ACCEPTED" in root.run("naze-bridge push /root/naze-field.waypoints")
    assert "VERIFIED" in root.run("naze-bridge missions list")
    root.run(_STOP)

    # An upgrade and a downgrade ask no questions and keep the changed configuration and the missions.
    for version in ("99.0", "99.0~dev7"):
        root.put(with_version(without_libraries, version, tmp_path), "/root/other.deb")
        printed = root.run("apt-get install --yes --allow-downgrades /root/other.deb </dev/null")
        assert "unable to delete" not in printed
        assert version in root.run("dpkg-query --showformat '${Version} ' --show naze-bridge")
        assert 'fc = "sim:"' in root.run("cat /etc/naze-bridge/config.toml")
    # After an upgrade of the system to another Python it is compiled for that.
    root.run("find /usr/lib/naze-bridge -name '*.pyc' -delete")
    root.run("dpkg-trigger --no-await --by-package=dpkg /usr/bin/python3 && dpkg --triggers-only --pending")
    assert root.run("find /usr/lib/naze-bridge -name 'daemon.cpython-*.pyc'")
    root.run(_AS_AFTER_SETUP)
    root.run("ln -s /usr/lib/systemd/system/naze-bridge.service /etc/systemd/system/multi-user.target.wants/")
    root.run("dpkg --remove naze-bridge")
    assert "naze-bridge" not in root.run("ls /etc/systemd/system/multi-user.target.wants")
    root.run("ls /usr/lib/naze-bridge", status=2)

    root.run("mkdir /var/lib/private; mv /var/lib/naze-bridge /var/lib/private/")
    output = root.run("dpkg --purge naze-bridge")
    assert "missions and logs stay in /var/lib/private/naze-bridge" in output
    assert "missions.db" in root.run("ls /var/lib/private/naze-bridge")
    left = root.run("find /etc /usr /var /opt -xdev -name '*naze-bridge*' -not -path '/var/lib/private/*'")
    assert left == ""


@pytest.mark.timeout(1800)
@pytest.mark.parametrize("system", ["bookworm", "trixie"])
def test_in_a_bare_root_a_card_sets_itself_up_and_does_not_leave_a_secret(
    package: Path, root: BareRoot, tmp_path: Path, system: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(card, "_ARCHITECTURES", (_HOST,))
    boot = tmp_path / "boot"
    boot.mkdir()
    (boot / "config.txt").write_text("[all]\n")
    (boot / "cmdline.txt").write_text("console=serial0,115200 console=tty1 rootwait systemd.run=/boot/firstrun.sh\n")
    hook = boot / ("firstrun.sh" if system == "bookworm" else "user-data")
    hook.write_text("#!/bin/bash\nset +e\nexit 0\n" if system == "bookworm" else "#cloud-config\n")
    secrets = {"password": "correct horse", "web-token": "2345-token-6789", "key": "w9rt4-b2npq-8kfhd-zm3sv"}
    card.prepare(boot, package, "kite", "DE", None, secrets)
    packed = tmp_path / "boot.tar"
    with tarfile.open(packed, "w") as archive:
        archive.add(boot, "firmware")
    root.put(packed, "/root/boot.tar")
    root.run("touch /root/before; mkdir -p /boot && tar -xf /root/boot.tar -C /boot && rm /root/boot.tar")
    # NetworkManager, whose radio works once there is this file.
    root.put(b"#!/bin/sh\n[ -e /root/radio ] && echo activated\n", "/usr/bin/nmcli")
    root.run("chmod +x /usr/bin/nmcli")
    # A power cut may follow at once: the unit is then on the card.
    root.put(b"#!/bin/sh\nls /etc/systemd/system/multi-user.target.wants >/root/synced\n", "/usr/bin/sync")
    root.run("chmod +x /usr/bin/sync")
    root.run("ln -s private/naze-bridge /var/lib/naze-bridge")  # as DynamicUser= makes it
    root.run("mkdir -p /sys/class/leds/ACT")

    if system == "bookworm":
        root.run("bash /boot/firmware/firstrun.sh")
    else:
        (command,) = re.findall(r"- \[(.*)\]", hook.read_text())
        # systemd does not run here to start the unit.
        root.run(command.replace(",", "").removesuffix(" start"))
    assert "naze-bridge-card" in root.run("cat /root/synced")
    unit = root.run("cat /etc/systemd/system/multi-user.target.wants/naze-bridge-card.service")
    (started,) = re.findall("^ExecStart=(.*)$", unit, re.MULTILINE)
    start = started.replace("$$", "$")
    if system == "bookworm":
        return  # from here on the systems do not differ
    root.run(start, status=1)
    result = root.run("cat /boot/firmware/naze-bridge-RESULT.txt")
    assert "naze-bridge is not set up: opening the hotspot failed. The Pi tries again every 30 s" in result
    assert "Does this Pi have Wi-Fi" in result
    assert root.run(_LED) == "timer 100 1900"  # waits for the hotspot
    root.run("ls /boot/firmware/naze-bridge/first-boot.sh")
    root.run("touch /root/radio")
    root.run(start)
    root.run(start)  # the power was cut before the unit was removed
    assert "naze-bridge is set up." in root.run("cat /boot/firmware/naze-bridge-RESULT.txt")
    assert root.run(_LED) == "timer 100 0"  # on

    # Installed once, although it was tried twice.
    assert root.run("cat /var/log/naze-bridge-card.log").count("Unpacking naze-bridge") == 1
    assert "naze-bridge, version" in root.run("naze-bridge --version")
    assert "0.0.0.0:8080" in root.run("cat /etc/naze-bridge/setup.toml")
    hotspot = root.run("cat /etc/NetworkManager/system-connections/naze-bridge-hotspot.nmconnection")
    assert "ssid=107;105;116;101;\n" in hotspot
    assert "autoconnect=true" in hotspot
    assert "console=serial0" not in root.run("cat /boot/firmware/cmdline.txt")
    root.run("ls /etc/systemd/system/multi-user.target.wants/naze-bridge.service")
    assert root.run("ls /boot/firmware").split().count("naze-bridge") == 0
    assert "card" not in root.run("ls /etc/systemd/system /etc/systemd/system/multi-user.target.wants")

    # A setup again, and a run with the page.
    root.run("naze-bridge setup --yes --fc sim: >/root/setup.log 2>&1")
    root.run(_START)
    root.run(_STOP)
    found = root.run(_SECRETS.format(*secrets.values())).split("\n")
    assert sorted(filter(None, found)) == _EXPECTED_SECRETS
