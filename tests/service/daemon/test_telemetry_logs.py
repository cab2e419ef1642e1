# SPDX-License-Identifier: GPL-3.0-or-later
"""Telemetry logs over HTTP."""

import threading
from pathlib import Path

import pytest

from service.daemon import telemetry_logs
from service.daemon.telemetry_logs import PIECE, TelemetryLogs
from tests.support.web_bench import WebBench

pytest_plugins = ("tests.support.web_fixtures",)


def test_logs_need_the_token(shared_web: WebBench) -> None:
    folder = shared_web.daemon.state_dir / "logs"
    folder.mkdir(exist_ok=True)
    contents = bytes(range(256)) * (PIECE // 128)
    (folder / "2026-01-02 03-04-05.tlog").write_bytes(contents)
    (folder / "secret").write_bytes(b"other")
    path = "/api/logs/2026-01-02%2003-04-05.tlog"
    for url in ("/api/logs", path):
        assert shared_web.ask(url).status == 401
    proof = {"Authorization": f"Bearer {shared_web.token}"}
    listed = shared_web.ask("/api/logs", **proof).data["logs"]
    assert {"name": "2026-01-02 03-04-05.tlog", "size": len(contents)} in listed
    assert "secret" not in [log["name"] for log in listed]
    first = shared_web.ask(path, **proof).body
    assert first == contents[:PIECE]
    assert first + shared_web.ask(f"{path}?start={PIECE}", **proof).body == contents
    for name in ("secret", "..%2Fweb-token", "2026-01-02%2003-04-06.tlog"):
        assert shared_web.ask(f"/api/logs/{name}", **proof).status == 404


async def test_without_a_state_directory_there_are_no_logs() -> None:
    logs = TelemetryLogs(None)
    assert await logs.list() == {"logs": []}
    logs.close()


async def test_the_logs_of_the_page(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(telemetry_logs, "_TIMEOUT_S", 0.01)
    logs = TelemetryLogs(tmp_path)
    hangs = threading.Event()
    logs._disk.submit(hangs.wait)
    with pytest.raises(TimeoutError, match="the disk does not answer"):
        await logs.read("2026-01-02 03-04-05.tlog", 0)
    with pytest.raises(TimeoutError, match="the disk does not answer"):
        await logs.list()
    hangs.set()
    logs.close()
