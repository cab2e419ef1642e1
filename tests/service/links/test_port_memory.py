# SPDX-License-Identifier: GPL-3.0-or-later
"""The ports are remembered across runs."""

from pathlib import Path

from service.links.port_finder import PortMemory


def test_finds_in_quick_succession_are_all_kept(tmp_path: Path) -> None:
    """Two writes at once would leave a file that cannot be read."""
    found = {f"usb 1-{number}": "a GPS receiver" for number in range(300)}
    memory = PortMemory(tmp_path)
    for key, what in found.items():
        memory.found_other(key, what)
    memory.found_flight_controller("usb 1-7")
    memory.close()
    again = PortMemory(tmp_path)
    assert again.flight_controller == "usb 1-7"
    assert again.others == {key: what for key, what in found.items() if key != "usb 1-7"}
