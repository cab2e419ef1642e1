# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings of a Harakiri that answers only MAVLink: shown when a client asks, never changed."""

import math
from collections.abc import Iterable
from itertools import pairwise

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from bridge.controllers.harakiri import profile as harakiri
from bridge.controllers.harakiri.mavlink_settings import HarakiriMavlinkSettings
from bridge.fc.fc_settings import NO_ANSWER, Cause, SettingRefusal
from bridge.model.settings import SettingTable
from protocols.mavlink.dialect import Message
from protocols.mavlink.frame import MavlinkSplitter
from protocols.mission_item import MissionResult
from simulator.board.options import Faults, SimOptions, TelemetryProtocol
from simulator.naze.board import SimulatedNaze
from simulator.naze.setting_table import SETTINGS
from tests.bridge.controllers.harakiri.test_mavlink_missions import mavlink_only
from tests.support.conversations import Upload, waypoints
from tests.support.settings_client import SettingsClient, cause_of
from tests.support.world import GroundStation, World

#: The bridge's own parameters on a board without a radius.
OWN = 35
ALL = OWN + len(SETTINGS)
LIST_S = 30.0
ALIKE = {held.setting.name for held in SETTINGS if held.setting.name.startswith("LED_Toggle_Delay")}


class DeafNaze(SimulatedNaze):
    """It does not hear requests for its parameters, or does not send some of them."""

    def __init__(self, *unsent: int) -> None:
        super().__init__(SimOptions(), Faults(extension=False, msp=False))
        self._unsent = unsent

    def _hear(self, data: bytes, now: float) -> None:
        if self._unsent or not is_sent([data], m.MAVLINK_MSG_ID_PARAM_REQUEST_LIST):
            super()._hear(data, now)

    def _take_sent(self, now: float) -> bytes:
        sent = super()._take_sent(now)
        for frame in MavlinkSplitter().feed(sent):
            if frame.msgid == m.MAVLINK_MSG_ID_PARAM_VALUE and int.from_bytes(frame.payload[6:8], "little") in (
                self._unsent
            ):
                sent = sent.replace(frame.raw, b"")
        return sent


def is_sent(written: Iterable[bytes], msgid: int) -> bool:
    return any(frame.msgid == msgid for data in written for frame in MavlinkSplitter().feed(data))


def lists_requested(world: World, since: float = 0.0) -> int:
    wanted = (data for at, _, data in world.written if at >= since)
    return sum(is_sent([data], m.MAVLINK_MSG_ID_PARAM_REQUEST_LIST) for data in wanted)


def found(board: SimulatedNaze) -> tuple[World, GroundStation]:
    world = World(peer=board, faults=board.faults, speeds=(115200,))
    world.wait_until(lambda w: w.kind is harakiri.MAVLINK and w.bridge.vehicle.armed is False, 10)
    world.wait_until(lambda w: not w.bridge.is_busy, 10)
    return world, GroundStation(world)


def ask(station: GroundStation, world: World) -> list[Message]:
    """The PARAM_VALUEs after a request for the list."""
    station.take()
    station.send(m.MAVLink_param_request_list_message(1, 1))
    world.run(LIST_S)
    return station.messages("PARAM_VALUE")


def test_all_settings_are_parameters_under_the_names_that_they_have_over_msp() -> None:
    world, station = mavlink_only()
    values = ask(station, world)
    shown = {value.param_id: value.param_value for value in values if value.param_count == ALL}
    assert len(shown) == ALL
    over_msp = World(speeds=(115200,))
    over_msp.wait_until(lambda w: w.is_found, 20)
    SettingsClient(over_msp).wait_read()
    names = {value.param_id for value in ask(GroundStation(over_msp), over_msp)}
    assert shown.keys() <= names
    held = {each.setting.name: each.value for each in SETTINGS}
    table = SettingsClient(world).wait_read()
    assert table.is_complete
    assert {each.name: each.value for each in table} == pytest.approx(held)
    world.assert_line_was_clean()


def test_the_board_is_asked_only_when_a_client_asks() -> None:
    world, station = mavlink_only()
    station.stay_connected()
    world.run(60)
    assert lists_requested(world) == 0
    ask(station, world)
    assert lists_requested(world) == 1
    world.run(60)
    assert lists_requested(world) == 1


def test_a_parameter_read_by_name_and_the_file_of_all_make_it_ask() -> None:
    path = b"@PARAM/param.pck"
    opening = bytes((0, 0, 0, 4, len(path), *bytes(7))) + path
    for request in (
        m.MAVLink_param_request_read_message(1, 1, b"p_roll", -1),
        m.MAVLink_file_transfer_protocol_message(0, 1, 1, opening.ljust(251, b"\0")),
    ):
        world, station = mavlink_only()
        station.send(request)
        world.run(LIST_S)
        assert lists_requested(world) == 1
        station.take()
        station.send(m.MAVLink_param_request_read_message(1, 1, b"p_roll", -1))
        world.run(0.5)
        assert [value.param_value for value in station.messages("PARAM_VALUE")] == [35]


def test_telemetry_keeps_four_fifths_of_its_rate_meanwhile() -> None:
    world, station = mavlink_only()
    station.stay_connected()
    station.send(m.MAVLink_request_data_stream_message(1, 1, m.MAV_DATA_STREAM_EXTRA1, 50, 1))
    # Another message of its own protocol, so that it sends its telemetry at all.
    world.bridge.missions.pull(lambda _held: None, world.now)
    world.run(1)
    station.send(m.MAVLink_param_request_list_message(1, 1))
    world.run(4)
    station.take()
    world.run(15)
    attitudes = station.messages("ATTITUDE")
    # 28.5 a second without a list.
    assert len(attitudes) >= 0.8 * 28.5 * 15
    assert max(b.time_boot_ms - a.time_boot_ms for a, b in pairwise(attitudes)) < 200


@pytest.mark.parametrize("rate", [3e-4, 1e-3])
def test_missing_ones_are_requested_again(rate: float) -> None:
    world, _ = mavlink_only()
    client = SettingsClient(world)
    world.faults.lost_byte_rate = rate
    client.current()
    world.run_until(lambda _: client.is_idle, 150)
    assert client.wait_read(0.1).is_complete
    assert 1 < lists_requested(world) <= 5


def test_a_board_that_never_sends_some_shows_the_others_under_their_right_names() -> None:
    index = [held.setting.name for held in SETTINGS].index("LED_Toggle_Delay2")
    world, _ = found(DeafNaze(index, 3))
    client = SettingsClient(world)
    client.current()
    world.run_until(lambda _: client.is_idle, 200)
    table = client.wait_read(0.1)
    assert not table.is_complete
    missing = {*ALIKE, SETTINGS[3].setting.name}
    assert {each.name for each in table} == {held.setting.name for held in SETTINGS} - missing
    assert lists_requested(world) == 5


def test_a_board_that_does_not_answer_is_reported_in_one_sentence_and_left_alone() -> None:
    world, station = found(DeafNaze())
    values = ask(station, world)
    assert {value.param_count for value in values} == {OWN}
    assert len(values) == OWN
    assert " ".join(station.texts()) == NO_ANSWER.text
    assert lists_requested(world) == 2
    result = SettingsClient(world).current()
    assert result == NO_ANSWER


def test_a_change_is_refused_with_the_reason_and_nothing_is_sent() -> None:
    world, station = mavlink_only()
    client = SettingsClient(world)
    client.current()
    before = len(world.written)
    for name, value in (("p_roll", 44), ("gbl_flg", 3), ("align_mag_x", 1)):
        result = client.change(name, value)
        assert cause_of(result) is Cause.FIXED
        assert isinstance(result, SettingRefusal)
        assert result.text.endswith(HarakiriMavlinkSettings.read_only)
    assert cause_of(client.save()) is Cause.FIXED
    station.take()
    station.send(m.MAVLink_param_set_message(1, 1, b"p_roll", 44, 9))
    world.run(1)
    (error,) = station.messages("PARAM_ERROR")
    assert error.error == m.MAV_PARAM_ERROR_READ_ONLY
    assert [value.param_value for value in station.messages("PARAM_VALUE")] == [35]
    assert "P_ROLL stays 35: a change over its own MAVLink" in station.texts()[0]
    station.send(m.MAVLink_param_set_message(1, 1, b"p_roll", 35, 9))
    world.run(1)
    assert not is_sent((data for _, _, data in world.written[before:]), m.MAVLINK_MSG_ID_PARAM_SET)


def armable() -> tuple[World, GroundStation]:
    """A board that speaks MAVLink while armed, too."""
    return found(SimulatedNaze(SimOptions(tele_prot=TelemetryProtocol.MAVLINK), Faults(extension=False, msp=False)))


def test_armed_it_is_not_asked() -> None:
    world, station = armable()
    world.faults.armed = True
    world.wait_until(lambda w: w.bridge.vehicle.armed is True, 10)
    assert {value.param_count for value in ask(station, world)} == {OWN}
    assert lists_requested(world) == 0


def test_arming_ends_the_reading() -> None:
    world, station = armable()
    station.send(m.MAVLink_param_request_list_message(1, 1))
    world.run(8)
    assert not SettingsClient(world).is_idle
    world.faults.armed = True
    world.wait_until(lambda w: w.bridge.vehicle.armed is True, 10)
    world.run(2)
    assert SettingsClient(world).is_idle
    since = world.now
    world.run(60)
    assert lists_requested(world, since) == 0


def test_a_mission_interrupts_the_list_which_is_completed_after_it() -> None:
    world, station = mavlink_only()
    station.send(m.MAVLink_param_request_list_message(1, 1))
    world.run(8)
    began = world.now
    assert Upload(station, waypoints(20)).run() is MissionResult.ACCEPTED
    assert world.now - began < 8
    world.run(40)
    assert SettingsClient(world).wait_read(0.1).is_complete


def test_a_board_that_has_just_disarmed_is_not_kept_from_msp() -> None:
    faults = Faults()
    world = World(SimOptions(tele_prot=TelemetryProtocol.MAVLINK), faults, speeds=(115200,))
    world.wait_until(lambda w: w.is_found, 20)
    client, station = SettingsClient(world), GroundStation(world)
    client.wait_read()
    faults.armed = True
    world.wait_until(lambda w: w.kind is harakiri.MAVLINK and w.bridge.vehicle.armed is True, 20)
    world.run(30)
    faults.armed = False
    world.wait_until(lambda w: w.bridge.vehicle.armed is False, 5)
    station.send(m.MAVLink_param_request_list_message(1, 1))
    world.wait_until(lambda w: w.kind is harakiri.PATCHED, 5)
    assert lists_requested(world) == 0


@pytest.mark.parametrize(
    ("name", "value", "count", "index"),
    [
        ("rc_db", math.nan, 186, 0), ("rc_db", math.inf, 186, 0), ("\xff", 1.0, 186, 0), ("rc_db", 1.0, 186, 900),
        ("", 1.0, 0, 0),
    ],
)  # fmt: skip
def test_impossible_values_are_not_shown(name: str, value: float, count: int, index: int) -> None:
    """Intact frames of a faulty board."""
    world, station = mavlink_only()
    message = m.MAVLink_param_value_message(name.encode("latin-1"), value, 9, count, index)
    frame = bytes(message.pack(m.MAVLink(None, srcSystem=1, srcComponent=200), force_mavlink1=True))
    station.send(m.MAVLink_param_request_list_message(1, 1))
    end = world.now + 60
    while world.now < end:
        world.run(0.2)
        world.receive_from_fc(frame)
    table = world.inside.board_settings.known.table
    assert isinstance(table, SettingTable)
    assert all(math.isfinite(float(each.value)) for each in table)
    assert len(table) >= 185
    assert not world.events("fc.lost")
