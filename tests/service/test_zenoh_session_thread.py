# SPDX-License-Identifier: GPL-3.0-or-later
"""The thread of the zenoh session."""

import threading

from structlog.testing import capture_logs

from service.settings.zenoh import ZenohSettings
from service.settings.zenoh_config import make_config
from service.zenoh_link.session import SessionThread
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
