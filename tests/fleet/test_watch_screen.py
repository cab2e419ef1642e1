# SPDX-License-Identifier: GPL-3.0-or-later
"""The screen of `fleet watch` in a terminal of 80 x 24, and the ages it shows."""

import json
from typing import Any

import zenoh
from rich.console import Console

from fleet.vehicle import FleetVehicle
from fleet.watch import Watch, watching
from fleet.watch_screen import ScreenRow, screen
from payloads.keys import OVERVIEW
from payloads.mission_data import plain
from payloads.overview import Overview, packed
from payloads.payload import encoding_of
from tests.support.programs import until


def vehicle(number: int, **known: Any) -> FleetVehicle:
    usual: dict[str, Any] = {"answers": True, "protocol": "MSP", "armed": False, "mission_count": 146}
    name = f"a-vehicle-with-a-rather-long-name-{number}"
    return FleetVehicle(name, str(number), **(usual | {"mission_checksum": "0123abcd", "battery_v": 12.3} | known))


def lines(rows: list[ScreenRow], top: int, *, is_listed: bool = True) -> list[str]:
    console = Console(width=80, height=24, highlight=False)
    with console.capture() as capture:
        console.print(screen(rows, top, 24 - 5, is_connected=True, is_listed=is_listed))
    return capture.get().splitlines()


def test_a_large_fleet_fits_a_small_terminal() -> None:
    rows = [ScreenRow(vehicle(number), 0.5) for number in range(1000)]
    shown = lines(rows, 0)
    assert len(shown) == 23
    assert max(len(line) for line in shown) <= 80
    assert shown[0] == "1,000 vehicles, 0 armed, 0 with problems"
    assert shown[-1].startswith("1 to 19 of 1,000; arrow keys and space scroll.")
    assert lines(rows, 981)[-1].startswith("982 to 1,000 of 1,000;")


def test_vehicles_with_problems_are_marked() -> None:
    rows = [
        ScreenRow(vehicle(1, bridges=2), 0.1),
        ScreenRow(vehicle(3), 99.0),
        ScreenRow(vehicle(4, protocol="searching"), 0.1),
        ScreenRow(vehicle(5), 0.1),
    ]
    assert [bool(row.problem) for row in rows] == [True] * 3 + [False]
    text = "\n".join(lines(rows, 0))
    assert "4 vehicles, 0 armed, 3 with problems" in text
    assert [part in text for part in ("2 bridges use", "silent", "no flight")] == [True] * 3


def test_a_vehicle_that_was_not_heard_yet_is_counted_as_such() -> None:
    """Its values are unknown: it is neither disarmed nor a problem."""
    armed = [ScreenRow(vehicle(number, armed=True), 0.1) for number in range(3)]
    unheard = [ScreenRow(FleetVehicle(f"owl-{number}", "1"), None) for number in range(2000)]
    shown = lines([*armed, *unheard], 0)
    assert shown[0] == "Heard 3 of 2,003 vehicles, 3 armed, 0 with problems"
    assert lines(armed, 0, is_listed=False)[0] == "Heard 3 of at least 3 vehicles, 3 armed, 0 with problems"
    assert lines([], 0, is_listed=False) == ["Waiting for the router's list. Ctrl-C ends."]
    row = next(line for line in shown if line.startswith("owl-0 "))
    assert row.split(maxsplit=1)[1].split() == ["-"] * 5 + ["not", "heard", "yet"]


class Sample:
    """A zenoh sample as used by `watch`."""

    encoding = "application/json"

    def __init__(self, key: str, state: Any = None, kind: Any = None) -> None:
        self.key_expr = key
        self.kind = kind
        self.payload = self
        self._data = json.dumps(state).encode()

    def to_bytes(self) -> bytes:
        return self._data


def test_ten_thousand_vehicles_are_counted_as_heard() -> None:
    watch = Watch(None, None, "fleet")  # type: ignore[arg-type]
    for number in range(10_000):
        watch.token(Sample(f"fleet/kite-{number}/v1/alive/1", kind=zenoh.SampleKind.PUT))  # type: ignore[arg-type]
    for number in range(7_312):
        overview = {"link": "MSP", "armed": number % 50 == 0, "time_s": 7}
        watch.overview(Sample(f"fleet/kite-{number}/v1/overview", overview))  # type: ignore[arg-type]
    rows = [ScreenRow(vehicle, age_s) for vehicle, age_s in watch.look()]
    assert lines(rows, 0)[0] == "Heard 7,312 of 10,000 vehicles, 147 armed, 0 with problems"
    assert {row.vehicle.armed for row in rows if not row.is_heard} == {None}


def test_only_vehicles_on_the_screen_send_their_states() -> None:
    config = zenoh.Config()
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("listen/endpoints", "[]")
    overview = Overview("MSP", False, "AUTO", 1234, None, None, -3, 146, 0xABCD, 90, 25, 3, 3)
    cbor = packed({"time_s": 7} | plain(overview))
    encoding = encoding_of(OVERVIEW)
    fields = ("battery_v", "height_m", "mission_checksum", "heading_deg", "speed_m_s", "fix", "mission_state")
    with zenoh.open(config) as session, watching(session, session, "fleet") as watch:
        states = [session.declare_publisher(f"fleet/{name}/v1/state") for name in ("kite", "owl")]
        tokens = [session.liveliness().declare_token(f"fleet/{name}/v1/alive/1") for name in ("kite", "owl")]

        def shows(owl: tuple[Any, ...], *followed: bool) -> None:
            def is_so() -> bool:
                seen = [tuple(getattr(each, field) for field in fields) for each, _ in watch.look()]
                # zenoh 1.10 declares it as a bool.
                readers = [each.matching_status.matching for each in states]  # type: ignore[attr-defined]
                return readers == [*followed] and seen[1:] == [owl]

            until(is_so, f"{owl}, {followed}")

        session.put("fleet/owl/v1/overview", cbor, encoding=encoding)
        shown = (12.34, -3, "0000abcd", 90, 2.5, "3D", "active")
        shows(shown, False, False)
        watch.follow(["owl"])
        state = {"link": {"state": "MSP"}, "battery": {"voltage_v": 11.5}}
        states[1].put(json.dumps(state), encoding="application/json")
        shows((11.5, *[None] * 6), False, True)
        watch.follow(["kite"])
        session.put("fleet/owl/v1/overview", cbor, encoding=encoding)
        shows(shown, True, False)
        del tokens
