# SPDX-License-Identifier: GPL-3.0-or-later
"""The clock of a Raspberry Pi."""

from pathlib import Path

import pytest

from service.machine.host import Host
from service.machine.raspberry_pi import is_clock_set

MODEL, SYNCHRONIZED = "proc/device-tree/model", "run/systemd/timesync/synchronized"


@pytest.mark.parametrize(
    ("files", "expected"),
    [
        ({MODEL: "Raspberry Pi Zero 2 W Rev 1.0\0"}, False),
        ({MODEL: "Raspberry Pi Zero 2 W Rev 1.0\0", SYNCHRONIZED: ""}, True),
        ({}, True),  # other machines have a battery for it
    ],
)
def test_a_pis_clock_is_set_only_by_a_network(tmp_path: Path, files: dict[str, str], expected: bool) -> None:
    for name, content in files.items():
        (tmp_path / name).parent.mkdir(parents=True)
        (tmp_path / name).write_text(content)
    assert is_clock_set(Host(tmp_path)) is expected
