# SPDX-License-Identifier: GPL-3.0-or-later
"""A busy daemon's metrics, read by Prometheus' own parser."""

import asyncio
from pathlib import Path

from prometheus_client.parser import text_string_to_metric_families

from protocols.mission_item import MissionResult
from service.daemon.daemon import Daemon
from service.settings import Settings
from service.settings.addresses import parse_fc, parse_gcs
from service.web.metrics import Metrics
from tests.support.plain_station import udp_station
from tests.support.plan import plain_plan
from tests.support.programs import free_port, until_async

Samples = dict[tuple[str, tuple[str, ...]], float]


def read(metrics: Metrics) -> Samples:
    families = text_string_to_metric_families(metrics.render().decode())
    return {
        (sample.name.removeprefix("naze_bridge_"), tuple(_other_labels(sample.labels))): sample.value
        for family in families
        for sample in family.samples
    }


def _other_labels(labels: dict[str, str]) -> list[str]:
    """All labels except the vehicle's name, which each sample has."""
    assert labels["vehicle"]
    return [value for name, value in labels.items() if name != "vehicle"]


async def test_prometheus_reads_the_counters_of_a_daemon(tmp_path: Path) -> None:
    link = parse_gcs(f"udpin:127.0.0.1:{free_port()}")
    daemon = Daemon(Settings(parse_fc("sim:"), [link], tmp_path))
    metrics = Metrics(daemon)
    before = read(metrics)
    assert before["fc_state", ("no port",)] == 1
    assert ("battery_volts", ()) not in before
    running = asyncio.create_task(daemon.run())
    await daemon.started.wait()
    await until_async(lambda: ("battery_volts", ()) in read(metrics), "a battery voltage")

    def write() -> list[MissionResult]:
        with udp_station((link.host, link.port)) as station:
            station.send_heartbeat()
            station.wait_for("HEARTBEAT")
            return [station.upload(plain_plan(count)) for count in (12, 1, 147)]

    # A single home point is requested and rejected; 147 items are refused at their count.
    assert await asyncio.to_thread(write) == [MissionResult.ACCEPTED, MissionResult.INVALID, MissionResult.NO_SPACE]
    states = [line.rpartition(" ")[0] for line in metrics.render().decode().splitlines() if "fc_state{" in line]
    assert len({*states}) == len(states)
    after = read(metrics)
    assert after["fc_state", ("MSP",)] == 1
    assert after["missions_total", ("ACCEPTED",)] == 1
    assert after["missions_total", ("INVALID",)] == 1
    assert after["events_total", ("mission.upload_ended", "warning")] == 1
    assert after["events_total", ("mission.refused", "warning")] == 1
    assert after["mission_records", ()] == 12
    assert after["ground_stations", ()] == 1
    assert 0 < after["battery_volts", ()] < 30
    assert -90 < after["latitude_degrees", ()] < 90
    assert ("height_meters", ()) in after
    assert after["process_resident_memory_bytes", ()] > 1e6
    assert 0 < after["fc_round_trip_seconds", ()] < 1
    assert after["fc_dropped_bytes_total", ()] == 0
    for way in ("received", "sent"):
        for name in ("fc", str(link)):
            assert after[f"link_{way}_bytes_total", (name,)] > 0
    running.cancel()
    await asyncio.gather(running, return_exceptions=True)
