# SPDX-License-Identifier: GPL-3.0-or-later
"""Fixtures of the example fleets with authentication, for `pytest_plugins`."""

from collections.abc import Iterator
from contextlib import ExitStack

import pytest

from tests.support.secured_fleet import Fleet, password_fleet, tls_fleet


@pytest.fixture(scope="module")
def fleet_stack() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


@pytest.fixture(scope="module")
def tls(tmp_path_factory: pytest.TempPathFactory, fleet_stack: ExitStack) -> Fleet:
    return tls_fleet(tmp_path_factory.mktemp("tls"), fleet_stack)


@pytest.fixture(scope="module")
def passwords(tmp_path_factory: pytest.TempPathFactory, fleet_stack: ExitStack) -> Fleet:
    return password_fleet(tmp_path_factory.mktemp("passwords"), fleet_stack)


@pytest.fixture(params=["tls", "passwords"])
def secured(request: pytest.FixtureRequest) -> Fleet:
    """A fleet of each of the two examples, shared by the tests of a module."""
    found: Fleet = request.getfixturevalue(request.param)
    return found
