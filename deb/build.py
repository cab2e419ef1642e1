# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds the Debian packages: `make deb`, or `python -m deb.build amd64 arm64 armhf` in the project's folder.

naze-bridge-sim has the simulators, which a pilot's Pi does not need.

The libraries are the wheels that requirements.lock pins, for the Pythons of Debian 12 and 13 and Ubuntu 24.04 side by
side. pip fetches them for any architecture on any machine, and nothing is compiled. The target does not need a network.

cbor2 has no wheel for armhf: the last pure Python release is used there (armhf.lock). pymavlink has none either.
Only the modules that we use are packed: the rest is a module in C and 90 MB of other dialects and log tools.

pip evaluates a requirement's `python_version < ...` for the Python that runs it, not for the target's. So far our
requirements do not differ between 3.11 and 3.14.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Sequence
from pathlib import Path

from deb.tree import lay_out

_HERE = Path(__file__).resolve().parent
_PROJECT = _HERE.parent
_WORK = _PROJECT / "build" / "deb"
_DIST = _PROJECT / "dist"
_PIP = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet")
#: Debian 12 (and Raspberry Pi OS of 2023), Ubuntu 24.04, Debian 13.
PYTHONS = ("3.11", "3.12", "3.13")
#: Debian's name of an architecture -> the name in wheels.
_MACHINES = {"amd64": "x86_64", "arm64": "aarch64", "armhf": "armv7l"}
#: The C library that wheels may require; Debian 12 has 2.36.
_PYMAVLINK = re.compile(
    r"pymavlink/(__init__|mavutil|mavexpression|mavextra|rotmat|generator/(__init__|mavcrc|mavparse)"
    r"|dialects/(__init__|v20/(__init__|all)))\.py|.*\.dist-info/(WHEEL|licenses/.+)"
)
_GLIBC = (*(f"manylinux_2_{minor}" for minor in range(36, 16, -1)), "manylinux2014")


def build(architecture: str, pythons: Sequence[str] = PYTHONS, folder: Path = _DIST, compression: str = "xz") -> Path:
    """Build naze-bridge, and naze-bridge-sim next to it, in `folder`. Returns the path of the first.

    `compression` is dpkg-deb's.
    """
    work = _WORK / architecture
    shutil.rmtree(work, ignore_errors=True)
    wheels = work / "wheels"
    own = _wheel(wheels)
    version = own.name.split("-")[1]
    libraries = {}
    for python in pythons:
        fetch(architecture, python, wheels)
        machine = target(python, _MACHINES[architecture])
        # Only from the wheels, whose hashes were just checked. Build tools are left out.
        libraries[python] = work / python
        from_wheels = ("--no-index", "--find-links", wheels, "--no-compile", "--target", libraries[python])
        _run(*_PIP, "install", "--no-warn-conflicts", *from_wheels, *machine, f"naze-bridge=={version}")
    root = work / "root"
    lay_out(root, work / "sim", libraries, _PROJECT, debian_version(version), architecture)
    folder.mkdir(exist_ok=True)
    package = folder / f"naze-bridge_{debian_version(version)}_{architecture}.deb"
    for tree, file in ((root, package), (work / "sim", folder / f"naze-bridge-sim_{debian_version(version)}_all.deb")):
        _run("dpkg-deb", "--root-owner-group", f"-Z{compression}", "--build", tree, file)
    return package


def build_python(folder: Path) -> list[Path]:
    """Build the wheel and the source archive in `folder`."""
    _run(sys.executable, "-m", "hatchling", "build", "--target", "sdist", "--directory", folder)
    return [_wheel(folder), *folder.glob("*.tar.gz")]


def _wheel(folder: Path) -> Path:
    _run(*_PIP, "wheel", "--no-build-isolation", "--no-deps", "--wheel-dir", folder, _PROJECT)
    (made,) = folder.glob("naze_bridge-*.whl")
    return made


def debian_version(version: str) -> str:
    """A Python version for dpkg, where ~ sorts before the release: 0.2.1.dev12+g1234567 is 0.2.1~dev12+g1234567."""
    public, plus, local = version.partition("+")
    return re.sub(r"\.?(dev|a|b|rc)(?=\d)", r"~\1", public) + plus + local


def fetch(architecture: str, python: str, wheels: Path) -> None:
    """Download the wheels for one Python to the folder `wheels`. Their hashes are checked.

    Wheels for every Python and machine that are already there stay.
    """
    wheels.mkdir(parents=True, exist_ok=True)
    if not any(wheels.glob("pymavlink-*")):
        _fetch_pymavlink(wheels)
    for lock in _locks(architecture, wheels):
        _download(lock, wheels, *target(python, _MACHINES[architecture]))


def _download(lock: Path, folder: Path, *target: str) -> None:
    _run(*_PIP, "download", "--require-hashes", "--no-deps", "--requirement", lock, *target, "--dest", folder)


def _fetch_pymavlink(wheels: Path) -> None:
    """Put a wheel with the used modules of pymavlink into the folder `wheels`. It suits every Python and machine."""
    with tempfile.TemporaryDirectory() as name:
        lock = Path(name) / "pymavlink.lock"
        lock.write_text(next(text for text, package, _ in _pinned() if package == "pymavlink"))
        _download(lock, Path(name), *target(PYTHONS[0], "x86_64"))
        (whole,) = Path(name).glob("*.whl")
        package = "-".join(whole.name.split("-")[:2])
        with zipfile.ZipFile(whole) as source, zipfile.ZipFile(wheels / f"{package}-py3-none-any.whl", "w") as used:
            kept = [each for each in source.namelist() if _PYMAVLINK.fullmatch(each)]
            for each in kept:
                used.writestr(each, source.read(each))
            about = f"{package}.dist-info"
            metadata = source.read(f"{about}/METADATA").decode()
            used.writestr(f"{about}/METADATA", metadata.replace("Requires-Dist: lxml\n", ""))
            used.writestr(f"{about}/RECORD", "".join(f"{each},,\n" for each in (*kept, f"{about}/METADATA")))


def _locks(architecture: str, wheels: Path) -> list[Path]:
    """The lists of pinned wheel files to fetch for an architecture to the folder `wheels`."""
    fetched = {_pin(*wheel.name.split("-")[:2]) for wheel in wheels.glob("*-none-any.whl")}
    needed = [text for text, name, version in _pinned() if _pin(name, version) not in fetched]
    if architecture == "armhf":
        needed = [each for each in needed if not each.startswith("cbor2==")]
    usual = wheels.parent / "usual.lock"
    usual.write_text("".join(needed))
    return [*([usual] if needed else []), *([_HERE / "armhf.lock"] if architecture == "armhf" else [])]


def _pinned() -> list[tuple[str, str, str]]:
    """The text, name and version of each requirement in requirements.lock."""
    # A requirement extends from its name to the next line that is not indented.
    return re.findall(r"^(([a-z].*?)==([^ \n]+).*\n(?:[ ].*\n)*)", (_PROJECT / "requirements.lock").read_text(), re.M)


def _pin(name: str, version: str) -> str:
    return f"{re.sub('[-_.]+', '-', name).lower()}=={version}"


def target(python: str, machine: str) -> list[str]:
    """The options of pip for the wheels of another machine, such as "aarch64"."""
    platforms = [word for libc in _GLIBC for word in ("--platform", f"{libc}_{machine}")]
    return ["--only-binary=:all:", "--python-version", python, *platforms]


def _run(*command: str | Path) -> None:
    # The wheel's files get the commit's time, so that builds are reproducible.
    subprocess.run(command, check=True, cwd=_PROJECT, env=os.environ | {"SOURCE_DATE_EPOCH": _commit_time()})


def _commit_time() -> str:
    command = ("git", "-C", str(_PROJECT), "log", "-1", "--format=%ct")
    asked = subprocess.run(command, check=False, capture_output=True, text=True)
    # A source archive has the commit's time on the files.
    return asked.stdout.strip() or str(int((_PROJECT / "pyproject.toml").stat().st_mtime))


if __name__ == "__main__":
    for name in sys.argv[1:] or _MACHINES:
        sys.stdout.write(f"{build(name).relative_to(_PROJECT)}\n")
