# SPDX-License-Identifier: GPL-3.0-or-later
"""No request over any door holds the event loop for longer than its budget: the worst of each door, counted as work."""

import asyncio
import json
import struct
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, replace
from types import SimpleNamespace
from typing import cast

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from payloads import keys
from protocols.mission_file import write_mission_file
from protocols.msp.frame import request
from service.daemon.api import DaemonApi
from service.daemon.telemetry_logs import PIECE, TelemetryLogs
from service.zenoh_link.answers import CommandQueries
from service.zenoh_link.queries import Question
from storage.mission_store import MissionStore, ReceivedMission
from tests.protocols.test_hostile_bytes import PATTERNS
from tests.support.conversations import waypoints
from tests.support.doors import Doors, Story, open_doors
from tests.support.work import LOOP_BUDGET, Work

LIST = waypoints(500)
PLAN = write_mission_file(LIST, "x.plan").encode()
#: Names that the board has, in the other case, and names that no board has.
SETTINGS = {f"nav_setting_{number}".upper(): 1.0 for number in range(1500)}
PARAMS = "".join(f"{name},1\n" for name in SETTINGS).encode()
LARGEST = 1 << 18
_ADDED_AT_ONCE = 50
#: They send over TCP at once: what the daemon does between requests is counted, too, and takes most of the time.
_CLIENTS = 4


async def filled(doors: Doors) -> None:
    """A store with a thousand missions, the first of them with the longest list."""
    items = [asdict(item) for item in LIST]
    longest = ReceivedMission(1.0, "x" * 100, items, "REJECTED", "x", [], items, bytes(8000), 500, 1, {}, [])
    short = replace(longest, items=items[:1], stored_items=items[:1])

    missions = [longest, *[short] * 999]

    def fill(store: MissionStore) -> None:
        for received in missions[:_ADDED_AT_ONCE]:
            store.add(received)

    while missions:
        await doors.daemon.store.ask(fill)
        del missions[:_ADDED_AT_ONCE]


async def control_socket(doors: Doors) -> None:
    items = [asdict(item) for item in LIST]
    for each in (
        {"do": "push", "items": items, "source": "x" * 1000},
        {"do": "push", "items": [*items[:100]], "source": "x"},
        {"do": "push", "items": [{"seq": 0}] * 20_000},
        {"do": "plan-settings", "values": SETTINGS},
        {"do": "plan-settings", "values": {f"a{number}": 1 for number in range(36_000)}},
        {"do": "restore-settings", "values": SETTINGS},
        {"do": "missions", "limit": 2**31 - 1},
        {"do": "backups", "limit": 2**31 - 1},
        *({"do": name, "number": 1} for name in ("mission", "backup", "restore")),
        *({"do": name} for name in ("settings", "status", "pull", "save-settings")),
        b"[" * (LARGEST - 2),
        b'{"do": ' + b"1" * (LARGEST - 100) + b"}",
        json.dumps({"do": "x" * (LARGEST - 100)}).encode(),
    ):
        await doors.ask(each)


async def page(doors: Doors) -> None:
    paths = ("state", "held", "connect", "missions", "missions/1", "settings", "settings/1", "settings/1/file")
    for path in (*(f"/api/{each}" for each in paths), "/metrics", "/", "/map.js"):
        assert b"HTTP/1.1 200" in await doors.http("GET", path), path
    lines = "".join(f"{number},51.5,0.1,20\n" for number in range(LARGEST // 20))
    files = (PLAN, b"[" * LARGEST, b"{" + b'"a":{' * 50_000, b"QGC WPL 110\n" + b"0 " * 100_000, lines.encode())
    for body in files:
        assert b"HTTP/1.1 " in await doors.http("POST", "/api/check?name=x", body[:LARGEST])
    assert b"HTTP/1.1 " in await doors.http("GET", f"/{'a' * 60_000}")


def _messages() -> list[m.MAVLink_message]:
    path = b"@PARAM/param.pck".ljust(239, b"\0")
    return [
        m.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3),
        m.MAVLink_param_request_list_message(1, 1),
        m.MAVLink_param_request_read_message(1, 1, b"nav_wp_radius", -1),
        m.MAVLink_param_set_message(1, 1, b"nav_wp_radius", 300.0, 9),
        m.MAVLink_mission_request_list_message(1, 1),
        m.MAVLink_mission_request_int_message(1, 1, 3),
        m.MAVLink_mission_count_message(1, 1, 100),
        m.MAVLink_mission_item_int_message(1, 1, 0, 0, 16, 0, 1, 0, 0, 0, 0, 0, 0, 0),
        m.MAVLink_mission_clear_all_message(1, 1),
        m.MAVLink_mission_write_partial_list_message(1, 1, 0, 5),
        *(m.MAVLink_command_long_message(1, 1, command, 0, first, 10, 0, 0, 0, 0, 0)
          for command, first in ((512, 148), (511, 30), (520, 1), (300, 0), (246, 0), (241, 1), (401, 0))),
        m.MAVLink_request_data_stream_message(1, 1, 0, 50, 1),
        m.MAVLink_ping_message(1, 1, 0, 0),
        m.MAVLink_timesync_message(0, 1),
        *(m.MAVLink_file_transfer_protocol_message(0, 1, 1, [0, 0, 0, code, 239, 0, 0, 0, 0, 0, 0, 0, *path])
          for code in (4, 14, 15)),
    ]  # fmt: skip


def _datagrams() -> list[bytes]:
    """As many of each message as a datagram holds, and the bytes that cost the parsers most."""
    sender = m.MAVLink(None, srcSystem=255, srcComponent=190)
    frames = [bytes(message.pack(sender)) for message in _messages()]
    return [(data * 2048)[:2048] for data in (*frames, *PATTERNS.values())]


async def udp(doors: Doors) -> None:
    for datagram in _datagrams():
        await doors.udp_sends([datagram, datagram, *(datagram[:size] for size in (1, 2, 3, 7, 13, 31, 64))])


async def each_over_tcp(doors: Doors, port: int, sent: Sequence[bytes]) -> None:
    for at in range(0, len(sent), _CLIENTS):
        await asyncio.gather(*(doors.tcp_sends(port, data) for data in sent[at : at + _CLIENTS]))


async def tcp(doors: Doors) -> None:
    await each_over_tcp(doors, doors.tcp, [datagram * 2 for datagram in _datagrams()])


async def share(doors: Doors) -> None:
    commands = (request(code, b"") for code in (101, 118, 116, 119, 200, 209, 0x1007))
    repeated = (*commands, request(118, b"\1"), *PATTERNS.values())
    await each_over_tcp(doors, doors.share, [(data * LARGEST)[:LARGEST] for data in repeated])


async def zenoh(doors: Doors) -> None:
    logs = TelemetryLogs(doors.daemon.settings.state_dir)
    name = "2026-05-01 10-00-00.tlog"
    assert doors.daemon.settings.state_dir is not None
    (doors.daemon.settings.state_dir / name).write_bytes(struct.pack("<Q", 7) * (PIECE // 8))
    answerers = CommandQueries(DaemonApi(doors.daemon), set(), logs).answerers
    log = json.dumps({"name": name, "start": 0}).encode()
    comments, refused = b"#\n" * (LARGEST // 2), list[str]()
    for key, payload in (
        *((key, PARAMS) for key in (keys.SETTINGS_PLAN, keys.SETTINGS_RESTORE)),
        (keys.SETTINGS_PLAN, comments),
        *((key, PLAN) for key in (keys.CHECK, keys.UPLOAD)),
        (keys.CHECK, b"[" * LARGEST),
        (keys.SETTINGS_LIST, b""),
        (keys.STATUS, b""),
        (keys.LOG_LIST, b""),
        (keys.LOG_READ, log),
    ):
        question = SimpleNamespace(
            size=len(payload), payload=lambda payload=payload: payload, send=lambda _: None, parameter=lambda _: None
        )
        try:
            await answerers[key](cast("Question", question))
        except Exception as error:  # refusals are fine
            refused.append(str(error))
    logs.close()
    assert all(refused)


@pytest.fixture(scope="module")
def work_of(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[[Story], Work]]:
    with open_doors(tmp_path_factory.mktemp("daemon")) as work_of:
        work_of(filled)
        yield work_of


@pytest.mark.parametrize("door", [control_socket, page, udp, tcp, share, zenoh])
def test_the_worst_requests_of_a_door_stay_within_the_loops_budget(
    door: Story, work_of: Callable[[Story], Work]
) -> None:
    work = work_of(door)
    over = {name: count for name, count in work.worst.items() if count > LOOP_BUDGET}
    assert over == {}
    assert work.most > 10_000, "the requests did not reach the daemon"
