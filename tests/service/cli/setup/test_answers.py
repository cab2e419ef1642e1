# SPDX-License-Identifier: GPL-3.0-or-later
"""The answers to setup: kept until the next one, and warned of where another file overrides them."""

from pathlib import Path

from service.cli.setup.answers import KEY_FILE
from service.settings import load_settings
from tests.support.setup_pi import Pi


def test_earlier_answers_are_kept_and_an_option_changes_one(pi: Pi) -> None:
    assert pi.setup("--yes", "--no-page", "--fc", "/dev/ttyUSB0,57600").exit_code == 0
    assert pi.setup("--yes", "--name", "kite").exit_code == 0
    assert pi.settings() == {"fc": "/dev/ttyUSB0,57600"}
    assert pi.setup("--yes", "--page").exit_code == 0
    assert pi.settings() == {"fc": "/dev/ttyUSB0,57600", "web": {"listen": "0.0.0.0:8080"}}
    assert pi.setup("--yes", "--fc", "auto").exit_code == 0
    assert pi.settings() == {"web": {"listen": "0.0.0.0:8080"}}


def test_a_key_leaves_the_configured_links_as_they_are(pi: Pi, tmp_path: Path) -> None:
    config = pi.root / "etc/naze-bridge/config.toml"
    config.parent.mkdir(parents=True)
    config.write_text('gcs = ["udpin:0.0.0.0:14550", "tcpin:0.0.0.0:5760"]\n')
    pi.setup("--yes", "--new-key")
    # Only in this test the key is elsewhere.
    answers = config.parent / "setup.toml"
    answers.write_text(answers.read_text().replace(KEY_FILE, str(pi.key_file)))
    settings = load_settings(config, state_dir=tmp_path)
    assert [str(link) for link in settings.gcs] == ["udpin:0.0.0.0:14550", "tcpin:0.0.0.0:5760"]
    assert all(settings.access[str(link)].key is not None for link in settings.gcs)


def test_an_answer_that_another_file_overrides_is_warned_of(pi: Pi) -> None:
    file = pi.root / "etc/naze-bridge/config.toml"
    file.parent.mkdir(parents=True)
    file.write_text('sysid = 2\nfc = "/dev/ttyAMA0"\n[web]\n')
    done = pi.setup("--yes", "--fc", "sim", "--no-page")
    assert "warning: /etc/naze-bridge/config.toml:2 sets fc, which overrides the answer" in done.output
    assert "/etc/naze-bridge/config.toml:3 sets web, which" in done.output
    assert "overrides" not in pi.setup("--yes", "--fc", "auto", "--page").output
