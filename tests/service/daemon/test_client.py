# SPDX-License-Identifier: GPL-3.0-or-later
"""A client of the control socket finds the service."""

from pathlib import Path

import pytest

from tests.support.benches import Starter
from tests.support.programs import run_naze_bridge, until


def test_the_command_line_finds_the_service(start: Starter, tmp_path: Path) -> None:
    """Users cannot read systemd's state directory; the socket is in the runtime directory."""
    runtime = tmp_path / "run"
    runtime.mkdir()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RUNTIME_DIRECTORY", str(runtime))
        daemon = start.daemon("sim:")
        patch.setenv("XDG_STATE_HOME", str(tmp_path / "a home without a daemon"))
        until(lambda: run_naze_bridge("status").returncode == 0, "a reply to the status request")
    assert not (daemon.state_dir / "control.sock").exists()
