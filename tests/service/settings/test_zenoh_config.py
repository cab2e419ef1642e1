# SPDX-License-Identifier: GPL-3.0-or-later
"""zenoh's configuration: invalid ones are one sentence, and commands need authentication."""

import json
from pathlib import Path

import pytest

from service.settings.key import SettingsError
from service.settings.load import load_settings
from tests.support.zenoh_bench import zenoh_config

SETTINGS_THAT_END_IT = {
    "a missing configuration": ('config_file = "nothing.json5"', None, "No such file"),
    "an invalid configuration": ('config_file = "zenoh.json5"', "{mode: ", "zenoh.config_file"),
    "an unknown field": ('config_file = "zenoh.json5"', "{moode: 'peer'}", "unknown field `moode`"),
    "a device as configuration": ('config_file = "/dev/zero"', None, "not a regular file"),
    "a device as certificate": (
        'config_file = "zenoh.json5"',
        json.dumps({"transport": {"link": {"tls": {"root_ca_certificate": "/dev/zero"}}}}),
        "not a regular file",
    ),
    "no endpoint": ('connect = ["tcp/"]', None, "zenoh.connect"),
    "no port": ('connect = ["tcp/192.168.4.1"]', None, "'tcp/192.168.4.1', which is not an endpoint: write one like"),
    "commands, no login": ('listen = ["tcp/127.0.0.1:1"]\ncommands = true', None, "sessions accepted at tcp/"),
    "mavlink_in, no login": ('connect = ["tcp/127.0.0.1:1"]\nmavlink_in = true', None, "zenoh.mavlink_in is on"),
    "TLS without client certificates": (
        'config_file = "zenoh.json5"\ncommands = true',
        json.dumps({"listen": {"endpoints": ["tls/127.0.0.1:1"]}}),
        "sessions accepted at tls/",
    ),
    "a wrong confirmation": ('connect = ["tcp/127.0.0.1:1"]\ncommands = true\ncommands_without_authentication = "yes"',
                         None, "I know"),
    "commands with multicast scouting": (
        'config_file = "zenoh.json5"\ncommands = true',
        json.dumps({"scouting": {"multicast": {"enabled": True}}}),
        "multicast scouting",
    ),
    "a name with a wildcard": ('vehicle = "naze*"', None, "zenoh.vehicle is 'naze*'"),
    "a name of two chunks": ('prefix = "our/fleet"', None, "zenoh.prefix is 'our/fleet'"),
    "no name": ('vehicle = ""', None, "text in quotes (This vehicle"),
}  # fmt: skip


@pytest.mark.parametrize("name", SETTINGS_THAT_END_IT)
def test_invalid_settings_stop_the_start_with_one_sentence(tmp_path: Path, name: str) -> None:
    table, zenoh_file, reason = SETTINGS_THAT_END_IT[name]
    if zenoh_file is not None:
        (tmp_path / "zenoh.json5").write_text(zenoh_file)
    config = tmp_path / "config.toml"
    config.write_text(zenoh_config(table, vehicle=""))
    with pytest.raises(SettingsError) as caught:
        load_settings(config, fc="sim:", state_dir=tmp_path)
    (problem,) = caught.value.problems
    assert reason in problem.text
    assert "\n" not in problem.text
    assert str(config) in problem.where


@pytest.mark.parametrize("of", ["zenoh-tls", "zenoh-password"])
def test_the_examples_count_as_authentication(tmp_path: Path, of: str) -> None:
    """With authentication, "I know" is not needed."""
    example = Path(__file__).parents[3] / "examples" / of / "vehicle.json5"
    config = tmp_path / "config.toml"
    config.write_text(zenoh_config(f'config_file = "{example}"\ncommands = true\nmavlink_in = true'))
    settings = load_settings(config, fc="sim:", state_dir=tmp_path)
    assert settings.zenoh is not None
    assert (settings.zenoh.commands, settings.zenoh.mavlink_in) == (True, True)
