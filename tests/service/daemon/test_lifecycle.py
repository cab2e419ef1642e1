# SPDX-License-Identifier: GPL-3.0-or-later

import asyncio
import os
import signal
import threading

from service.daemon.daemon import Daemon
from service.daemon.lifecycle import run_until_signal
from service.machine import event_loop
from service.machine.notify import Notifier
from service.settings import Settings
from service.settings.addresses import SimulatedFc
from tests.support.programs import TIMEOUT_S, until_async


def test_a_disk_that_hangs_during_a_reload_does_not_hold_up_the_stop() -> None:
    reading, answers, given_up = threading.Event(), threading.Event(), threading.Event()

    def load() -> Settings:
        reading.set()
        if not answers.wait(TIMEOUT_S):
            given_up.set()
        return Settings(SimulatedFc())

    async def main() -> None:
        daemon = Daemon(Settings(SimulatedFc()))
        running = asyncio.create_task(run_until_signal(daemon, Notifier({}), load))
        await daemon.started.wait()
        os.kill(os.getpid(), signal.SIGHUP)
        await until_async(reading.is_set, "the reload")
        os.kill(os.getpid(), signal.SIGTERM)
        await running

    event_loop.run(main())
    assert not given_up.is_set()
    answers.set()
