# SPDX-License-Identifier: GPL-3.0-or-later
"""A vehicle on a lossy datagram link: telemetry is not repeated; events and reports are recovered."""

import json
from itertools import count
from pathlib import Path
from typing import Any

from tests.service.zenoh_link.test_history import recovering
from tests.support.benches import Starter
from tests.support.lossy_udp import Direction, LossyUdp
from tests.support.plan import plain_plan
from tests.support.programs import free_port, until
from tests.support.zenoh_bench import Reader, endpoint, session, zenoh_bench
from tests.support.zenoh_router import running_router


def test_reports_are_recovered_on_a_link_that_loses_datagrams(start: Starter, tmp_path: Path) -> None:
    tcp, udp_port = endpoint(), free_port()
    config = tmp_path / "router.json5"
    listen = {"endpoints": [tcp, f"udp/127.0.0.1:{udp_port}"]}
    config.write_text(json.dumps({"mode": "router", "listen": listen, "scouting": {"multicast": {"enabled": False}}}))
    reports: list[Any] = []
    with (
        running_router(tmp_path, tcp, config),
        LossyUdp(("127.0.0.1", udp_port)) as air,
        session(connect=tcp) as opened,
    ):
        bench = zenoh_bench(start, f'connect = ["udp/127.0.0.1:{air.address[1]}"]')
        subscriber, reader = recovering(opened, "mission/report", reports), Reader(opened)
        reader.wait("telemetry/attitude")
        bench.daemon.push(plain_plan(4))
        until(lambda: len(reports) == 1, "a report")
        numbers = count()
        air.swallow = lambda way, _: way is Direction.TO_DAEMON and next(numbers) % 4 == 0
        until(lambda: has_gap([each["seq"] for each in reader.of("telemetry/attitude")]), "a lost sample")
        # A report is requested again only once; if that reply is lost too, the report is lost.
        air.swallow = lambda way, _: way is Direction.TO_DAEMON
        bench.daemon.push(plain_plan(5))
        air.swallow = lambda way, _: False
        bench.daemon.push(plain_plan(6))
        until(lambda: len(reports) >= 3, "all reports")
        assert [len(each["sent"]) for each in reports] == [4, 5, 6]
        del subscriber


def has_gap(numbers: list[int]) -> bool:
    return len(numbers) > 1 and numbers[-1] - numbers[0] >= len(numbers)
