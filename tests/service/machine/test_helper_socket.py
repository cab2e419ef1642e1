# SPDX-License-Identifier: GPL-3.0-or-later
"""The daemon's side of the helper's socket."""

import asyncio
from pathlib import Path

import pytest

from payloads.mission_data import Json
from service.machine.helper_socket import HelperError, ask_helper, unit_of


async def ask(folder: Path, reply: bytes, request: Json, body: tuple[bytes, ...] = ()) -> tuple[Json | str, bytes]:
    """The reply of a helper that says `reply`, or the error; and all that it received."""
    received = bytearray()

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        received.extend(await reader.readuntil(b"\n"))
        for piece in body:
            received.extend(await reader.readexactly(len(piece)))
        writer.write(reply)
        writer.close()

    async with await asyncio.start_unix_server(serve, folder / f"naze-bridge-helper-{unit_of(request['action'])}.sock"):
        try:
            return await ask_helper(request, body), bytes(received)
        except HelperError as error:
            return str(error), bytes(received)


@pytest.fixture(autouse=True)
def _service(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RUNTIME_DIRECTORY", str(tmp_path / "run"))


def test_a_request_with_a_body(tmp_path: Path) -> None:
    asked = ask(tmp_path, b'{"version": "2.0"}\n', {"action": "install", "size": 4}, (b"ab", b"cd"))
    assert asyncio.run(asked) == ({"version": "2.0"}, b'{"action": "install", "size": 4}\nabcd')


@pytest.mark.parametrize(
    ("reply", "why"),
    [
        (b'{"error": "No earlier version is kept."}\n', "No earlier version is kept."),
        (b"", "The helper ended without an answer"),
        (b"Traceback\n", "The helper ended without an answer"),
        (b"7\n", "The helper ended without an answer"),
        (b" " * (3 << 20), "The helper's answer is too long"),
    ],
)
def test_a_refusal(tmp_path: Path, reply: bytes, why: str) -> None:
    said, _ = asyncio.run(ask(tmp_path, reply, {"action": "downgrade"}))
    assert isinstance(said, str)
    assert why in said


def test_without_a_helper(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(HelperError, match=r"cannot be reached: .*naze-bridge-helper-look.socket"):
        asyncio.run(ask_helper({"action": "overview"}))
    monkeypatch.delenv("RUNTIME_DIRECTORY")
    with pytest.raises(HelperError, match="works only for the service"):
        asyncio.run(ask_helper({"action": "overview"}))
