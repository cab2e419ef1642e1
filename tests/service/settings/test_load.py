# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings from files and flags, and messages about invalid ones."""

import os
from pathlib import Path

import pytest

from service.settings import Settings, SettingsError, load_settings
from tests.support.programs import run_naze_bridge


def load(folder: Path, text: str, setup: str | None = None) -> Settings:
    config = folder / "naze.toml"
    config.write_text(text)
    if setup is not None:
        (folder / "setup.toml").write_text(setup)
    return load_settings(config, fc="sim:", state_dir=folder)


def problems(folder: Path, text: str, setup: str | None = None) -> list[str]:
    with pytest.raises(SettingsError) as caught:
        load(folder, text, setup)
    return [str(problem).removeprefix(f"{folder}/") for problem in caught.value.problems]


def test_the_file_overrides_the_answers_to_setup_key_by_key(folder: Path) -> None:
    settings = load(folder, "sysid = 2\n[zenoh]\nvehicle = 'two'", setup="sysid = 3\nlog_level = 'debug'\nfc = 'auto'")
    assert (settings.sysid, settings.log_level) == (2, "debug")
    assert settings.zenoh is not None
    assert settings.zenoh.vehicle == "two"


def test_flags_override_the_file(folder: Path) -> None:
    settings = load(folder, "fc = '/dev/ttyUSB7'")
    assert str(settings.fc) == "sim:"


def test_all_errors_are_reported_at_once_with_their_lines(folder: Path) -> None:
    text = """
# a comment
sysid = 300
gcs = [
    "udpin:0.0.0.0:14550",
    "tcpin:0.0.0.0",
]
takeof_max_m = 15
[zenoh]
vehicle = "a/b"
prefixes = "fleet"
"""
    lines = problems(folder, text, setup="tlog_total_mb = 'all'")
    wanted = [
        "naze.toml:8: 'takeof_max_m' is not a setting; did you mean 'takeoff_max_m'?",
        "naze.toml:11: 'zenoh.prefixes' is not a setting; did you mean 'zenoh.prefix'?",
        "naze.toml:4: 'tcpin:0.0.0.0' needs a host and a port; use udpin:0.0.0.0:14550",
        "setup.toml:1: tlog_total_mb is 'all', but must be a whole number, 2..1048576 (Size",
        "naze.toml:3: sysid is 300, but must be 1..255 (MAVLink system id of the vehicle",
        "naze.toml:10: zenoh.vehicle is 'a/b': use at most 64 letters, digits and dashes",
    ]
    assert [line[: len(words)] for line, words in zip(lines, wanted, strict=True)] == wanted


def test_a_value_in_place_of_a_table_is_an_error(folder: Path) -> None:
    assert problems(folder, "zenoh = true") == ["naze.toml:1: zenoh must be a table: begin it with [zenoh]"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('"zenoh.prefix" = "x"', """'"zenoh.prefix"' is not a setting; did you mean 'zenoh.prefix'?"""),
        ("sysid = 0x" + "f" * 8000, "sysid is far too large, but must be 1..255"),
        (f'log_level = "{"x" * 100_000}"', "xxx', but must be "),
        ("x" * 100_000 + " = 1", "xxx' is not a setting"),
    ],
)
def test_odd_values_give_one_sentence(folder: Path, text: str, words: str) -> None:
    (found,) = problems(folder, text)
    assert words in found
    assert found.isprintable()


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"fc = auto", "this is not valid TOML (text needs quotes, a list brackets): Invalid value (at line 1"),
        (b"\xff\xfef\0c\0", "this is not UTF-8 text: save it with that encoding"),
        (b"a = " + b"[" * 5000, "this is not valid TOML"),
        (b"#" * (2 << 20), "this cannot be read: it is larger than 1 MB"),
    ],
)
def test_a_file_that_is_not_a_configuration_is_an_error(folder: Path, content: bytes, words: str) -> None:
    (folder / "setup.toml").write_bytes(content)
    (found,) = problems(folder, "")
    assert found.startswith(f"setup.toml: {words}")


def test_a_pipe_is_an_error(folder: Path) -> None:
    os.mkfifo(folder / "setup.toml")
    assert problems(folder, "") == ["setup.toml: this cannot be read: it is not a regular file"]


def test_check_config_reports_success_or_errors(folder: Path) -> None:
    config = folder / "naze.toml"
    config.write_text('fc = "/dev/serial0"')
    ended = run_naze_bridge("run", "--check-config", "--config", config)
    assert (ended.returncode, ended.stdout) == (0, "The settings are valid.\n")
    config.write_text('fc = "/dev/serial0"\nsysid = 0\ntlog_total_mb = 0\n')
    ended = run_naze_bridge("run", "--check-config", "--config", config)
    assert ended.returncode == 2
    assert f"{config}:2: sysid is 0" in ended.stderr
    assert f"{config}:3: tlog_total_mb is 0" in ended.stderr
    assert not (folder / "missions.db").exists()


def test_a_link_that_is_listed_twice_is_one_link(folder: Path) -> None:
    settings = load(folder, 'gcs = ["udpout:10.0.0.1:9", "tcpin:[::]:5", "udpout:10.0.0.1:9"]')
    assert [str(address) for address in settings.gcs] == ["udpout:10.0.0.1:9", "tcpin:[::]:5"]
