# SPDX-License-Identifier: GPL-3.0-or-later
"""Doctor finds each injected fault and gives its remedy."""

from pathlib import Path

import pytest

from service.cli.doctor.checked import Grade
from service.cli.doctor.examination import examine
from service.settings import Settings, load_settings
from tests.support.doctor import GCS, STATUS, assert_note, assert_ok, no_answer
from tests.support.faulty_machine import PORT, FaultyMachine


@pytest.mark.parametrize(("passphrase", "is_weak"), [("q", True), ("k7mq2-x9tvb-3hndc-pw4ea", False)])
def test_a_key_that_can_be_guessed(pi: FaultyMachine, tmp_path: Path, passphrase: str, is_weak: bool) -> None:
    key, config = tmp_path / "gcs.key", tmp_path / "config.toml"
    key.write_text(passphrase)
    key.chmod(0o600)
    config.write_text(f'gcs = [{{address = "{GCS[0]}", key_file = "{key}"}}]')
    settings = load_settings(config, state_dir=tmp_path)
    (found,) = (each for each in examine(pi, settings, no_answer, lambda: STATUS) if each.check == "key")
    if is_weak:
        assert_note(found, f"the key in {key} is weak")
        assert "setup --new-key" in found.remedy
    else:
        assert_ok(found, "required")


def test_a_healthy_pi_passes(pi: FaultyMachine, tmp_path: Path) -> None:
    settings = Settings(PORT, GCS, tmp_path / "state")
    found = list(examine(pi, settings, no_answer, lambda: STATUS))
    # Only root can give a file to the group dialout.
    assert {each.check for each in found if each.grade is not Grade.OK} <= {"permission", "flight controller", "key"}
    text = " ".join(each.found for each in found)
    assert "/dev/serial0 is /dev/ttyAMA0" in text
    assert "wlan0 is 192.168.4.1; ground stations connect to port 14550" in text
    assert "Debian GNU/Linux 12" in text
