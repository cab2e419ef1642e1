# SPDX-License-Identifier: GPL-3.0-or-later
"""Flight controllers with arbitrary replies: every conversation ends, nothing raises, no false acceptance."""

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as messages

from bridge.controllers.harakiri import profile as harakiri
from bridge.missions.fc_mission_store import PushFailure
from protocols.mission_item import ListIdentity, MissionResult, identify
from protocols.msp.frame import Direction, MspFrame, MspParser
from protocols.msp.mission import Info, InfoFlag, MissionCommand, Records, ReplyStatus, Staged, Stored, decode_info
from simulator.naze.replies import encode_reply, unmask
from tests.support.conversations import Download, Upload, records_of, waypoints
from tests.support.fake_controllers import HARAKIRI_CAPABILITY, QuietLine, ident
from tests.support.world import GroundStation, World

BOXES = b"ANGLE;ARM;GTUNE;"
INFO = Info(1, InfoFlag(0), 15, 2, 6, 146, ListIdentity(0, 0), 200, 50, 0, 0)
TELEMETRY = {101: 11, 106: 18, 108: 8, 109: 10, 110: 7, 118: 21}


class FakeExtension(QuietLine):
    """Identifies as a Harakiri with the extension; `answer` decides the other replies."""

    def __init__(self, seed: int = 0, info: Info = INFO) -> None:
        super().__init__()
        self.random = random.Random(seed)
        self.info = info
        self.telemetry: dict[int, bytes] = {}
        self._parser = MspParser()

    def receive(self, data: bytes, now: float) -> None:
        for frame in self._parser.feed(data):
            match frame.command:
                case 100:
                    payload: bytes | None = ident(211, HARAKIRI_CAPABILITY)
                case 116:
                    payload = BOXES
                case MissionCommand.INFO:
                    payload = encode_reply(self.info)
                case command if command in TELEMETRY:
                    payload = self.telemetry.get(command, bytes(TELEMETRY[command]))
                case _:
                    payload = self.answer(frame)
            if payload is not None:
                self.outgoing += MspFrame(Direction.REPLY, frame.command, payload).encode()

    def answer(self, frame: MspFrame) -> bytes | None:
        """The reply to a command of the extension; None: no reply."""
        draw = self.random
        status = draw.choice((ReplyStatus.OK, ReplyStatus.OK, *ReplyStatus))
        count, checksum = draw.choice((0, 1, 5, 146, 65535)), draw.choice((0, 1, 0xFFFFFFFF))
        match draw.randrange(8):
            case 0:
                return None
            case 1:
                return draw.randbytes(draw.randrange(120))
            case 2:
                return b""
            case 3:
                return encode_reply(Stored(status, ListIdentity(count, checksum)))
            case 4:
                return encode_reply(Records(status, draw.choice((0, 6, 12, 7, 65535)), records_of(waypoints(6))))
        return encode_reply(Staged(status, count, checksum))


class FixedReplies(FakeExtension):
    """Always gives the same reply to CHUNK, COMMIT or READ."""

    def __init__(self, answers: dict[int, bytes], info: Info = INFO) -> None:
        super().__init__(info=info)
        self.answers = answers

    def answer(self, frame: MspFrame) -> bytes | None:
        return self.answers.get(frame.command, encode_reply(Staged(ReplyStatus.OK, 0, 0)))


def found(peer: QuietLine) -> tuple[World, GroundStation]:
    world = World(speeds=(115200,), peer=peer)
    world.wait_until(lambda w: w.kind is harakiri.PATCHED, 5)
    return world, GroundStation(world)


@pytest.mark.parametrize("seed", range(16))
def test_every_conversation_ends_with_any_replies(seed: int) -> None:
    world, station = found(
        FakeExtension(seed, Info(1, InfoFlag(0), 15, 2, 6, 146, ListIdentity(20, 99), 200, 50, 0, 0))
    )
    assert Upload(station, waypoints(30, seed)).run(120) not in (None, MissionResult.ACCEPTED)
    Download(station).run(60)
    station.send(messages.MAVLink_param_set_message(1, 1, b"WPNAV_RADIUS", 300.0, 9))
    world.wait_until(lambda w: not w.bridge.is_busy, 60)
    assert not world.inside.uploads._uploads


@pytest.mark.parametrize(
    "answers",
    [
        {MissionCommand.CHUNK: encode_reply(Staged(ReplyStatus.SEQUENCE, 0, 0))},
        {MissionCommand.CHUNK: encode_reply(Staged(ReplyStatus.OK, 0, 0))},
        {MissionCommand.COMMIT: encode_reply(Stored(ReplyStatus.INCOMPLETE, ListIdentity(0, 0)))},
        {MissionCommand.COMMIT: encode_reply(Stored(ReplyStatus.OK, ListIdentity(0, 0)))},
        {MissionCommand.COMMIT: encode_reply(Stored(ReplyStatus.ARMED, ListIdentity(0, 0)))},
        {MissionCommand.COMMIT: encode_reply(Stored(ReplyStatus.FLASH, identify(records_of(waypoints(30)))))},
        {MissionCommand.BEGIN: encode_reply(Staged(ReplyStatus.SAME, 0, 0))},
        {MissionCommand.BEGIN: encode_reply(Staged(ReplyStatus.BUSY, 0, 0))},
        {MissionCommand.BEGIN: encode_reply(Staged(ReplyStatus.OK, 30, 0))},
        {MissionCommand.BEGIN: b"\xff"},
    ],
)
def test_a_board_that_always_gives_the_same_reply_is_given_up(answers: dict[int, bytes]) -> None:
    _, station = found(FixedReplies(answers))
    assert Upload(station, waypoints(30)).run(60) is MissionResult.DENIED


LIST = identify(records_of(waypoints(60)))
TOO_FAR, WHOLE = (encode_reply(Staged(ReplyStatus.OK, count, LIST.checksum)) for count in (61, 60))
COMMITTED = encode_reply(Stored(ReplyStatus.OK, LIST))


class BeginsInTurn(FixedReplies):
    """Answers each BEGIN with the next of `begins`; silent after the last one if `then_silent`."""

    def __init__(self, begins: list[bytes], answers: dict[int, bytes], *, then_silent: bool = False) -> None:
        super().__init__(answers)
        self.begins = begins
        self.then_silent = then_silent

    def receive(self, data: bytes, now: float) -> None:
        if self.begins or not self.then_silent:
            super().receive(data, now)

    def answer(self, frame: MspFrame) -> bytes | None:
        return self.begins.pop(0) if frame.command == MissionCommand.BEGIN else super().answer(frame)


def test_a_board_that_claims_more_records_than_the_list_has_starts_again() -> None:
    _, station = found(BeginsInTurn([TOO_FAR, WHOLE], {MissionCommand.COMMIT: COMMITTED}))
    assert Upload(station, waypoints(60)).run(60) is MissionResult.ACCEPTED


def test_a_failed_commit_does_not_leave_the_next_attempt_uncertain() -> None:
    """The board reports a flash error, takes a new BEGIN and falls silent before any chunk arrives."""
    refused: dict[int, bytes] = {MissionCommand.COMMIT: encode_reply(Stored(ReplyStatus.FLASH, ListIdentity(0, 0)))}
    begins = [WHOLE, encode_reply(Staged(ReplyStatus.OK, 0, 0))]
    world, _ = found(BeginsInTurn(begins, refused, then_silent=True))
    outcome = world.push(waypoints(60))
    world.wait_until(lambda _: bool(outcome), 30)
    assert outcome[0][0].text == PushFailure.NO_ANSWER.value.text


def test_a_list_is_not_written_if_info_reports_armed() -> None:
    """Its telemetry still says disarmed: polls are slower than INFO."""
    answers: dict[int, bytes] = {MissionCommand.BEGIN: WHOLE, MissionCommand.COMMIT: COMMITTED}
    _, station = found(FixedReplies(answers, INFO._replace(flags=InfoFlag.ARMED)))
    assert Upload(station, waypoints(60)).run(60) is MissionResult.DENIED


@pytest.mark.parametrize(
    "answer",
    [
        Records(ReplyStatus.OK, 0, []),
        Records(ReplyStatus.OK, 0, records_of(waypoints(3))),
        Records(ReplyStatus.OK, 6, records_of(waypoints(6))),
        Records(ReplyStatus.OK, 7, records_of(waypoints(6))),
        Records(ReplyStatus.RANGE, 0, []),
    ],
)
def test_a_download_without_progress_ends(answer: Records) -> None:
    info = Info(1, InfoFlag(0), 15, 2, 6, 146, ListIdentity(20, 99), 200, 50, 0, 0)
    _, station = found(FixedReplies({MissionCommand.READ: encode_reply(answer)}, info))
    download = Download(station, repeat_s=30)
    download.run(30)
    assert download.result is MissionResult.DENIED


class Reader(FakeExtension):
    """Holds 20 records; `first_reply` is its reply to the first READ, or to all of them if `is_stubborn`."""

    def __init__(self, first_reply: Records, *, is_stubborn: bool = False) -> None:
        self.records = records_of(waypoints(20))
        super().__init__(info=INFO._replace(stored=identify(self.records)))
        self.first_reply = first_reply
        self.is_stubborn = is_stubborn
        self.reads = 0

    def answer(self, frame: MspFrame) -> bytes | None:
        body = unmask(frame.payload)
        if frame.command != MissionCommand.READ or body is None:
            return None
        self.reads += 1
        if self.reads == 1 or self.is_stubborn:
            return encode_reply(self.first_reply)
        first = int.from_bytes(body[:2], "little")
        return encode_reply(Records(ReplyStatus.OK, first, self.records[first : first + body[2]]))


def test_records_at_a_place_that_was_not_asked_for_are_read_again() -> None:
    board = Reader(Records(ReplyStatus.OK, 7, records_of(waypoints(20))[7:13]))
    _, station = found(board)
    assert len(Download(station, repeat_s=30).run(30)) == 20


def test_a_refused_read_is_tried_only_once_more() -> None:
    board = Reader(Records(ReplyStatus.ARMED, 0, []), is_stubborn=True)
    world, _ = found(board)
    world.wait_until(lambda w: board.reads > 0 and not w.bridge.is_busy, 30)
    assert board.reads == 2


@pytest.mark.parametrize("field", ["version", "chunk_records", "chunk_window", "read_records"])
def test_info_without_a_number_that_a_transfer_needs_is_not_accepted(field: str) -> None:
    assert decode_info(encode_reply(INFO)) == INFO
    assert decode_info(encode_reply(INFO._replace(**{field: 0}))) is None  # type: ignore[arg-type]


@pytest.mark.parametrize("records", [15, 16, 40, 255])
def test_a_chunk_size_beyond_a_frame_is_limited(records: int) -> None:
    info = Info(1, InfoFlag(0), records, 255, records, 146, ListIdentity(0, 0), 200, 50, 0, 0)
    _, station = found(FixedReplies({}, info))
    assert Upload(station, waypoints(60)).run(60) is MissionResult.DENIED


@given(
    st.lists(
        st.one_of(st.binary(max_size=24), st.sampled_from([b"\xff" * 24, b"\x80" * 24, b"\x7f" * 24, b"\0\x80" * 12])),
        min_size=6,
        max_size=6,
    )
)
def test_any_telemetry_is_shown_or_dropped(payloads: list[bytes]) -> None:
    board = FakeExtension()
    board.telemetry = dict(zip(TELEMETRY, payloads, strict=True))
    world, station = found(board)
    station.send(messages.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    world.run(3)
    assert len(station.messages("HEARTBEAT")) >= 2
