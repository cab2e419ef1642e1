# SPDX-License-Identifier: GPL-3.0-or-later
"""The screen of `fleet watch` in a terminal of 80 x 24, and the ages it shows."""

import json
from typing import Any

from rich.console import Console

from service.cli.fleet.vehicle import FleetVehicle, in_order
from service.cli.fleet.watch import Watch
from service.cli.fleet.watch_screen import ScreenRow, screen


def vehicle(number: int, **known: Any) -> FleetVehicle:
    usual: dict[str, Any] = {"answers": True, "protocol": "MSP", "armed": False, "mission_count": 146}
    name = f"a-vehicle-with-a-rather-long-name-{number}"
    return FleetVehicle(name, str(number), **(usual | {"mission_checksum": "0123abcd", "battery_v": 12.3} | known))


def lines(rows: list[ScreenRow], top: int) -> list[str]:
    console = Console(width=80, height=24, highlight=False)
    with console.capture() as capture:
        console.print(screen(rows, top, 24 - 5, is_connected=True))
    return capture.get().splitlines()


def test_a_large_fleet_fits_a_small_terminal() -> None:
    rows = [ScreenRow(vehicle(number), 0.5) for number in range(1000)]
    shown = lines(rows, 0)
    assert len(shown) == 23
    assert max(len(line) for line in shown) <= 80
    assert shown[0] == "1000 vehicles, 0 armed, 0 with problems"
    assert shown[-1].startswith("1 to 19 of 1000; arrow keys and space scroll.")
    assert lines(rows, 981)[-1].startswith("982 to 1000 of 1000;")


def test_problems_are_named() -> None:
    rows = [
        ScreenRow(vehicle(1, bridges=2), 0.1),
        ScreenRow(vehicle(2, answers=False), None),
        ScreenRow(vehicle(3), 99.0),
        ScreenRow(vehicle(4, protocol="searching"), 0.1),
        ScreenRow(vehicle(5), 0.1),
    ]
    assert [bool(row.problem) for row in rows] == [True] * 4 + [False]
    text = "\n".join(lines(rows, 0))
    assert "5 vehicles, 0 armed, 4 with problems" in text
    assert [said in text for said in ("2 bridges use", "sends no state", "silent", "no flight")] == [True] * 4


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


def test_a_backlog_is_shown_with_its_true_age() -> None:
    """The vehicle's clock is an hour behind; 8 s of states arrive at once after a stall."""
    import zenoh

    now = 5000.0
    watch = Watch("fleet", lambda: now)
    watch.token(Sample("fleet/kite/v1/alive/1", kind=zenoh.SampleKind.PUT))  # type: ignore[arg-type]

    def heard(made_at: float) -> float | None:
        watch.sample(Sample("fleet/kite/v1/state", {"time_s": made_at}))  # type: ignore[arg-type]
        return watch.look()[1][0]

    assert heard(1400.0) == 0
    now = 5008.0
    assert heard(1401.0) == 7
    assert heard(1408.0) == 0
    now = 5009.0
    assert heard(200.0) == 0, "its clock was set back"


def test_numbers_in_names_are_ordered_by_value() -> None:
    names = ["kite-10", "kite-2", "2kites", "kite", "kite-02b", "Kite-1"]
    assert sorted(names, key=in_order) == ["2kites", "Kite-1", "kite", "kite-2", "kite-02b", "kite-10"]
