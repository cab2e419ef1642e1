# SPDX-License-Identifier: GPL-3.0-or-later
"""The signature of a package: only what a release's key has signed is left, byte for byte."""

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from service.cli.helper.action import HelperRefusal
from service.cli.helper.signature import add_signature, check_signature
from tests.service.cli.helper.test_packages import packed
from tests.support.release_key import ReleaseKey


@pytest.fixture
def key(tmp_path: Path) -> ReleaseKey:
    return ReleaseKey(tmp_path / "key")


def test_dpkg_accepts_a_signed_package_and_the_signature_can_be_removed(tmp_path: Path, key: ReleaseKey) -> None:
    package = packed(tmp_path)
    before = package.read_bytes()
    key.sign(package)
    subprocess.run(["dpkg-deb", "--contents", package], capture_output=True, check=True)
    package.write_bytes(package.read_bytes() + b"_naze-bridge-sag" + b"forged" * 100)
    check_signature(package, key.signers)
    assert package.read_bytes() == before


def test_a_package_without_a_signature(tmp_path: Path, key: ReleaseKey) -> None:
    with pytest.raises(HelperRefusal, match="not signed"):
        check_signature(packed(tmp_path), key.signers)


Forger = Callable[[Path, ReleaseKey, ReleaseKey], object]


def of_another_key(package: Path, _key: ReleaseKey, other: ReleaseKey) -> None:
    other.sign(package)


def of_another_purpose(package: Path, key: ReleaseKey, _other: ReleaseKey) -> None:
    add_signature(package, key.signature(package, "file"))


def of_another_package(package: Path, key: ReleaseKey, _other: ReleaseKey) -> None:
    signature = key.signature(package)
    package.write_bytes(package.read_bytes().replace(b"debian-binary", b"debian_binary"))
    add_signature(package, signature)


def signed_twice(package: Path, key: ReleaseKey, other: ReleaseKey) -> None:
    key.sign(package)
    other.sign(package)


def cut_off(package: Path, key: ReleaseKey, _other: ReleaseKey) -> None:
    key.sign(package)
    package.write_bytes(package.read_bytes()[:-100])


def without_a_body(package: Path, key: ReleaseKey, _other: ReleaseKey) -> None:
    signed = key.sign(package).read_bytes()
    package.write_bytes(signed[signed.rindex(b"_naze-bridge-sig") :])


def no_signature_at_all(package: Path, _key: ReleaseKey, _other: ReleaseKey) -> None:
    add_signature(package, b"")


@pytest.mark.parametrize(
    "forge",
    [
        *(of_another_key, of_another_purpose, of_another_package),
        *(signed_twice, cut_off, without_a_body, no_signature_at_all),
    ],
)
def test_a_forged_package_is_refused(tmp_path: Path, key: ReleaseKey, forge: Forger) -> None:
    package = packed(tmp_path)
    forge(package, key, ReleaseKey(tmp_path / "other"))
    with pytest.raises(HelperRefusal, match="signature of this package is wrong"):
        check_signature(package, key.signers)


def test_without_ssh_keygen(tmp_path: Path, key: ReleaseKey, monkeypatch: pytest.MonkeyPatch) -> None:
    package = key.sign(packed(tmp_path))
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(HelperRefusal, match="apt install openssh-client"):
        check_signature(package, key.signers)
