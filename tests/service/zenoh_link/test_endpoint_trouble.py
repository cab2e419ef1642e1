# SPDX-License-Identifier: GPL-3.0-or-later
"""A failed connection is reported with its reason."""

from tests.support.benches import Starter
from tests.support.programs import until
from tests.support.zenoh_bench import endpoint, zenoh_bench


def test_a_failed_connection_is_reported_with_its_reason(start: Starter) -> None:
    where = endpoint()
    bench = zenoh_bench(start, f'connect = ["{where}"]')
    alone = until(lambda: bench.daemon.has_logged("zenoh.alone"), "a log entry about it")
    assert alone["why"] == f"{where}: no router is running there (connection refused)"
