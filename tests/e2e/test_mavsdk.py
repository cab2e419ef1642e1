# SPDX-License-Identifier: GPL-3.0-or-later
"""The real MAVSDK as a ground station (for missions it behaves like QGroundControl)."""

import asyncio
import math
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import asynccontextmanager
from dataclasses import replace
from typing import Any, TypeVar

import pytest
from mavsdk import ComponentType
from mavsdk.asyncio import Configuration, Mavsdk
from mavsdk.asyncio.plugins.mavlink_direct.mavlink_direct import MavlinkDirectAsync, MavlinkMessage
from mavsdk.asyncio.plugins.mission_raw import (
    MissionItem,
    MissionRawAsync,
    MissionRawError,
    MissionRawResult,
)
from mavsdk.asyncio.plugins.param.param import ParamAsync, ParamError, ParamResult
from mavsdk.asyncio.plugins.telemetry.telemetry import TelemetryAsync

from protocols.mission_item import Command
from tests.support.benches import Bench, Starter
from tests.support.lossy_udp import LossyUdp
from tests.support.plan import (
    HOME,
    PlanRow,
    as_items,
    expected_fields,
    judge,
    mixed_plan,
    plain_plan,
    records_of,
    waypoint,
)
from tests.support.programs import TIMEOUT_S, until

T = TypeVar("T")


@asynccontextmanager
async def vehicle_at(port: int, *, listen: bool = False) -> AsyncIterator[Any]:
    """Connect MAVSDK, or let it wait for the vehicle there (`listen`); return the vehicle it finds."""
    async with Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION)) as mavsdk:
        await mavsdk.add_any_connection(f"{'udpin' if listen else 'udpout'}://127.0.0.1:{port}")
        system = await mavsdk.first_autopilot(timeout_s=TIMEOUT_S)
        assert system is not None
        yield system


def raw_items(plan: Sequence[PlanRow]) -> list[Any]:
    found = []
    for item in as_items(plan):
        head = (item.seq, item.frame, item.command, int(item.seq == 0), 1)
        found.append(MissionItem(*head, item.p1, item.p2, item.p3, item.p4, item.lat_e7, item.lon_e7, item.alt_m, 0))
    return found


def fields(item: Any) -> tuple[float, ...]:
    names = ("seq", "command", "frame", "param1", "param2", "param3", "param4", "x", "y", "z")
    return tuple(getattr(item, name) for name in names)


async def refusal_of(missions: Any, plan: Sequence[PlanRow]) -> Any:
    with pytest.raises(MissionRawError) as refused:
        await missions.upload_mission(raw_items(plan))
    return refused.value.result


async def pressed_again(act: Callable[[], Awaitable[T]], after_failure: Callable[[], None]) -> T:
    """Try up to three times: MAVSDK gives up after five repeats of one message."""
    for _ in range(2):
        try:
            return await act()
        except MissionRawError as failed:
            if failed.result != MissionRawResult.TIMEOUT:
                raise
            after_failure()
    return await act()


@pytest.mark.parametrize("count", [12, 146])
async def test_a_written_list_is_read_back(shared: Bench, count: int) -> None:
    plan = mixed_plan(count)
    async with vehicle_at(shared.daemon.port) as vehicle:
        missions = MissionRawAsync(vehicle)
        await missions.upload_mission(raw_items(plan))
        assert shared.board.records() == records_of(judge(plan))
        assert [fields(item) for item in await missions.download_mission()] == expected_fields(plan)


async def test_mavsdk_waits_while_a_list_is_written_slowly(start: Starter) -> None:
    """146 records take 3 s at 9600 baud; MAVSDK's timeout is 2.5 s."""
    bench = start.bench("--baud", "9600")
    plan = mixed_plan(146)
    async with vehicle_at(bench.daemon.port) as vehicle:
        await MissionRawAsync(vehicle).upload_mission(raw_items(plan))
    assert bench.board.records() == records_of(judge(plan))


async def test_unset_parameters_are_nan(shared: Bench) -> None:
    plan = [replace(row, p1=math.nan, p3=math.nan, p4=math.nan) for row in plain_plan(20, start=3)]
    async with vehicle_at(shared.daemon.port) as vehicle:
        await MissionRawAsync(vehicle).upload_mission(raw_items(plan))
    assert shared.board.records() == records_of(judge(plain_plan(20, start=3)))


async def test_a_list_is_written_and_read_over_a_bad_link(shared: Bench, kept: list[str]) -> None:
    link = shared.lossy_link(loss=0.1, repeats=0.05, delay_s=0.03, jitter_s=0.04, seed=2)
    plan = mixed_plan(20)
    new = records_of(judge(plan))

    def list_is_whole() -> None:
        assert shared.board.records() in (kept, new)

    async with vehicle_at(link.address[1]) as vehicle:
        missions = MissionRawAsync(vehicle)
        await pressed_again(lambda: missions.upload_mission(raw_items(plan)), list_is_whole)
        assert shared.board.records() == new
        held = await pressed_again(missions.download_mission, list_is_whole)
        assert [fields(item) for item in held] == expected_fields(plan)
    assert shared.board.records() == new
    assert link.lost


async def test_a_refused_list_keeps_the_old_mission(shared: Bench) -> None:
    """Over a network that takes longer than the script to begin its next upload."""
    with LossyUdp(shared.daemon.address, delay_s=0.03) as link:
        async with vehicle_at(link.address[1]) as vehicle:
            missions = MissionRawAsync(vehicle)
            plan = plain_plan(12, start=20)
            await missions.upload_mission(raw_items(plan))
            landing = [HOME, PlanRow(Command.NAV_LAND), waypoint(1)]
            assert await refusal_of(missions, landing) == MissionRawResult.INVALID_ARGUMENT
            assert await refusal_of(missions, plain_plan(147)) == MissionRawResult.TOO_MANY_MISSION_ITEMS
            assert await refusal_of(missions, [HOME, waypoint(1, frame=7)]) == MissionRawResult.UNSUPPORTED
            assert shared.board.records() == records_of(judge(plan))


async def test_clear_mission_and_clear_all_clear_the_board(shared: Bench) -> None:
    """Its clear_mission sends an ArduPilot a list of one item of zeros."""
    async with vehicle_at(shared.daemon.port) as vehicle:
        missions = MissionRawAsync(vehicle)
        plan = plain_plan(12, start=20)
        await missions.upload_mission(raw_items(plan))
        await missions.clear_mission()
        until(lambda: shared.board.records() == [], "an empty board")
        await missions.upload_mission(raw_items(plan))
        assert shared.board.records() == records_of(judge(plan))
        clear_all = '{"target_system": 1, "target_component": 1, "mission_type": 0}'
        message = MavlinkMessage("MISSION_CLEAR_ALL", 245, 190, 1, 1, clear_all)
        await MavlinkDirectAsync(vehicle).send_message(message)
        until(lambda: shared.board.records() == [], "an empty board")
        # Only home is left.
        assert len(await missions.download_mission()) == 1


async def test_long_texts_arrive_whole_and_once(shared: Bench) -> None:
    """MAVSDK joins the pieces of a STATUSTEXT with nothing in between: padding would be a gap."""
    texts: list[str] = []
    async with vehicle_at(shared.daemon.port) as vehicle, asyncio.timeout(TIMEOUT_S):
        upload = asyncio.ensure_future(MissionRawAsync(vehicle).upload_mission(raw_items(mixed_plan(20))))
        async for text in TelemetryAsync(vehicle).subscribe_status_text():
            texts.append(text.text)
            if texts[-1].startswith("WP 8: Yaw"):
                break
        await upload
    changes = [text for text in texts if text.startswith(("WP 6", "WP 7"))]
    assert changes == [
        "WP 6: Time s changed from 700 to 255 (seconds 1..255)",
        "WP 6: Hit Rad changed from 1 to 2 m (2..255 m)",
        "WP 6: Alt changed from 19.5 to 19 m (whole numbers only)",
        "WP 7: DO_SET_ROI_NONE dropped, no ROI from here on",
    ]


async def test_parameters_and_telemetry_work(shared: Bench) -> None:
    async with vehicle_at(shared.daemon.port) as vehicle:
        parameters = ParamAsync(vehicle)
        shared.daemon.ask({"do": "settings"})  # until they are read the list is shorter
        for unknown in (parameters.get_param_float("NOT_THERE"), parameters.set_param_float("NOT_THERE", 1.0)):
            with pytest.raises(ParamError) as missing:
                await unknown
            assert missing.value.result == ParamResult.DOES_NOT_EXIST
        found = {each.name: each.value for each in (await parameters.get_all_params()).float_params}
        assert (found["SYSID_THISMAV"], found["WPNAV_RADIUS"], found["RCMAP_THROTTLE"]) == (1.0, 200.0, 3.0)
        # The first one's flash write is still pending when the next one arrives.
        for radius_cm in (300.0, 200.0):
            await parameters.set_param_float("WPNAV_RADIUS", radius_cm)
            assert await parameters.get_param_float("WPNAV_RADIUS") == radius_cm
        assert (len(found), found["P_PITCH"]) == (237, 35.0)
        await parameters.set_param_float("P_PITCH", 38.0)
        assert await parameters.get_param_float("P_PITCH") == 38.0
        await parameters.set_param_float("P_PITCH", 35.0)
        # Another parameter: on a busy machine MAVSDK repeats the request, and would take the second refusal for the
        # answer to the next change of the same one.
        with pytest.raises(ParamError) as refused:
            await parameters.set_param_float("p_roll", 201.0)
        assert refused.value.result == ParamResult.VALUE_OUT_OF_RANGE
        assert await parameters.get_param_float("p_roll") == found["P_ROLL"]
        telemetry = TelemetryAsync(vehicle)
        async for position in telemetry.subscribe_position():
            if math.isfinite(position.latitude_deg):
                assert position.latitude_deg == pytest.approx(45.4, abs=1)
                break
        async for battery in telemetry.subscribe_battery():
            assert 9 < battery.voltage_v < 13
            break
