# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge fleet` lists its commands."""

from tests.support.programs import run_naze_bridge


def test_help_lists_every_command() -> None:
    result = run_naze_bridge("fleet", "--help").stdout
    assert [name for name in ("list", "watch", "push", "pull") if f"  {name} " not in result] == []
