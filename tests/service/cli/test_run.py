# SPDX-License-Identifier: GPL-3.0-or-later
"""The configuration file: accepted settings, and messages about errors."""

from pathlib import Path

import pytest

from service.settings import load_settings
from service.settings.addresses import GcsAddress, SerialFc, SimulatedFc
from tests.support.programs import run_naze_bridge


def test_flags_override_the_file(tmp_path: Path) -> None:
    config = tmp_path / "naze.toml"
    config.write_text('fc = "/dev/serial0,57600"\ngcs = ["udpin:127.0.0.1:1"]\nsysid = 7\nstate_dir = "/elsewhere"\n')
    settings = load_settings(config)
    assert settings.fc == SerialFc("/dev/serial0", 57600)
    assert settings.gcs == [GcsAddress("udpin", "127.0.0.1", 1)]
    assert (settings.sysid, settings.state_dir) == (7, Path("/elsewhere"))
    settings = load_settings(config, ["tcpin:127.0.0.1:2"], fc="sim:", state_dir=tmp_path)
    assert settings.fc == SimulatedFc()
    assert settings.gcs == [GcsAddress("tcpin", "127.0.0.1", 2)]
    assert (settings.sysid, settings.state_dir) == (7, tmp_path)


def test_a_byte_order_mark_is_accepted(tmp_path: Path) -> None:
    config = tmp_path / "naze.toml"
    config.write_bytes(b"\xef\xbb\xbfsysid = 9\r\n")
    assert load_settings(config, fc="sim:", state_dir=tmp_path).sysid == 9


WRONG = {
    "no TOML": (b"\nsysid = x", ["not valid TOML", "line 2"]),
    "no text": (b"\xff\xfes", ["not UTF-8 text"]),
    "digits without end": (b"sysid = %b" % (b"9" * 5000), ["not valid TOML"]),
    "brackets without end": (b"gcs = %b" % (b"[" * 5000), ["not valid TOML"]),
    "too large": (b"#" * ((1 << 20) + 1), ["larger than 1 MB"]),
    "a number in quotes": (b'sysid = "1"', ["sysid", "a whole number", "1..255"]),
    "not a number": (b"sysid = true", ["sysid", "a whole number"]),
    "a number out of range": (b"sysid = 300", ["sysid is 300", "1..255"]),
    "text without quotes' meaning": (b"fc = 1", ["fc", "text in quotes", "flight controller"]),
    "no list": (b'gcs = "udpin:0.0.0.0:14550"', ["gcs", "a list in brackets"]),
    "an empty list": (b"gcs = []", ["gcs is empty", "udpin:0.0.0.0:14550"]),
    "no connection": (b'fc = "ttyUSB0"', ["'ttyUSB0'", "did you mean /dev/ttyUSB0?"]),
    "no link": (b'gcs = ["serial:/dev/ttyS0"]', ["'serial:/dev/ttyS0'", "udpout:HOST:PORT"]),
    "a misspelt key": (b"sysidd = 1", ["'sysidd'", "did you mean 'sysid'?"]),
}


@pytest.mark.parametrize("name", WRONG)
def test_errors_are_reported_with_the_file(tmp_path: Path, name: str) -> None:
    text, words = WRONG[name]
    config = tmp_path / "naze.toml"
    config.write_bytes(text)
    fc = [] if b"fc =" in text else ["--fc", "sim:"]
    ended = run_naze_bridge("run", *fc, "--config", config, "--state-dir", tmp_path / "state")
    assert ended.returncode == 2
    sentence = ended.stderr.splitlines()[0]
    assert sentence.startswith(f"naze-bridge: {config}:")
    assert not [word for word in words if word not in sentence], sentence
    assert "Traceback" not in ended.stderr


@pytest.mark.parametrize(
    ("path", "words"), [("/dev/zero", "not a regular file"), ("/none", "No such file"), ("/" + 256 * "x", "too long")]
)
def test_an_unreadable_file_is_reported_in_one_sentence(tmp_path: Path, path: str, words: str) -> None:
    ended = run_naze_bridge("run", "--fc", "sim:", "--config", path, "--state-dir", tmp_path)
    assert ended.returncode == 2
    assert ended.stderr.splitlines()[0].startswith(f"naze-bridge: {path}: this cannot be read: ")
    assert words in ended.stderr
