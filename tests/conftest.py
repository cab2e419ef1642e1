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

#: These wait for other programs. They start first, or one of them would run alone at the end (make test).
_LONG = ("tests/service/test_debian_package", "tests/web", "tests/fleet", "tests/e2e", "tests/cli", "tests/attack")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Sort the files by `_LONG`; the order within a file stays."""
    items.sort(key=lambda item: next((at for at, long in enumerate(_LONG) if item.nodeid.startswith(long)), len(_LONG)))
