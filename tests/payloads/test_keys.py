# SPDX-License-Identifier: GPL-3.0-or-later
"""The keys of a vehicle."""

from payloads.keys import COMMAND_KEYS, COMMANDS, KEYS, MAVLINK_IN, full, vehicle_in


def test_keys_are_unique() -> None:
    assert len({key.suffix for key in KEYS}) == len(KEYS)


def test_a_wildcard_over_telemetry_does_not_reach_a_command_or_mavlink() -> None:
    """zenoh's `**` matches no chunk that begins with @."""
    assert all(key.suffix.startswith("@") for key in (*COMMAND_KEYS, MAVLINK_IN))
    assert {key for key in KEYS if key.is_command} == set(COMMAND_KEYS)
    assert {key for key in KEYS if key.suffix.startswith(COMMANDS)} == set(COMMAND_KEYS)
    assert not any(key.is_published for key in (*COMMAND_KEYS, MAVLINK_IN))


def test_a_key_names_the_vehicle() -> None:
    assert all(vehicle_in(full("fleet", "kite", key.suffix)) == "kite" for key in KEYS)
