# SPDX-License-Identifier: GPL-3.0-or-later

import random
import struct
from collections.abc import Iterator
from typing import NamedTuple
from zlib import crc32

import pytest

from protocols.mavlink.ftp import MOST_DATA, FtpOp, FtpSession, file_crc32, is_opening, refuse

FILES = {"@PARAM/param.pck": bytes(range(256)) * 20, "small": b"abc", "empty": b""}


class Reply(NamedTuple):
    seq: int
    session: int
    opcode: int
    size: int
    asked: int
    is_last: int
    offset: int
    data: bytes


def request(opcode: int, data: bytes = b"", *, size: int | None = None, offset: int = 0, session: int = 0) -> list[int]:
    header = struct.pack("<HBBBBBBI", 7, session, opcode, len(data) if size is None else size, 0, 0, 0, offset)
    return list((header + data).ljust(251, b"\0"))


def replies(session: FtpSession, payload: list[int]) -> Iterator[Reply]:
    for answer in session.answer(payload):
        seq, number, opcode, size, asked, is_last, _, offset = struct.unpack_from("<HBBBBBBI", bytes(answer))
        yield Reply(seq, number, opcode, size, asked, is_last, offset, bytes(answer[12 : 12 + size]))


def opened(path: str) -> FtpSession:
    session = FtpSession(FILES.get)
    (reply,) = replies(session, request(FtpOp.OPEN_FILE_RO, path.encode()))
    assert (reply.opcode, reply.data) == (128, struct.pack("<I", len(FILES[path])))
    return session


@pytest.mark.parametrize("path", FILES)
@pytest.mark.parametrize("size", [0, 1, 80, MOST_DATA, 255])
@pytest.mark.parametrize("opcode", [FtpOp.READ_FILE, FtpOp.BURST_READ_FILE])
def test_a_file_is_read_whole(path: str, size: int, opcode: FtpOp) -> None:
    session, content = opened(path), b""
    while True:
        got = list(replies(session, request(opcode, size=size, offset=len(content))))
        if got[0].opcode == 129:
            assert got[0].data == bytes((6,))
            break
        for number, reply in enumerate(got):
            assert (reply.seq, reply.offset, reply.asked) == (8 + number, len(content), opcode)
            content += reply.data
        assert [reply.is_last for reply in got[:-1]] == [0] * (len(got) - 1)
        assert got[-1].is_last == (opcode is FtpOp.BURST_READ_FILE)
    assert content == FILES[path]


@pytest.mark.parametrize(
    "path", ["", "/", "..", "../small", "small/../small", "/etc/passwd", "@PARAM", "\x00small", "SMALL"]
)
def test_only_the_virtual_files_are_found(path: str) -> None:
    (reply,) = replies(FtpSession(FILES.get), request(FtpOp.OPEN_FILE_RO, path.encode()))
    assert (reply.opcode, reply.data) == (129, bytes((10,)))


@pytest.mark.parametrize("opcode", [6, 7, 8, 9, 10, 11, 12, 13, 16, 99])
def test_writing_and_unknown_requests_are_refused(opcode: int) -> None:
    (reply,) = replies(FtpSession(FILES.get), request(opcode, b"small"))
    assert (reply.opcode, reply.data) == (129, bytes((2, 95)))


def test_a_session_ends() -> None:
    for opcode in (FtpOp.TERMINATE_SESSION, FtpOp.RESET_SESSIONS):
        session = opened("small")
        (ended,) = replies(session, request(opcode))
        (reply,) = replies(session, request(FtpOp.READ_FILE, size=3))
        assert (ended.opcode, reply.opcode, reply.data) == (128, 129, bytes((4,)))


def test_the_stations_session_number_is_repeated() -> None:
    """Mission Planner uses 0, whatever the reply to its request to open says."""
    (reply,) = replies(opened("small"), request(FtpOp.READ_FILE, size=3, session=5))
    assert (reply.session, reply.data) == (5, b"abc")


def test_the_checksum_is_mavlinks() -> None:
    (reply,) = replies(FtpSession(FILES.get), request(FtpOp.CALC_FILE_CRC32, b"small"))
    assert reply.data == struct.pack("<I", file_crc32(b"abc"))
    # From the bit-by-bit definition, beginning with 0.
    crc = 0
    for byte in b"abc":
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xEDB88320 if crc & 1 else 0)
    assert file_crc32(b"abc") == crc != crc32(b"abc")


def test_replies_and_cut_requests_are_not_answered() -> None:
    session = FtpSession(FILES.get)
    for payload in ([], [0] * 11, request(128), request(129), request(255)):
        assert list(session.answer(payload)) == []
        assert refuse(payload) is None
    assert not is_opening([])


def test_no_request_raises_or_is_answered_without_bound() -> None:
    dice = random.Random(3)
    session = FtpSession(FILES.get)
    for _ in range(20_000):
        payload = [dice.randrange(256) for _ in range(dice.choice((0, 5, 12, 20, 251)))]
        if len(payload) > 4 and dice.random() < 0.7:
            payload[3] = dice.randrange(16)
        assert len(list(session.answer(payload))) <= 16
