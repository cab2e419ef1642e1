# SPDX-License-Identifier: GPL-3.0-or-later
"""The table form of a `gcs` setting, and the key file: accepted forms, and messages about others."""

import os
from pathlib import Path

import pytest

from bridge.gcs.station import Peer
from protocols.mavlink.signing import key_from_passphrase
from service.settings import SettingsError, load_settings
from service.settings.addresses import AddressError
from service.settings.write_access import WriteAccess, read_passphrase

WORDS = "correct horse"
LINK = "udpin:0.0.0.0:14550"


@pytest.fixture
def key_file(tmp_path: Path) -> Path:
    path = tmp_path / "gcs.key"
    path.write_text(WORDS + "\n")
    path.chmod(0o600)
    return path


def access(tmp_path: Path, gcs: str, *flags: str) -> dict[str, WriteAccess]:
    config = tmp_path / "naze-bridge.toml"
    config.write_text(f'fc = "sim:"\ngcs = [{gcs}]\n')
    return dict(load_settings(config, flags, state_dir=tmp_path).access)


def complaint(tmp_path: Path, gcs: str) -> str:
    with pytest.raises(SettingsError) as caught:
        access(tmp_path, gcs)
    text = str(caught.value)
    assert "\n" not in text
    assert WORDS not in text
    return text


def test_one_list_may_have_strings_and_tables(tmp_path: Path, key_file: Path) -> None:
    config = tmp_path / "naze-bridge.toml"
    table = f'{{address = "{LINK}", key_file = "{key_file}", writers = ["192.168.4.0/24", "::1"]}}'
    config.write_text(f'fc = "sim:"\ngcs = ["tcpin:127.0.0.1:5760", {table}]\n')
    settings = load_settings(config, state_dir=tmp_path)
    assert [str(address) for address in settings.gcs] == ["tcpin:127.0.0.1:5760", LINK]
    (found,) = settings.access.items()
    assert found[0] == LINK
    assert found[1].key == key_from_passphrase(WORDS)
    assert [str(network) for network in found[1].writers or ()] == ["192.168.4.0/24", "::1/128"]
    assert str(found[1].key) not in repr(settings)


def test_a_key_file_path_is_relative_to_the_configuration(tmp_path: Path, key_file: Path) -> None:
    found = access(tmp_path, f'{{address = "{LINK}", key_file = "{key_file.name}"}}')
    assert found[LINK].key == key_from_passphrase(WORDS)


def test_a_flag_does_not_open_a_link_protected_in_the_file(tmp_path: Path, key_file: Path) -> None:
    table = f'{{address = "{LINK}", key_file = "{key_file}"}}'
    assert access(tmp_path, table, LINK, "tcpin:0.0.0.0:5760")[LINK].key is not None


def test_a_table_with_only_an_address_is_open(tmp_path: Path) -> None:
    assert access(tmp_path, f'{{address = "{LINK}"}}') == {}


@pytest.mark.parametrize(
    ("host", "may"),
    [
        ("192.168.4.7", True),
        ("192.168.5.7", False),
        ("::ffff:192.168.4.7", True),
        ("::ffff:192.168.5.7", False),
        ("fe80::1", True),
        ("fe80::1%wlan0", True),
        ("::1", False),
    ],
)
def test_only_listed_addresses_may_write(tmp_path: Path, host: str, may: bool) -> None:
    found = access(tmp_path, f'{{address = "{LINK}", writers = ["192.168.4.0/24", "fe80::/64"]}}')
    assert found[LINK].has_address(Peer(LINK, (host, 14550))) is may


def test_an_empty_list_of_writers_refuses_every_address(tmp_path: Path) -> None:
    found = access(tmp_path, f'{{address = "{LINK}", writers = []}}')
    assert not found[LINK].has_address(Peer(LINK, ("127.0.0.1", 1)))


@pytest.mark.parametrize(
    ("entry", "reason"),
    [
        ("7", "is not a table with address"),
        ("{}", "is not a table with address"),
        ("{address = 7}", "is not a table with address"),
        ('{address = "radio:x"}', "is not a ground station connection"),
        (
            f'{{address = "{LINK}", keyfile = "k"}}',
            "'keyfile' is not a setting of this table; there are",
        ),
        (f'{{address = "{LINK}", key_file = 7}}', "key_file must be the name of a file"),
        (f'{{address = "{LINK}", key_file = ""}}', "key_file must be the name of a file"),
        (f'{{address = "{LINK}", key_file = "none"}}', "cannot be read: No such file"),
        (f'{{address = "{LINK}", key_file = "."}}', "cannot be read: Is a directory"),
        (f'{{address = "{LINK}", writers = "192.168.4.0/24"}}', "writers must be a list"),
        (f'{{address = "{LINK}", writers = ["192.168.4.7/24"]}}', "has host bits set; write 192.168.4.0/24"),
        (f'{{address = "{LINK}", writers = ["laptop"]}}', "write 192.168.4.0/24"),
    ],
)
def test_an_invalid_table_is_reported_in_one_sentence(tmp_path: Path, entry: str, reason: str) -> None:
    assert reason in complaint(tmp_path, entry)


@pytest.mark.parametrize("mode", [0o604, 0o602, 0o644, 0o777])
def test_a_key_file_readable_by_others_is_refused(key_file: Path, mode: int) -> None:
    key_file.chmod(mode)
    with pytest.raises(AddressError, match="is readable by other users; run chmod 600"):
        read_passphrase(key_file)


@pytest.mark.parametrize(
    ("content", "passphrase"),
    [(b"plain", "plain"), (b"with spaces \n", "with spaces "), (b"dos\r\n", "dos"), ("Grüße\n".encode(), "Grüße")],
)
def test_the_passphrase_is_the_line_without_the_end(key_file: Path, content: bytes, passphrase: str) -> None:
    key_file.write_bytes(content)
    assert read_passphrase(key_file) == passphrase


@pytest.mark.parametrize("content", [b"", b"\n", b"two\nlines\n", b"x" * 5000])
def test_a_passphrase_is_one_line_of_text(key_file: Path, content: bytes) -> None:
    key_file.write_bytes(content)
    with pytest.raises(AddressError, match="must contain one line of text"):
        read_passphrase(key_file)


def test_a_binary_key_file_is_refused(key_file: Path) -> None:
    key_file.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(AddressError, match="must contain one line") as caught:
        read_passphrase(key_file)
    assert caught.value.__cause__ is None


def test_a_fifo_does_not_block(tmp_path: Path) -> None:
    fifo = tmp_path / "fifo"
    os.mkfifo(fifo, 0o600)
    with pytest.raises(AddressError, match="not a regular file"):
        read_passphrase(fifo)
