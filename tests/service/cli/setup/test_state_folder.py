# SPDX-License-Identifier: GPL-3.0-or-later
"""The state folder of a service that may have been taken over: nothing in it can act on root."""

import json
import os
from pathlib import Path

import pytest

from service.cli.setup.answers import SetupChoices
from service.cli.setup.state_folder import page_token
from service.cli.setup.steps import missing_steps
from tests.service.cli.setup.test_steps import FreshPi

OTHERS = "/etc/udev/rules.d/59-naze-bridge-others.rules"


PORTS = "/var/lib/naze-bridge/ports.json"


@pytest.mark.parametrize(
    "key",
    [
        'usb 1-1.3",RUN+="/bin/id 10c4:ea60',
        'usb 1-1.3 10c4:ea60",RUN+="/bin/id',
        "usb * 10c4:ea60",
        "usb 1-1.3\\ 10c4:ea60",
        "usb 1-1.3 10c4:ea6\u0663",
    ],
)
def test_a_key_that_the_bridge_does_not_make_never_reaches_udev(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], key: str
) -> None:
    """The service, which writes the file, may have been taken over; setup runs as root."""
    pi = FreshPi(tmp_path, "4")
    pi.write(PORTS, json.dumps({"others": {key: "a radio", "usb 1-1.4 10c4:ea60 ä 1": "a GPS"}}))
    pi.carry_out(missing_steps(pi, SetupChoices()))
    (rule,) = [line for line in pi.read(OTHERS).splitlines() if not line.startswith("#")]
    assert rule.startswith('SUBSYSTEM=="tty", KERNELS=="1-1.4", ')
    assert "ports.json names devices that cannot exist" in capsys.readouterr().err


def test_a_link_or_pipe_in_the_state_folder_is_not_read(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pi = FreshPi(tmp_path, "4")
    target = pi.write("/root/ports.json", '{"others": {"usb 1-1.3 10c4:ea60": "a radio"}}')
    link = pi.write(PORTS)
    link.unlink()
    link.symlink_to(target)
    missing_steps(pi, SetupChoices())
    link.unlink()
    os.mkfifo(link)
    pi.carry_out(missing_steps(pi, SetupChoices()))
    assert not pi.path(OTHERS).exists()
    assert capsys.readouterr().err.count("ports.json is ignored: ") == 2


@pytest.mark.parametrize("text", ["[" * 60_000, "[]", '{"others": [1]}', '{"others": 1}', " " * 100_000, "\x00"])
def test_a_damaged_list_of_ports_is_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str) -> None:
    pi = FreshPi(tmp_path, "4")
    pi.write(PORTS, text)
    pi.carry_out(missing_steps(pi, SetupChoices()))
    assert not pi.path(OTHERS).exists()
    assert capsys.readouterr().err.count("ports.json is ignored: ") == 1


def test_the_pages_token_is_shown_only_if_it_is_one(tmp_path: Path) -> None:
    """The service, which writes the file, may have been taken over; setup prints it on root's terminal."""
    pi = FreshPi(tmp_path, "4")
    token = pi.write("/var/lib/naze-bridge/web-token", "2345-6789-abcd\n")
    assert page_token(pi) == "2345-6789-abcd"
    token.write_text("2345\x1b[2J6789")
    assert page_token(pi) == ""
    token.unlink()
    token.symlink_to(pi.write("/root/secret", "secret"))
    assert page_token(pi) == ""
