# SPDX-License-Identifier: GPL-3.0-or-later
"""The history of the serial line."""

from tests.support.web_bench import WebBench

pytest_plugins = ("tests.support.web_fixtures",)


def test_the_history_of_the_serial_line_is_served(lasting_web: WebBench) -> None:
    history = lasting_web.ask("/api/link").data
    assert history["interval_s"] == 2
    assert set(history["samples"][0]) == {"round_trip_ms", "lost", "damaged"}
