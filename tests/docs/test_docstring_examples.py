# SPDX-License-Identifier: GPL-3.0-or-later
"""Examples in docstrings give the results that they show."""

import doctest
from importlib import import_module

import pytest


@pytest.mark.parametrize(
    "module",
    [
        "bridge.missions.list_check",
        "bridge.model.events",
        "bridge.settings.parameter_names",
        "protocols.mavlink.codec",
        "protocols.mission_file",
        "protocols.msp.frame",
        "service.machine.own_networks",
        "service.settings.addresses",
    ],
)
def test_the_examples_are_true(module: str) -> None:
    failed, attempted = doctest.testmod(import_module(module))
    assert attempted
    assert not failed
