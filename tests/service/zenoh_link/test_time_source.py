# SPDX-License-Identifier: GPL-3.0-or-later
"""The time of samples: from the flight controller's GPS, from NTP, or from the Pi's clock."""

import time
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as m

from bridge.fc.mavlink_telemetry import MavlinkReadings, MavlinkTelemetry
from bridge.model.vehicle import Fix, GpsFix, GpsTime, Source, Vehicle
from protocols.mavlink.frame import kinds
from service.zenoh_link.time_source import SampleClock

NOW = 1000.0


def vehicle_with(fix: Fix, wrong_by_s: float, age_s: float = 1.0) -> Vehicle:
    """A vehicle whose GPS time differed from the Pi's by `wrong_by_s`, received `age_s` ago."""
    vehicle = Vehicle()
    vehicle.hear(GpsFix(NOW - age_s, Source.MAVLINK, fix, 9))
    vehicle.hear(GpsTime(NOW - age_s, Source.MAVLINK, time.time() - age_s + wrong_by_s))
    return vehicle


@pytest.mark.parametrize("wrong_by_s", [0.0, 0.2, 7200.0, -30.0])
def test_a_3d_fix_corrects_a_wrong_clock(tmp_path: Path, wrong_by_s: float) -> None:
    clock = SampleClock(lambda: NOW, tmp_path / "synchronized")
    assert clock.source(vehicle_with(Fix.THREE_D, wrong_by_s)) == "gps"
    corrected_by_s = clock.unix_s() - time.time()
    if abs(wrong_by_s) < 0.5:
        assert corrected_by_s <= 0.001  # the Pi's clock
    else:
        assert corrected_by_s == pytest.approx(wrong_by_s, abs=5.0)
    assert clock.source(Vehicle()) == "pi"
    (tmp_path / "synchronized").touch()
    assert clock.source(Vehicle()) == "ntp"
    assert clock.unix_s() <= time.time() + 0.001


def test_a_clock_that_is_set_later_is_not_corrected_twice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By chrony or by hand, which leave no file as timesyncd does."""
    clock, true_s, pi_s = SampleClock(lambda: NOW, tmp_path / "synchronized"), 1_790_000_000.0, 1_700_000_000.0
    monkeypatch.setattr(time, "time", lambda: pi_s)
    assert clock.source(vehicle_with(Fix.THREE_D, true_s - pi_s)) == "gps"
    monkeypatch.setattr(time, "time", lambda: true_s)
    assert clock.unix_s() == pytest.approx(true_s, abs=1.0)
    assert clock.source(Vehicle()) == "pi"
    assert clock.unix_s() == pytest.approx(true_s, abs=1.0)


@pytest.mark.parametrize(("fix", "age_s"), [(Fix.TWO_D, 1.0), (Fix.NO_FIX, 1.0), (Fix.THREE_D, 9.0)])
def test_without_a_recent_fix_there_is_no_gps_time(tmp_path: Path, fix: Fix, age_s: float) -> None:
    clock = SampleClock(lambda: NOW, tmp_path / "synchronized")
    assert clock.source(vehicle_with(fix, 7200.0, age_s)) == "pi"
    assert clock.unix_s() <= time.time() + 0.001


@pytest.mark.parametrize(("unix_s", "known"), [(1_777_636_800.25, 1_777_636_800.25), (0.0, None), (412.0, None)])
def test_a_mavlink_autopilots_time_is_used_once_it_is_known(unix_s: float, known: float | None) -> None:
    """Until it has the time, ArduPilot counts from its start."""
    vehicle, codec = Vehicle(), m.MAVLink(None, srcSystem=1, srcComponent=1)
    telemetry = MavlinkTelemetry(MavlinkReadings(vehicle))
    sent = m.MAVLink_heartbeat_message(2, 3, 0, 0, 4, 3), m.MAVLink_system_time_message(round(unix_s * 1e6), 9)
    frames = [bytes(each.pack(codec)) for each in sent]
    telemetry.take(frames, kinds(frames), NOW)
    telemetry.settle()
    heard_time = vehicle.last(GpsTime)
    assert (None if heard_time is None else heard_time.unix_s) == known
