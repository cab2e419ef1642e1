# SPDX-License-Identifier: GPL-3.0-or-later
"""A daemon's metrics in Prometheus' text format, read at the moment of a scrape.

Imported only if it is used: the client library takes several megabytes.
"""

from collections.abc import Iterator, Mapping

from prometheus_client import CollectorRegistry, Counter, ProcessCollector, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from bridge.fc.session import TRANSITIONS
from bridge.missions.mission_service import DeliveryResult
from bridge.model.events import BridgeEvent
from bridge.model.missions import ArrivedMission
from payloads.names import host_name
from reports.vehicle_groups import VehicleReport
from service.daemon.daemon import Daemon, Follower
from service.machine.package import version

#: The content type of /metrics.
CONTENT_TYPE = "text/plain; version=0.0.4; charset=utf-8"
_PREFIX = "naze_bridge_"
#: The followers' values that only grow.
_COUNTED = {"zenoh_dropped"}
_FIXES = {"none": 0, "2D": 2, "3D": 3}


class Metrics(Follower):
    """Collects from a daemon."""

    def __init__(self, daemon: Daemon) -> None:
        self._registry = CollectorRegistry()
        self._registry.register(_State(daemon))
        ProcessCollector(registry=self._registry)
        settings = daemon.settings.zenoh
        self._labelled = CollectorRegistry()
        self._labelled.register(_OfVehicle(self._registry, host_name() if settings is None else settings.vehicle))
        self._events = self._counter("events", "Events of the log (docs/events.md).", "event", "level")
        self._missions = self._counter("missions", "Missions received, by their final ack.", "ack")
        daemon.add_follower(self)

    def render(self) -> bytes:
        return generate_latest(self._labelled)

    def happened(self, event: BridgeEvent) -> None:
        self._events.labels(event.name_in_log, event.level).inc()

    def mission_ended(self, _mission: ArrivedMission, delivery: DeliveryResult) -> None:
        self._missions.labels(delivery.ack.name).inc()

    def _counter(self, name: str, meaning: str, *labels: str) -> Counter:
        return Counter(_PREFIX + name, meaning, labels, registry=self._registry)


class _OfVehicle(Collector):
    """All metrics of a registry with the vehicle's name as a label, for a fleet in one database."""

    def __init__(self, registry: CollectorRegistry, vehicle: str) -> None:
        self._registry = registry
        self._vehicle = vehicle

    def collect(self) -> Iterator[Metric]:
        for family in self._registry.collect():
            family.samples = [
                sample._replace(labels={**sample.labels, "vehicle": self._vehicle}) for sample in family.samples
            ]
            yield family


class _State(Collector):
    """The state of the daemon and its bridge at the moment of a scrape."""

    def __init__(self, daemon: Daemon) -> None:
        self._daemon = daemon

    def collect(self) -> Iterator[Metric]:
        yield _gauge("build_info", "The version that runs.", {"version": version()}, 1)
        yield from self._links()
        yield from self._flight_controller()
        yield from self._vehicle()
        for name, value in self._daemon.followers_status().items():
            if name in _COUNTED:
                yield _counted(name, f"As `naze-bridge status` shows it: {name}.", value)
            elif isinstance(value, int):
                yield _gauge(name, f"As in `naze-bridge status`: {name}.", {}, value)

    def _links(self) -> Iterator[Metric]:
        for way in ("received", "sent"):
            sizes = _counters(f"link_{way}_bytes", f"Bytes {way}, by link; fc: the flight controller's port.", "link")
            for name, traffic in self._daemon.traffic.items():
                sizes.add_metric([name], getattr(traffic, f"bytes_{way}"))
            yield sizes
        counters = self._daemon.bridge.counters()
        stations = len(self._daemon.report().link.ground_stations)
        yield _gauge("ground_stations", "Ground stations currently heard.", {}, stations)
        damaged = counters.bad_frames
        yield _counted("ground_damaged_frames", "Frames from ground stations with a wrong checksum.", damaged)
        refused = _counters("refused_frames", "Frames from ground stations without write access.", "link", "why")
        for (link, why), count in counters.refused.items():
            refused.add_metric([link, why], count)
        yield refused

    def _flight_controller(self) -> Iterator[Metric]:
        link = self._daemon.report().link
        states = GaugeMetricFamily(_PREFIX + "fc_state", "1 for the link's current state.", labels=["state"])
        for name in dict.fromkeys(each.name for each in TRANSITIONS):
            states.add_metric([name], float(name == link.state))
        yield states
        dropped = self._daemon.fc.dropped_bytes
        yield _counted(
            "fc_dropped_bytes", "Bytes to the flight controller dropped because its line was too slow.", dropped
        )
        # These restart at 0 with each flight controller found, which Prometheus permits for counters.
        damaged = link.bad_checksums or 0
        yield _counted("fc_damaged_frames", "Frames from the flight controller with a wrong checksum.", damaged)
        if link.requests_lost is not None and link.round_trip_ms is not None:
            lost = link.requests_lost
            yield _counted("fc_lost_requests", "MSP requests that were not answered in time.", lost)
            meaning = "From an MSP request to its reply, as read, smoothed."
            yield _gauge("fc_round_trip_seconds", meaning, {}, link.round_trip_ms / 1000)

    def _vehicle(self) -> Iterator[Metric]:
        for name, (meaning, value) in vehicle_gauges(self._daemon.report()).items():
            if value is not None:
                yield _gauge(name, meaning, {}, value)


def vehicle_gauges(report: VehicleReport) -> Mapping[str, tuple[str, float | None]]:
    """Meaning and value by name. Those without a value are left out."""
    return {
        "armed": ("1 while it is armed.", report.status.armed),
        "battery_volts": ("Battery.", report.battery.voltage_v),
        "latitude_degrees": ("By GPS, WGS 84.", report.position.lat_deg),
        "longitude_degrees": ("By GPS, WGS 84.", report.position.lon_deg),
        "height_meters": ("Above the launch point.", report.position.height_m),
        "gps_fix": ("0, 2 or 3 dimensions.", _FIXES.get(report.gps.fix or "")),
        "satellites": ("Satellites in use.", report.gps.satellites),
        "mission_records": (
            "Records that the flight controller holds.",
            None if report.mission is None else report.mission.count,
        ),
    }


def _gauge(name: str, meaning: str, labels: Mapping[str, str], value: float) -> Metric:
    family = GaugeMetricFamily(_PREFIX + name, meaning, labels=list(labels))
    family.add_metric(list(labels.values()), value)
    return family


def _counted(name: str, meaning: str, value: float) -> Metric:
    return CounterMetricFamily(_PREFIX + name, meaning, value)


def _counters(name: str, meaning: str, *labels: str) -> CounterMetricFamily:
    return CounterMetricFamily(_PREFIX + name, meaning, labels=labels)
