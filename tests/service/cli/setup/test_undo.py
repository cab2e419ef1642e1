# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge setup --undo` reverts the last setup."""

from service.cli.setup.answers import SETTINGS_FILE
from tests.support.setup_pi import Pi


def test_the_last_setup_can_be_undone(pi: Pi) -> None:
    pi.is_running()
    pi.setup("--yes", "--fc", "sim")
    before = pi.files()
    pi.ran.clear()
    assert pi.setup("--yes", "--name", "kite", "--no-page", "--new-key").exit_code == 0
    assert pi.files() != before
    pi.ran.clear()
    assert "remove /etc/naze-bridge/gcs.key" in pi.setup("--undo", "--dry-run").output
    done = pi.setup("--undo", "--yes")
    assert done.exit_code == 0, done.output
    assert pi.files() == before
    assert "systemctl try-restart naze-bridge.service" in pi.ran
    # The one before.
    pi.setup("--undo", "--yes")
    assert not (pi.root / SETTINGS_FILE.lstrip("/")).exists()
    assert "nothing to undo" in pi.setup("--undo", "--yes").output


def test_undo_keeps_a_file_that_was_changed_since(pi: Pi) -> None:
    pi.setup("--yes")
    settings = pi.root / SETTINGS_FILE.lstrip("/")
    settings.write_text("sysid = 7\n")
    done = pi.setup("--undo", "--yes")
    assert f"{SETTINGS_FILE} was changed since the last setup, and is kept" in done.output
    assert settings.read_text() == "sysid = 7\n"
