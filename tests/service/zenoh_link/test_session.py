# SPDX-License-Identifier: GPL-3.0-or-later
"""The thread of the zenoh session."""

import threading

import pytest
import zenoh
from structlog.testing import capture_logs

from service.settings.zenoh import ZenohSettings
from service.settings.zenoh_config import make_config
from service.zenoh_link import session
from service.zenoh_link.session import JobKind, SessionThread
from tests.support.programs import TIMEOUT_S, free_port


def bug() -> None:
    raise KeyError("a field that the schema lacks")


def test_a_job_that_raises_does_not_end_the_thread() -> None:
    config = make_config(ZenohSettings(listen=(f"tcp/127.0.0.1:{free_port()}",)))
    thread = SessionThread(config, lambda _session: None)
    done = threading.Event()
    with capture_logs() as events:
        thread.start()
        thread.submit(bug)
        thread.submit(done.set)
        assert done.wait(TIMEOUT_S)
        thread.close()
    assert "zenoh.not_sent" in [event["event"] for event in events]


def test_a_failed_declaration_closes_the_session_and_is_repeated(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(session, "_RETRY_S", 0.01)
    sessions: list[zenoh.Session] = []
    declared = threading.Event()

    def declare(opened: zenoh.Session) -> None:
        sessions.append(opened)
        if len(sessions) == 1:
            raise zenoh.ZError("no such key")
        declared.set()

    # The same port again: zenoh could not open a second session beside the first.
    thread = SessionThread(make_config(ZenohSettings(listen=(f"tcp/127.0.0.1:{free_port()}",))), declare)
    with capture_logs() as events:
        thread.start()
        assert declared.wait(TIMEOUT_S)
        thread.close()
    assert sessions[0].is_closed()
    assert [event["event"] for event in events] == ["zenoh.not_open", "zenoh.open"]


def test_waiting_replies_to_guests_do_not_displace_replies_to_commands_or_reports() -> None:
    thread = SessionThread(make_config(ZenohSettings(listen=(f"tcp/127.0.0.1:{free_port()}",))), lambda _session: None)
    ran: list[str] = []
    done = threading.Event()
    for _ in range(1000):
        thread.submit(lambda: ran.append("reply"), JobKind.REPLY)
    thread.submit(lambda: ran.append("result of a command"), JobKind.COMMAND_REPLY)
    thread.submit(lambda: ran.append("report"))
    thread.submit(done.set)
    thread.start()
    assert done.wait(TIMEOUT_S)
    thread.close()
    assert ran[-2:] == ["result of a command", "report"]
    assert ran.count("reply") == 1000 - thread.dropped
    assert thread.dropped
