# SPDX-License-Identifier: GPL-3.0-or-later
"""One port used twice is an error."""

from pathlib import Path

import pytest

from service.settings import SettingsError, load_settings
from tests.service.settings.test_load import load, problems


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('gcs = ["udpin:0.0.0.0:14550", "udpin:127.0.0.1:14550"]', "would both listen on UDP port 14550"),
        ('gcs = ["tcpin:[::]:5760", "tcpin:[::]:5760"]', "would both listen on TCP port 5760"),
        (
            'gcs = ["tcpin:0.0.0.0:5760"]\nshare = [{address = "tcpin:127.0.0.1:5760"}]',
            "gcs tcpin:0.0.0.0:5760 and share tcpin:127.0.0.1:5760 would both listen on TCP port 5760",
        ),
        ('gcs = ["tcpin:0.0.0.0:7447"]\n[zenoh]\nlisten = ["tcp/0.0.0.0:7447"]', "zenoh.listen tcp/0.0.0.0:7447"),
        ('gcs = ["udpin:0.0.0.0:7447"]\n[zenoh]\nlisten = ["quic/0.0.0.0:7447"]', "UDP port 7447: change one"),
        ('gcs = ["udpout:10.0.0.1:9", "tcpin:[::]:5", "udpout:10.0.0.1:9"]', "is listed 2 times: remove the others"),
    ],
)
def test_one_port_used_twice_is_an_error(folder: Path, text: str, words: str) -> None:
    (found,) = problems(folder, text)
    assert found.startswith("naze.toml:1: ")
    assert words in found


@pytest.mark.parametrize(
    "text",
    [
        'gcs = ["udpin:0.0.0.0:14550", "tcpin:0.0.0.0:14550"]',
        'gcs = ["udpin:127.0.0.1:14550", "udpin:127.0.0.2:14550"]',
        'gcs = ["udpin:0.0.0.0:14550", "udpin:[::]:14550"]',
        'gcs = ["udpout:127.0.0.1:14550", "udpin:0.0.0.0:14550"]',
    ],
)
def test_ports_that_do_not_conflict_are_accepted(folder: Path, text: str) -> None:
    assert len(load(folder, text).gcs) == 2


@pytest.mark.parametrize(
    ("fc", "more", "words"),
    [
        ("tcp:127.0.0.1:5760", 'gcs = ["tcpin:0.0.0.0:5760"]', "would connect to itself"),
        ("tcp:localhost:5760", 'gcs = ["tcpin:0.0.0.0:5760"]', "would connect to itself"),
        ("tcp:127.0.0.1:8080", "[web]", "fc tcp:127.0.0.1:8080 is web.listen 127.0.0.1:8080"),
        ("/dev/ttyUSB0,57600", 'record_uart = "/dev/ttyUSB0"', "is the flight controller's port: name a file"),
    ],
)
def test_a_flight_controller_port_with_another_use_is_an_error(folder: Path, fc: str, more: str, words: str) -> None:
    config = folder / "naze.toml"
    config.write_text(f'fc = "{fc}"\n{more}')
    with pytest.raises(SettingsError) as caught:
        load_settings(config, None, (), folder)
    (problem,) = caught.value.problems
    assert words in str(problem)


def test_the_same_port_number_on_another_host_is_accepted(folder: Path) -> None:
    config = folder / "naze.toml"
    config.write_text('fc = "tcp:192.168.4.9:5760"\ngcs = ["tcpin:0.0.0.0:5760"]')
    assert str(load_settings(config, None, (), folder).fc) == "tcp:192.168.4.9:5760"
