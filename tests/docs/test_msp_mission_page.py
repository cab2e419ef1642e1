# SPDX-License-Identifier: GPL-3.0-or-later
"""The worked exchange in docs/msp-mission.md matches the encoders and the simulated Naze."""

import re
from pathlib import Path

from protocols.mission_item import identify, pack_records
from protocols.msp import mission as ext
from protocols.msp.mission import WpCommand, WpRecord
from protocols.msp.setting_table import SettingCommand, decode_settings, encode_read_settings, encode_set_setting
from tests.support.naze_bench import Bench

PAGE = Path(__file__).parents[2] / "docs" / "msp-mission.md"
HOME = WpRecord(473977420, 85455940, 2, 0, 0, 2, 0, WpCommand.WAYPOINT)
# A height of 13 m with a brake: bytes 0D 00 00 00 01, a hazard run for Harakiri in plain form.
WAYPOINT = WpRecord(473980000, 85460000, 13, 0, 1, 2, 0, WpCommand.WAYPOINT)


def exchange() -> list[str]:
    """Push the two records to a simulated Naze; return every frame as "companion -> ..." or "... <-"."""
    bench = Bench()
    records = [HOME, WAYPOINT]
    chunk_1 = ext.encode_chunk(pack_records(records), 0, 15)
    chunk_2 = ext.encode_chunk(pack_records(records), chunk_1.first + chunk_1.count, 15)
    requests = [
        ext.INFO_REQUEST,
        ext.encode_begin(identify(records)),
        chunk_1.frame,
        chunk_2.frame,
        ext.encode_commit(identify(records)),
        ext.encode_read(0, 2),
    ]
    return replies(bench, requests)


def settings_exchange() -> list[str]:
    """Read the first setting, and set it."""
    reply = decode_settings(Bench().payload(encode_read_settings(0, 1)))
    assert reply is not None
    return replies(Bench(), [encode_read_settings(0, 1), encode_set_setting(0, reply.settings[0].setting, 13)])


def replies(bench: Bench, requests: list[bytes]) -> list[str]:
    bench.ask(ext.INFO_REQUEST)  # ends AUTOSENSE, whose heartbeats would be in the exchange
    lines = []
    for request in requests:
        reply = bench.ask(request)
        assert reply is not None
        lines += [f"-> {request.hex(' ')}", f"<- {reply.encode().hex(' ')}"]
    return lines


def test_worked_exchange_is_right() -> None:
    page = PAGE.read_text()
    assert f"`{pack_records([HOME, WAYPOINT]).hex()}`" in page
    printed = re.findall(r"^(?:->|<-) [0-9a-f ]+$", page, re.MULTILINE)
    assert printed == settings_exchange() + exchange()


def test_every_status_and_command_is_on_the_page() -> None:
    page = PAGE.read_text()
    for status in ext.ReplyStatus:
        assert f"| {status.value} | {status.name} |" in page
    for command in ext.MissionCommand:
        assert f"### {command.value} {command.name}" in page
    for setting_command in SettingCommand:
        assert f"### {setting_command.value} {setting_command.name}" in page
