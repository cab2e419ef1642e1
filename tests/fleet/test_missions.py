# SPDX-License-Identifier: GPL-3.0-or-later
"""A vehicle's verdict on a mission: without one, nothing is claimed."""

import pytest

from fleet.missions import Trial


@pytest.mark.parametrize(
    ("trial", "is_accepted", "is_held"),
    [
        (Trial("kite"), None, None),
        (Trial("kite", None, 5, "1234abcd", 5, "1234abcd"), True, True),
        (Trial("kite", None, 5, "1234abcd", 4, "00000000"), True, False),
        (Trial("kite", None, 5, "1234abcd"), True, False),
        (Trial("kite", "rejected", 0, "1234abcd", 5, "1234abcd"), False, False),
    ],
)
def test_a_mission_is_held_if_it_is_taken_and_the_checksum_is_that_of_the_list(
    trial: Trial, is_accepted: bool | None, is_held: bool | None
) -> None:
    assert (trial.is_accepted, trial.is_held) == (is_accepted, is_held)
