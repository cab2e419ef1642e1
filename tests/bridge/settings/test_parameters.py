# SPDX-License-Identifier: GPL-3.0-or-later
"""Parameters: true, and set on the flight controller before they are confirmed."""

import gc
import math
import struct

import pytest

from bridge.fc.fc_settings import ARMED, NO_ANSWER
from bridge.model.settings import ValueKind
from protocols.mavlink.dialect import Message
from protocols.msp.setting_table import SettingCommand
from simulator.board.options import Faults, SimOptions, TelemetryProtocol
from simulator.commands.fc_kinds import make_board
from simulator.naze.setting_table import SETTINGS
from tests.bridge.vehicle.test_commands import answers, m
from tests.support.screens import Screens
from tests.support.settings_client import SettingsClient, restart
from tests.support.world import GroundStation, World, ready_world

#: The bridge's own parameters for a patched Harakiri; for other boards one less.
OWN = 36
#: All, with its settings and modes.
ALL = OWN + len(SETTINGS) + 15


def param_set(name: bytes, value: float) -> Message:
    return m.MAVLink_param_set_message(1, 1, name, value, 9)


def values(received: list[Message]) -> list[tuple[str, float, int]]:
    return [
        (message.param_id, message.param_value, message.param_index)
        for message in received
        if message.get_type() == "PARAM_VALUE"
    ]


def radius_world() -> tuple[World, GroundStation]:
    world = ready_world()
    SettingsClient(world).wait_read()
    return world, GroundStation(world)


def parameter_list(world: World, station: GroundStation) -> list[Message]:
    """All PARAM_VALUEs after a request for the list."""
    station.ask(m.MAVLink_param_request_list_message(1, 1))

    def is_whole(_: World) -> bool:
        return any(each.param_index == each.param_count - 1 for each in station.messages("PARAM_VALUE"))

    world.wait_until(is_whole, 10)
    return station.messages("PARAM_VALUE")


def test_the_list_has_the_bridges_own_parameters_and_all_settings_of_the_board(
    flying: tuple[World, GroundStation],
) -> None:
    received = parameter_list(*flying)
    found = values(received)
    assert found[0] == ("SYSID_THISMAV", 1.0, 0)
    assert found[OWN - 1] == ("WPNAV_RADIUS", 200.0, OWN - 1)
    assert [index for _, _, index in found] == list(range(ALL))
    assert {(message.param_type, message.param_count) for message in received} == {(9, ALL)}
    assert len({message.param_id for message in received}) == ALL
    held = {each.setting.name: each.value for each in SETTINGS}
    shown = {name: value for name, value, _ in found}
    assert all(shown[name.upper()] == pytest.approx(value) for name, value in held.items() if len(name) <= 16)


@pytest.mark.parametrize(
    ("name", "index", "expected"),
    [
        (b"", 0, "SYSID_THISMAV"),
        (b"", 1, "RCMAP_ROLL"),
        (b"", 35, "WPNAV_RADIUS"),
        (b"WPNAV_RADIUS", -1, "WPNAV_RADIUS"),
        (b"SYSID_THISMAV", -1, "SYSID_THISMAV"),
        (b"WPNAV_RADIUS", 0, "SYSID_THISMAV"),  # the index takes precedence
        (b"", ALL, None),
        (b"", 32767, None),
        (b"NO_SUCH_NAME", -1, None),
        (b"WPNAV_RADIUS1234", -1, None),
        (b"", -1, None),
        (b"WPNAV_RADIUS", -2, "WPNAV_RADIUS"),
        (b"\xff\xfe", -1, None),
    ],
)
def test_a_parameter_is_read_by_index_or_by_name(
    flying: tuple[World, GroundStation], name: bytes, index: int, expected: str | None
) -> None:
    received = answers(flying, m.MAVLink_param_request_read_message(1, 1, name, index))
    assert [value[0] for value in values(received)] == ([expected] if expected else [])


@pytest.mark.parametrize("board", ["harakiri", "inav", "multiwii"])
@pytest.mark.parametrize("is_armed", [False, True])
def test_qgroundcontrol_does_not_show_a_dialog_and_stays_on_the_map(board: str, is_armed: bool) -> None:
    """It checks receiver, compass and accelerometer as soon as it has read the parameters."""
    faults = Faults(armed=is_armed, boxes=0)
    world = World(faults=faults, peer=None if board == "harakiri" else make_board(board, faults=faults))
    world.wait_until(lambda w: w.is_found, 20, then_s=3)
    station = GroundStation(world)
    screen = Screens(station).qgc
    parameter_list(world, station)
    assert len(screen.parameters) >= OWN - 1
    assert (screen.dialogs, screen.is_in_setup) == ([], False)
    assert screen._components_ok
    # These make Mission Planner ask for fences and show another compass page, and QGroundControl for a frame.
    assert not {"FENCE_TOTAL", "RALLY_TOTAL", "COMPASS_PRIO1_ID", "FRAME_CLASS"} & screen.parameters.keys()


def test_qgroundcontrol_is_ready_before_a_flight_controller_is_found() -> None:
    """It reads the parameters once; those of the board are sent when they are known."""
    world = World(powered=False)
    station = GroundStation(world)
    screen = Screens(station).qgc
    station.send(m.MAVLink_param_request_list_message(1, 1), wait_s=1)
    assert (screen.dialogs, screen.is_in_setup, screen.parameters["COMPASS_USE"]) == ([], False, 0.0)
    world.power_on()
    world.run(world.naze.options.boot_ms / 1000 + 5)
    assert (screen.parameters["COMPASS_USE"], screen.parameters["COMPASS_OFS_X"]) == (1.0, 1.0)


@pytest.mark.parametrize(("blocker", "name"), [(13, "INS_ACCOFFS_X"), (12, "COMPASS_OFS_X")])
def test_an_uncalibrated_inav_sensor_has_offset_0(blocker: int, name: str) -> None:
    faults = Faults(boxes=0)
    world = World(faults=faults, peer=make_board("inav", faults=faults))
    world.wait_ready(then_s=3)
    station = GroundStation(world)
    received = parameter_list(world, station)
    assert {value[0]: value[1] for value in values(received)}[name] != 0
    station.take()
    faults.arming_blockers = 1 << blocker
    world.run(3)
    assert values(station.messages("PARAM_VALUE"))[0][:2] == (name, 0.0)


def test_the_radius_of_the_plan_screen_is_a_setting_of_a_harakiri() -> None:
    world, station = radius_world()
    other = GroundStation(world, "other", sysid=254)
    other.send(m.MAVLink_ping_message(0, 0, 0, 0))
    station.send(param_set(b"WPNAV_RADIUS", 350.0), wait_s=1)
    assert values(station.messages()) == values(other.messages()) == [("WPNAV_RADIUS", 350.0, OWN - 1)]
    assert station.texts() == []
    assert SettingsClient(world).value("gps_wp_radius") == 350
    station.send(command_of_storage(1), wait_s=2)
    restart(world)
    assert radius_now(world, station) == 350.0


@pytest.mark.parametrize("value", [200.0, 200.4, 199.949, 199.99998])
def test_an_unchanged_value_is_not_written(value: float) -> None:
    world, station = radius_world()
    before, operations = len(world.written), world.naze.flash_operations
    received = answers((world, station), param_set(b"WPNAV_RADIUS", value))
    assert values(received) == [("WPNAV_RADIUS", 200.0, OWN - 1)]
    assert all(data[4] != SettingCommand.SET_SETTING for _, _, data in world.written[before:])
    world.run(2)
    assert world.naze.flash_operations == operations


@pytest.mark.parametrize("value", [0.0, 13.0, 209.99998, 2000.0])
def test_every_radius_in_range_is_set(value: float) -> None:
    world, station = radius_world()
    station.send(param_set(b"WPNAV_RADIUS", value))
    world.wait_until(lambda _: bool(station.messages("PARAM_VALUE")), 1)
    assert values(station.messages())[0][1] == round(value)
    world.assert_line_was_clean()


def test_a_parameter_that_cannot_be_set_is_answered_with_the_value() -> None:
    world, station = radius_world()
    for name, present in ((b"SYSID_THISMAV", 1.0), (b"RC3_MIN", 1000.0), (b"COMPASS_USE2", 0.0)):
        assert values(answers((world, station), param_set(name, 7.0)))[0][:2] == (name.decode(), present)
        assert station.texts() == [f"{name.decode()} is read-only"]
        # An unchanged value is no news.
        assert values(answers((world, station), param_set(name, present)))[0][:2] == (name.decode(), present)
        assert station.texts() == []
    (missing,) = answers((world, station), param_set(b"NO_SUCH_NAME", 7.0))
    assert (missing.get_type(), missing.param_id) == ("PARAM_ERROR", "NO_SUCH_NAME")
    assert missing.error == m.MAV_PARAM_ERROR_DOES_NOT_EXIST


def test_a_change_just_before_arming_is_not_reported_as_unchanged() -> None:
    """The board changes it, then speaks MAVLink before it answers."""
    world = ready_world(SimOptions(tele_prot=TelemetryProtocol.MAVLINK))
    SettingsClient(world).wait_read()
    station = GroundStation(world)
    station.send(param_set(b"WPNAV_RADIUS", 400.0), wait_s=0.02)
    world.faults.armed = True
    world.run(5)
    texts, held = station.texts(), world.naze._firmware._board.wp_radius_cm
    assert texts[:1] in ([NO_ANSWER.text], [ARMED.text]) or held == 400
    world.faults.armed = False
    world.run(15)
    assert radius_now(world, station) == world.naze._firmware._board.wp_radius_cm


def test_without_the_extension_there_is_no_radius() -> None:
    world = World(faults=Faults(extension=False))
    world.wait_ready()
    station = GroundStation(world)
    station.send(param_set(b"WPNAV_RADIUS", 300.0))
    received = parameter_list(world, station)
    assert "WPNAV_RADIUS" not in [name for name, *_ in values(received)]
    assert values(received)[0] == ("SYSID_THISMAV", 1.0, 0)


def test_repeated_sets_are_done_one_at_a_time() -> None:
    world, station = radius_world()
    for number in range(2000):
        station.send(param_set(b"WPNAV_RADIUS", 300.0 + number % 5))
        if number % 9 == 0:
            world.run(0.0001)
    world.run(4)
    received = answers((world, station), m.MAVLink_param_request_read_message(1, 1, b"WPNAV_RADIUS", -1))
    assert 300 <= values(received)[-1][1] <= 304
    world.assert_line_was_clean()


@pytest.mark.parametrize("hang_s", [0.1, 0.3, 0.8])
def test_a_late_reply_to_the_first_change_does_not_confirm_the_second(hang_s: float) -> None:
    """The board hangs after the first PARAM_SET and answers both when it resumes."""
    world, station = radius_world()
    world.faults.hang = True
    station.send(param_set(b"WPNAV_RADIUS", 300.0), wait_s=0.02)
    world.after(hang_s, lambda: setattr(world.faults, "hang", False))
    world.run(hang_s - 0.01)
    station.send(param_set(b"WPNAV_RADIUS", 500.0), wait_s=10)
    assert values(station.messages())[-1][1] == radius_now(world, station) == world.naze._firmware._board.wp_radius_cm


def radius_now(world: World, station: GroundStation) -> float:
    received = answers((world, station), m.MAVLink_param_request_read_message(1, 1, b"WPNAV_RADIUS", -1))
    return values(received)[-1][1]


# The flight controller's settings.


def settled_world() -> tuple[World, GroundStation]:
    """A world whose board's settings are known to a station."""
    world, station = radius_world()
    SettingsClient(world).wait_read()
    station.stay_connected()
    parameter_list(world, station)
    station.take()
    return world, station


def reply_to(world: World, station: GroundStation, name: bytes, value: float, seconds: float = 1.0) -> list[Message]:
    station.ask(param_set(name, value), wait_s=seconds)
    return [each for each in station.messages() if each.get_type() in ("PARAM_VALUE", "PARAM_ERROR", "STATUSTEXT")]


def test_a_setting_is_set_on_the_board_and_sent_to_all() -> None:
    world, station = settled_world()
    other = GroundStation(world, "other", sysid=254)
    other.send(m.MAVLink_ping_message(0, 0, 0, 0))
    received = reply_to(world, station, b"P_ROLL", 44.0)
    assert {(each.param_id, each.param_value) for each in received} == {("P_ROLL", 44.0)}
    assert [each.param_value for each in other.messages("PARAM_VALUE")] == [44.0]
    assert SettingsClient(world).value("p_roll") == 44


@pytest.mark.parametrize(
    ("name", "value", "kept", "error", "sentence"),
    [
        (b"P_ROLL", 201.0, 35.0, m.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE, "P_ROLL stays 35: 1..200"),
        (b"p_roll", 40.5, 35.0, m.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE, "P_ROLL stays 35: a whole number, 1..200"),
        (b"p_roll", math.nan, 35.0, m.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE, "P_ROLL stays 35: 1..200"),
        (b"p_roll", math.inf, 35.0, m.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE, "P_ROLL stays 35: 1..200"),
        (b"gbl_flg", 3.0, 1.0, m.MAV_PARAM_ERROR_READ_ONLY, "GBL_FLG stays 1: changing it can crash a running"),
        (b"LED_Pattern1", 2.0**24, 1300.0, m.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE, "only up to 16777215 over"),
        (b"WPNAV_RADIUS", 2001.0, 200.0, m.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE, "WPNAV_RADIUS stays 200: 0..2000 cm"),
        (b"WPNAV_RADIUS", math.nan, 200.0, m.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE, "WPNAV_RADIUS stays 200: 0..2000"),
    ],
)
def test_a_refused_value_is_answered_with_the_reason_and_the_value_in_force(
    name: bytes, value: float, kept: float, error: int, sentence: str
) -> None:
    world, station = settled_world()
    received = reply_to(world, station, name, value)
    refused, in_force = (each for each in received if each.get_type() != "STATUSTEXT")
    assert (refused.get_type(), refused.error) == ("PARAM_ERROR", error)
    assert (in_force.get_type(), in_force.param_value) == ("PARAM_VALUE", kept)
    assert sentence in " ".join(station.texts())


def test_mission_planner_fails_a_refused_value() -> None:
    """It says "1 parameters successfully saved" after any PARAM_VALUE, and "Set P_ROLL Failed" without."""
    world, station = settled_world()
    station.send(m.MAVLink_request_data_stream_message(1, 1, m.MAV_DATA_STREAM_EXTRA3, 1, 1), wait_s=1)
    refused = {each.get_type() for each in reply_to(world, station, b"P_ROLL", 201.0)}
    assert "PARAM_ERROR" in refused
    assert "PARAM_VALUE" not in refused
    # A Write sets the radius, and fails without an answer.
    assert "PARAM_VALUE" in {each.get_type() for each in reply_to(world, station, b"WPNAV_RADIUS", 3000.0)}


def test_a_value_that_real32_rounds_is_not_written_back() -> None:
    """Mission Planner writes a whole file of parameters, with the values that it had read."""
    world, station = settled_world()
    client = SettingsClient(world)
    client.change("LED_Pattern1", 16777217)
    received = reply_to(world, station, b"LED_Pattern1", 16777216.0)
    assert {(each.get_type(), each.param_value) for each in received} == {("PARAM_VALUE", 16777216.0)}
    assert client.value("LED_Pattern1") == 16777217


def command_of_storage(what: float) -> Message:
    return m.MAVLink_command_long_message(1, 1, m.MAV_CMD_PREFLIGHT_STORAGE, 0, what, 0, 0, 0, 0, 0, 0)


def test_preflight_storage_saves_once_and_only_what_was_changed() -> None:
    world, station = settled_world()
    reply_to(world, station, b"P_ROLL", 44.0)
    operations = world.naze.flash_operations
    for _ in range(3):
        station.send(command_of_storage(1), wait_s=2)
    assert [ack.result for ack in station.messages("COMMAND_ACK")] == [m.MAV_RESULT_ACCEPTED] * 3
    assert station.texts().count("Settings saved") == 1
    written = world.naze.flash_operations
    assert written > operations
    restart(world)
    assert SettingsClient(world).value("p_roll") == 44


@pytest.mark.parametrize(("name", "value"), [(b"P_ROLL", 201.0), (b"NO_SUCH_NAME", 1.0), (b"SYSID_THISMAV", 7.0)])
def test_a_save_after_a_refused_change_is_silent(name: bytes, value: float) -> None:
    """Mission Planner asks for it by itself, 10 s after any PARAM_SET."""
    world, station = settled_world()
    operations = world.naze.flash_operations
    assert any(each.get_type() == "PARAM_ERROR" for each in reply_to(world, station, name, value))
    station.ask(command_of_storage(1), wait_s=2)
    assert [ack.result for ack in station.messages("COMMAND_ACK")] == [m.MAV_RESULT_ACCEPTED]
    assert station.texts() == []
    assert world.naze.flash_operations == operations


@pytest.mark.parametrize("has_listed", [False, True])
def test_a_change_is_answered_once(has_listed: bool) -> None:
    world, station = settled_world() if has_listed else radius_world()
    (answer,) = reply_to(world, station, b"P_ROLL", 44.0)
    assert (answer.get_type(), answer.param_id, answer.param_value) == ("PARAM_VALUE", "P_ROLL", 44.0)


def test_a_station_that_uses_other_letters_is_answered_with_them() -> None:
    """MAVSDK waits for the name that it has sent."""
    world, station = settled_world()
    assert [each.param_id for each in reply_to(world, station, b"p_roll", 44.0)] == ["p_roll", "P_ROLL"]
    _, error, value = reply_to(world, station, b"p_roll", 201.0)
    assert (error.get_type(), error.param_id, value.param_id) == ("PARAM_ERROR", "p_roll", "p_roll")
    received = answers((world, station), m.MAVLink_param_request_read_message(1, 1, b"p_roll", -1))
    assert [value[:2] for value in values(received)] == [("p_roll", 44.0)]


def test_preflight_storage_in_flight_is_denied_while_something_is_unsaved() -> None:
    world, station = settled_world()
    reply_to(world, station, b"P_ROLL", 44.0)
    world.arm(then_s=1)
    station.send(command_of_storage(1), wait_s=1)
    assert [ack.result for ack in station.messages("COMMAND_ACK")] == [m.MAV_RESULT_DENIED]


def test_what_is_requested_before_the_settings_are_read_waits_for_them() -> None:
    world = World(speeds=(115200,))
    world.wait_until(lambda world: world.is_found, 20)
    station, other = GroundStation(world), GroundStation(world, "other", sysid=254)
    other.send(m.MAVLink_param_request_read_message(1, 1, b"P_ROLL", -1))
    assert {each.param_count for each in parameter_list(world, station)} == {ALL}
    assert other.messages("PARAM_VALUE")[0].param_id == "P_ROLL"


def test_a_station_with_a_shorter_list_gets_the_whole_list_later() -> None:
    world = World(powered=False, speeds=(115200,))
    station = GroundStation(world).stay_connected()
    assert len(parameter_list(world, station)) == OWN - 1
    station.take()
    world.power_on()
    world.run(world.naze.options.boot_ms / 1000 + 6)
    assert {each.param_index for each in station.messages("PARAM_VALUE") if each.param_count == ALL} == {*range(ALL)}


def test_lists_of_many_stations_are_sent_side_by_side_at_a_bounded_rate() -> None:
    world, _ = settled_world()
    stations = [GroundStation(world, f"many{number}", sysid=100 + number) for number in range(5)]
    for station in stations:
        for _ in range(30):
            station.send(m.MAVLink_param_request_list_message(1, 1))
    began = world.now
    world.wait_until(lambda _: all(len(station.messages("PARAM_VALUE")) >= ALL for station in stations), 20)
    total = sum(len(station.messages("PARAM_VALUE")) for station in stations)
    assert total <= 500 * (world.now - began) + 50


def test_a_station_that_leaves_takes_the_list_along() -> None:
    world, station = settled_world()
    station.send(m.MAVLink_param_request_list_message(1, 1), wait_s=0.05)
    world.bridge.gcs_gone(station.peer, world.now)
    parameters = world.inside.parameters
    gc.collect()
    world.run(2)
    gc.collect()
    assert not [each for each in parameters._dialogues if each.peer == station.peer]


#: The name (empty: a setting of the board), the value (0: a valid one), and MAV_PARAM_ERROR.
_REFUSALS = {
    "too high": (b"", 1e9, m.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE),
    "not a number": (b"", math.nan, m.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE),
    "the bridge's own": (b"RC3_MIN", 7.0, m.MAV_PARAM_ERROR_READ_ONLY),
    "unknown": (b"NO_SUCH_NAME", 7.0, m.MAV_PARAM_ERROR_DOES_NOT_EXIST),
    "armed": (b"", 0.0, m.MAV_PARAM_ERROR_PERMISSION_DENIED),
    "lost": (b"", 0.0, m.MAV_PARAM_ERROR_PERMISSION_DENIED),
    "without an answer": (b"", 0.0, m.MAV_PARAM_ERROR_PERMISSION_DENIED),
    "during an upload": (b"", 0.0, m.MAV_PARAM_ERROR_PERMISSION_DENIED),
}


@pytest.mark.parametrize(
    ("kind", "reason"),
    [
        *(("harakiri", reason) for reason in _REFUSALS),
        *((kind, reason) for kind in ("inav", "multiwii") for reason in ("too high", "armed", "without an answer")),
    ],
)
def test_every_refused_change_is_an_error_on_every_board(kind: str, reason: str) -> None:
    """QGroundControl repeats it without, and MAVSDK waits."""
    faults = Faults(boxes=0)
    world = World(faults=faults, peer=None if kind == "harakiri" else make_board(kind, faults=faults))
    world.wait_until(lambda w: w.is_found, 20)
    table = SettingsClient(world).wait_read()
    station = GroundStation(world).stay_connected()
    names = {value[0] for value in values(parameter_list(world, station))}
    setting = next(
        each for each in table if each.name.upper() in names and each.kind is ValueKind.INTEGER and not each.fixed
    )
    name, value, error = _REFUSALS[reason]
    match reason:
        case "armed":
            world.arm(then_s=2)
        case "lost":
            world.power_off()
            world.run(6)
        case "without an answer":
            world.faults.hang = True
        case "during an upload":
            station.send(m.MAVLink_mission_count_message(1, 1, 20), wait_s=0.1)
    other = setting.minimum + (setting.value == setting.minimum)
    received = reply_to(world, station, name or setting.name.upper().encode(), value or other, 8)
    assert [each.error for each in received if each.get_type() == "PARAM_ERROR"] == [error]


@pytest.mark.parametrize("value", [2.3, 0.1, 1 / 3])
def test_a_value_that_is_equal_in_single_precision_is_echoed_exactly(value: float) -> None:
    """A real number arrives as REAL32, and QGroundControl compares the answer with what it sent."""
    world, station = settled_world()
    table = SettingsClient(world).wait_read()
    setting = next(each for each in table if each.kind is ValueKind.FLOAT and each.accepts(value) and not each.fixed)
    sent = struct.unpack("<f", struct.pack("<f", value))[0]
    for _ in range(2):
        received = reply_to(world, station, setting.name.upper().encode(), value)
        assert [each.param_value for each in received] == [sent]
