# SPDX-License-Identifier: GPL-3.0-or-later
"""For all tests."""

import signal

import pytest
from hypothesis import settings

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # A shell starts its background jobs so, and programs started by tests would inherit it.
    signal.signal(signal.SIGINT, signal.default_int_handler)

# Elapsed time is never judged: the machine may be busy with something else.
settings.register_profile("unhurried", deadline=None)
settings.load_profile("unhurried")

#: The longest files, and those that wait for other programs. They start first, or one of them would run alone at the
#: end (make test).
_LONG = (
    "tests/firmware/test_firmware_core",
    "tests/service/test_debian_package",
    "tests/e2e/test_soak",
    "tests/e2e/test_mission_planner",
    "tests/e2e/test_mavproxy",
    "tests/e2e/test_board_faults",
    "tests/e2e/test_bad_start",
    "tests/fleet/test_fleet_faults",
    "tests/cli/test_direct_boards",
    "tests/conformance",
    "tests/web",
    "tests/fleet",
    "tests/e2e",
    "tests/attack",
    "tests/cli",
    "tests/links",
    "tests/firmware",
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Sort the files by `_LONG`; the order within a file stays."""
    items.sort(key=lambda item: next((at for at, long in enumerate(_LONG) if item.nodeid.startswith(long)), len(_LONG)))
