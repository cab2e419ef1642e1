# SPDX-License-Identifier: GPL-3.0-or-later
"""The conformance tests of docs/msp-mission.md on the image, through the emulated board's UART."""

import pytest

from protocols.msp.frame import Direction, request
from simulator.emulated_naze.image import Image
from tests.conformance.test_mission_extension import (  # noqa: F401  (collected here)
    OLD,
    OLDER,
    Companion,
    test_a_chunk_past_the_announced_count_is_refused,
    test_a_chunk_too_early_is_out_of_sequence,
    test_a_count_of_0_clears,
    test_a_full_list_is_pushed_read_back_and_survives_a_reset,
    test_a_power_cut_leaves_the_old_list,
    test_a_scheduled_configuration_write_makes_it_busy,
    test_a_stored_list_is_not_written_again,
    test_an_unknown_record_command_drops_the_transfer,
    test_another_begin_replaces_the_transfer,
    test_arming_drops_the_transfer_and_refuses_changes,
    test_commit_of_a_list_other_than_begun_is_a_checksum_error,
    test_commit_of_an_incomplete_list_is_incomplete,
    test_commit_of_records_other_than_announced_is_a_checksum_error,
    test_failing_flash_leaves_the_old_list,
    test_info_has_limits_and_state,
    test_malformed_requests_have_no_effect,
    test_more_records_than_the_capacity_are_refused_with_no_space,
    test_other_commands_are_left_to_the_firmware,
    test_reading_past_the_end_is_out_of_range,
    test_requests_may_be_repeated,
    test_without_a_transfer_chunks_are_refused,
)
from tests.support.c_core import PowerCut
from tests.support.real_bench import RealBench


class RealDevice:
    """The image with the interface mission_devices.Device."""

    def __init__(self, bench: RealBench) -> None:
        self._bench = bench
        self._is_busy = False

    def request(self, command: int, payload: bytes) -> bytes | None:
        frame = self._bench.ask(request(command, payload), 2.0)
        if self._bench.is_off:
            raise PowerCut
        assert frame is not None
        return frame.payload if frame.direction is Direction.REPLY else None

    def advance(self, milliseconds: int) -> None:
        self._bench.run(milliseconds / 1000)

    def arm(self, armed: bool) -> None:
        # It refuses to arm with a scheduled write.
        self._bench.hold_write(False)
        self._bench.arm(armed)
        self._bench.hold_write(self._is_busy)

    def set_busy(self, busy: bool) -> None:
        self._is_busy = busy
        self._bench.hold_write(busy)

    def power_cycle(self) -> None:
        self._bench.power_cycle()

    def cut_power_at(self, operation: int) -> None:
        self._bench.naze.faults.power_cut_at_flash_operation = operation

    def fail_at(self, operation: int) -> None:
        assert operation in (0, 1)
        self._bench.naze.faults.flash_failures = operation

    @property
    def list(self) -> bytes:
        return b"".join(self._bench.naze.stored_records)


@pytest.fixture(scope="session")
def used_flash(image: Image, flash: bytes) -> bytes:
    """Both slots in use."""
    bench = RealBench(image, flash)
    companion = Companion(RealDevice(bench))
    companion.push(OLDER)
    companion.push(OLD)
    bench.naze.power_off(bench.now)
    return bytes(bench.flash)


@pytest.fixture
def fc(image: Image, used_flash: bytes) -> Companion:
    return Companion(RealDevice(RealBench(image, used_flash)))
